"""The closed loop as one system M(u) u'' = F(t, u, u') and its step."""

from collections.abc import Sequence

import numpy as np
import pinocchio as pin
from scipy.linalg.lapack import dposv, dpotrf, dpotrs

from sea_ident._typing import FloatArray
from sea_ident.exceptions import SimulationError
from sea_ident.robot.model import rotor_body
from sea_ident.simulation.controller import Drive
from sea_ident.simulation.friction import JointFriction
from sea_ident.simulation.plant import Plant
from sea_ident.simulation.planted import PlantedTorques, coordinate_map, motor_coordinates
from sea_ident.simulation.rosenbrock import RosenbrockW

LOAD_ROUNDS = 3
"""An effect takes a few percent of the load, so that a round leaves a few percent of the error: here of one step."""

LOAD_ROUNDS_EXACT = 60
"""Until next to nothing changes any more; for what is recorded."""

NEXT_TO_NOTHING = 1e-14
"""Change of the loads from one round to the next, as a share of the largest, that is rounding [-]."""

SHRINKING = 0.7
"""Ratio of two changes in turn up to which a load is taken for the sum of a geometric series [-]."""


ROUNDING = 1e-12
"""Coefficients of the method below this are sums that cancel [-]."""


class Step:
    """What steps of one length need of the method, and of the linear part of a closed loop.

    Args:
        method: of integration.
        length: [s].
        stiffness: (size, size) of gains and springs.
        damping: (size, size) the same.
    """

    def __init__(self, method: RosenbrockW, length: float, stiffness: FloatArray, damping: FloatArray) -> None:
        self.length, self.hgamma, stages = length, length * method.gamma, len(method.weights)
        # One product gives the stage value and the coupling of the right-hand side.
        self.combine = [
            np.ascontiguousarray(np.stack([method.stage[i, :i], method.coupling[i, :i] / length]))
            for i in range(stages)
        ]
        self.weights, self.error = method.weights, method.error
        self.nodes = [float(node) * length for node in method.nodes]
        self.drift = [float(share) * length if abs(share) > ROUNDING else 0.0 for share in method.drift]
        self.implicit = damping + self.hgamma * stiffness
        size = len(stiffness)
        self.sides = np.zeros((size, 2 * size), order="F")
        self.sides[:, :size] = -self.hgamma * stiffness


class ClosedLoop:
    """Robot, springs, friction and drive, in the coordinates u = (q, theta of the elastic joints).

    Everything inside a step is done with scalars and preallocated arrays: at a dozen coordinates the overhead of a
    call outweighs the arithmetic.

    Args:
        plant: all numbers.
        drive: what the motors are asked for.
        motor_friction: of each joint.
        link_friction: of each elastic joint.
        planted: what else acts as a torque.
        method: of integration.
        demand: (n,) torque that a motor is asked for over what its load and its rotor need [-].
    """

    def __init__(
        self,
        plant: Plant,
        drive: Drive,
        motor_friction: Sequence[JointFriction],
        link_friction: Sequence[JointFriction | None],
        planted: PlantedTorques | None,
        method: RosenbrockW,
        demand: FloatArray,
    ) -> None:
        robot = plant.robot
        self.plant, self.planted, self._method = plant, planted, method
        self.n = n = robot.n
        self.elastic = [int(i) for i in robot.elastic_indices]
        self.motor = motor_coordinates(robot)
        self.size = size = n + len(self.elastic)
        self._map = coordinate_map(robot)
        self._map_t = np.ascontiguousarray(self._map.T)
        self._offset = robot.offset if np.any(robot.offset) else None
        self._model = robot.extended_model
        self._data = robot.extended_model.createData()

        self._inverse: FloatArray | None = None
        if len(self._map) == size and np.linalg.matrix_rank(self._map) == size:
            inverse = np.asarray(np.linalg.inv(self._map), dtype=np.float64)
            self._inverse, self._inverse_t = inverse, np.ascontiguousarray(inverse.T)

        self._bodies: pin.Model | None = None
        if planted is not None and planted.needs_load:
            self._bodies = pin.Model(self._model)
            for index in robot.rotor_indices:
                self._bodies.inertias[int(index)] = rotor_body(0.0)
            self._bodies_data = self._bodies.createData()
        self._load = [0.0] * n

        self.link_friction = list(link_friction)
        kp, kd = drive.position_gain.tolist(), drive.velocity_gain.tolist()
        k1, k3, d = plant.stiffness.tolist(), plant.cubic_stiffness.tolist(), plant.spring_damping.tolist()
        self._numbers = list(zip(range(n), self.motor, kp, kd, k1, k3, d, strict=True))
        self.replace_motor_friction(motor_friction)
        self._demand = [(i, m, f) for i, m, f in zip(range(n), self.motor, demand.tolist(), strict=True) if f != 1.0]
        self._reaching = np.ones(size)
        self._reaching[self.motor] = 1.0 / demand
        self._linear = self._linear_part(kp, kd, k1, d)
        self.increments = np.zeros((len(method.weights), 2 * size))
        self._rows = [(row[:size], row[size:]) for row in self.increments]
        self._right = np.zeros(2 * size)
        self._rates, self._accelerations = self._right[:size], self._right[size:]
        self._evaluated: FloatArray | None = None
        self._mass = np.zeros((size, size))
        self.acceleration = np.zeros(size)
        self.tau_motor = [0.0] * n
        self.tau_spring = [0.0] * n

    def _linear_part(
        self, kp: list[float], kd: list[float], k1: list[float], d: list[float]
    ) -> tuple[FloatArray, FloatArray]:
        """(size, size) stiffness and damping of gains and springs."""
        stiffness, damping = np.zeros((self.size, self.size)), np.zeros((self.size, self.size))
        between = np.array([[1.0, -1.0], [-1.0, 1.0]])
        for i, m in enumerate(self.motor):
            stiffness[m, m] += kp[i] * self._reaching[m]
            damping[m, m] += kd[i] * self._reaching[m]
            if m != i:
                stiffness[np.ix_([i, m], [i, m])] += k1[i] * between
                damping[np.ix_([i, m], [i, m])] += d[i] * between
        return stiffness, damping

    def replace_motor_friction(self, motor_friction: Sequence[JointFriction]) -> None:
        """Go on with another friction of the motors."""
        self.motor_friction = list(motor_friction)
        sides = zip(self._numbers, self.motor_friction, self.link_friction, strict=True)
        self._joints, self._slopes = [], []
        for (i, m, kp, kd, k1, k3, d), on_motor, on_link in sides:
            self._joints.append((i, m, kp, kd, k1, k3, d, on_motor.torque, None if on_link is None else on_link.torque))
            self._slopes.append((m, on_motor.slope))
            if on_link is not None:
                self._slopes.append((i, on_link.slope))

    def _position(self, u: FloatArray) -> FloatArray:
        """(nv,) position of Pinocchio's model."""
        x: FloatArray = self._map.dot(u)
        return x if self._offset is None else x + self._offset

    # -- forces ------------------------------------------------------------------------------------------------------

    def _forces(self, time: float, elapsed: float, bias: list[float], u: FloatArray, w: FloatArray) -> list[float]:
        """Generalised forces of drive, springs, friction and planted effects [N m]; keeps the torques of the drive."""
        position, velocity = u.tolist(), w.tolist()
        out = [0.0] * self.size
        tau_motor, tau_spring = self.tau_motor, self.tau_spring
        for i, m, kp, kd, k1, k3, d, motor_friction, link_friction in self._joints:
            theta, dtheta = position[m], velocity[m]
            torque = bias[i] - kp * theta - kd * dtheta
            tau_motor[i] = torque
            torque -= motor_friction(theta, dtheta)
            if m != i:
                q, dq = position[i], velocity[i]
                deflection = theta - q
                spring = deflection * (k1 + k3 * deflection * deflection) + d * (dtheta - dq)
                tau_spring[i] = spring
                out[m] = torque - spring
                out[i] = spring if link_friction is None else spring - link_friction(q, dq)
            else:
                tau_spring[i] = self._load[i]
                out[i] = torque
        if self.planted is not None:
            self.planted.add(time, elapsed, u, w, tau_motor, tau_spring, out)
        for i, m, factor in self._demand:
            load = tau_spring[i] if m != i else tau_spring[i] - self._load[i]  # what the bodies need comes later
            out[m] = (out[m] + load) / factor - load
        return out

    def evaluate(self, time: float, bias: list[float], y: FloatArray) -> None:
        """Torques and `acceleration` at a state (2 size,) that was reached by accepted steps."""
        u, w = y[: self.size], y[self.size :]
        self._find_load(time, 0.0, bias, u, w, LOAD_ROUNDS_EXACT)
        self._mass, force = self._mass_and_force(time, 0.0, bias, u, w)
        _, self.acceleration, info = dposv(self._mass, force)
        if info != 0:
            raise SimulationError(self._not_positive(u))
        self._evaluated = y

    def check_mass(self, y: FloatArray) -> None:
        """Refuse a state in which the mass matrix is not positive definite.

        Raises:
            SimulationError: the message names the joint with the smallest inertia.
        """
        u = y[: self.size]
        mass = self._map_t @ pin.crba(self._model, self._data, self._position(u)) @ self._map
        if dpotrf(mass)[1] != 0:
            raise SimulationError(self._not_positive(u))

    def accept(self, time: float, y: FloatArray) -> None:
        """Tell everything that has memory where the step ended."""
        values = y.tolist()
        size = self.size
        for i, friction in enumerate(self.motor_friction):
            m = self.motor[i]
            friction.accept(values[m], values[size + m])
        for i in self.elastic:
            link_friction = self.link_friction[i]
            if link_friction is not None:
                link_friction.accept(values[i], values[size + i])
        if self.planted is not None:
            self.planted.accept(time, y[:size], y[size:], self.tau_motor, self.tau_spring)

    # -- one step ----------------------------------------------------------------------------------------------------

    def steps(self, length: float) -> Step:
        """What steps of a length [s] need."""
        return Step(self._method, length, *self._linear)

    def step(
        self, of: Step, time: float, biases: list[list[float]], bias_rate: FloatArray, y: FloatArray
    ) -> FloatArray:
        """The state (2 size,) one step later; `increments` are then those of its stages.

        Args:
            of: the length of the step.
            time: [s].
            biases: torque of the drive at zero state, at each stage.
            bias_rate: (size,) how fast it changes [N m/s]: gains turn it round with the state, and a step that knew but
                the one would be off by what a stiff drive makes of the other.
            y: (2 size,) positions and velocities.
        """
        size, hgamma, increments, elapsed = self.size, of.hgamma, self.increments, of.nodes
        rates, accelerations, right = self._rates, self._accelerations, self._right
        if self._evaluated is not y:
            self.evaluate(time, biases[0], y)
        u, w = y[:size], y[size:]
        matrix = self._mass * (1.0 / hgamma)
        matrix += of.implicit
        matrix.reshape(-1)[:: size + 1] += self._damping(time, u, w)
        factor, info = dpotrf(matrix)
        if info != 0:
            raise SimulationError(self._not_positive(u))
        drift = dposv(self._mass, bias_rate * self._reaching)[1]
        of.sides[:, size:] = self._mass
        solve = dpotrs(factor, of.sides)[0]
        rates[:] = w
        accelerations[:] = self.acceleration
        self._evaluated = None  # the stages leave torques of their own behind
        for i in range(len(increments)):
            if i > 0:
                shift, coupling = of.combine[i].dot(increments[:i])
                stage = y + shift
                u, w = stage[:size], stage[size:]
                self._find_load(time + elapsed[i], elapsed[i], biases[i], u, w, LOAD_ROUNDS)
                rates[:] = w
                accelerations[:] = self._acceleration(time + elapsed[i], elapsed[i], biases[i], u, w)
                right += coupling
            if of.drift[i]:
                accelerations += of.drift[i] * drift
            row_u, row_w = self._rows[i]
            np.dot(solve, right, out=row_w)
            np.add(rates, row_w, out=row_u)
            row_u *= hgamma
        result: FloatArray = y + of.weights.dot(increments)
        return result

    def _find_load(
        self, time: float, elapsed: float, bias: list[float], u: FloatArray, w: FloatArray, rounds: int
    ) -> None:
        """What the bodies need at rigid joints, where an effect asks for it: it depends on the acceleration."""
        if self._bodies is None:
            return
        x, v = self._position(u), self._map.dot(w)
        last = before = np.array(self._load)
        for k in range(rounds):
            acceleration = self._map.dot(self._acceleration(time, elapsed, bias, u, w))
            load = self._map_t.dot(pin.rnea(self._bodies, self._bodies_data, x, v, acceleration))[: self.n]
            self._load = load.tolist()
            if np.abs(load - last).max() <= NEXT_TO_NOTHING * np.abs(load).max():
                return
            if k % 3 == 2 and rounds > LOAD_ROUNDS:
                load = _limit(before, last, load)
                self._load = load.tolist()
            before, last = last, load

    def _acceleration(self, time: float, elapsed: float, bias: list[float], u: FloatArray, w: FloatArray) -> FloatArray:
        """(size,) accelerations at a trial state."""
        if self._inverse is None:
            mass, force = self._mass_and_force(time, elapsed, bias, u, w)
            _, acceleration, info = dposv(mass, force)
            if info != 0:
                raise SimulationError(self._not_positive(u))
        else:  # every coordinate is a joint of Pinocchio's model: its forward dynamics are the shorter way
            force = self._inverse_t.dot(np.array(self._forces(time, elapsed, bias, u, w)))
            x = self._position(u)
            acceleration = self._inverse.dot(pin.aba(self._model, self._data, x, self._map.dot(w), force))
        result: FloatArray = acceleration
        return result

    def _mass_and_force(
        self,
        time: float,
        elapsed: float,
        bias: list[float],
        u: FloatArray,
        w: FloatArray,
    ) -> tuple[FloatArray, FloatArray]:
        """Mass matrix (size, size), and forces (size,) with gravity, Coriolis and centrifugal forces in them."""
        x = self._position(u)
        force = np.array(self._forces(time, elapsed, bias, u, w))
        force -= self._map_t.dot(pin.nonLinearEffects(self._model, self._data, x, self._map.dot(w)))
        mass: FloatArray = self._map_t.dot(pin.crba(self._model, self._data, x)).dot(self._map)
        return mass, force

    def _damping(self, time: float, u: FloatArray, w: FloatArray) -> list[float]:
        """(size,) slopes of friction and planted effects over the speeds; a slope left out costs no order."""
        velocity = w.tolist()
        damping = [0.0] * self.size
        for k, slope in self._slopes:
            damping[k] += slope(velocity[k])
        if self.planted is not None:
            self.planted.add_damping(time, u, w, self.tau_motor, self.tau_spring, damping)
        return damping

    def _not_positive(self, u: FloatArray) -> str:
        robot = self.plant.robot
        if not np.all(np.isfinite(u)):
            k = int(np.flatnonzero(~np.isfinite(u))[0])
            i = k if k < self.n else self.elastic[k - self.n]
            return f"the position of joint {robot.joint_names[i]!r} is not finite"
        diagonal = np.diag(self._map_t @ pin.crba(self._model, self._data, self._position(u)) @ self._map)
        k = int(np.argmin(diagonal))
        i = k if k < self.n else self.elastic[k - self.n]
        side = "link" if k < self.n else "motor"
        return (
            f"the mass matrix is not positive at q = {np.round(u[: self.n], 4).tolist()}: the {side} of joint "
            f"{robot.joint_names[i]!r} has the inertia {diagonal[k]:.4g} kg m2; check masses and rotor inertias"
        )


def _limit(first: FloatArray, second: FloatArray, third: FloatArray) -> FloatArray:
    """Where series go whose changes shrink by the same factor each time (Aitken); the last of others."""
    change, next_change = second - first, third - second
    shrinks = np.abs(next_change) < SHRINKING * np.abs(change)
    rest = next_change**2 / np.where(shrinks, change - next_change, 1.0)
    return np.where(shrinks, third + rest, third)
