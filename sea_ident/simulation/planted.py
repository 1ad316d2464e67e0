"""Planted effects in a running simulation."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects import Effect, Side, SimulationState
from sea_ident.effects.acting import Action, JointAction, no_torque
from sea_ident.effects.load import LoadEffect
from sea_ident.exceptions import SimulationError
from sea_ident.robot import Robot
from sea_ident.simulation.plant import PlantedEffect

SMALL_SPEED = 1e-3
"""Speed over which slopes are taken [rad/s] or [m/s]: coarse enough to see a smoothed sign as steep."""


def overrides(effect: Effect, hook: str) -> bool:
    """Whether an effect has a hook of its own."""
    return getattr(type(effect), hook) is not getattr(Effect, hook)


def motor_coordinates(robot: Robot) -> list[int]:
    """(n,) coordinate of each motor in u = (q, theta of the elastic joints)."""
    motors = list(range(robot.n))
    for k, i in enumerate(robot.elastic_indices):
        motors[int(i)] = robot.n + k
    return motors


def coordinate_map(robot: Robot) -> FloatArray:
    """(nv, size) position of Pinocchio's model, without its offset, from u = (q, theta of the elastic joints)."""
    out = np.zeros((robot.extended_model.nv, robot.n + len(robot.elastic_indices)))
    out[:, : robot.n] = robot.link_map
    for i, motor in enumerate(motor_coordinates(robot)):
        out[:, motor] += robot.motor_map[:, i]
    return out


class _Instant(NamedTuple):
    """Time and coordinates (size,) as numbers, torques (n,)."""

    time: float
    position: list[float]
    velocity: list[float]
    tau_motor: list[float]
    tau_spring: list[float]


def _states(count: int) -> SimulationState:
    """A state of so many joints, or so many states of one: to build one anew would take longer than most effects."""
    q, dq, theta, dtheta, tau_spring, tau_motor = np.zeros((6, count))
    return SimulationState(0.0, q, dq, theta, dtheta, tau_spring, tau_motor)


class PlantedTorques:
    """Torques of effects that act on the present state, with or without memory.

    Coordinates are those of `ClosedLoop`: u = (q, theta of the elastic joints). What acts at a single joint is asked
    for with the state of that joint alone: to put the state of the robot together takes longer than most effects.

    Attributes:
        needs_load: whether an effect asks for the load of a rigid joint.
        idle: whether nothing acts as a torque.
    """

    def __init__(self, robot: Robot, effects: Sequence[PlantedEffect], begin: float) -> None:
        n = robot.n
        self._begin = begin
        coordinates = motor_coordinates(robot)
        self._motor, self._sides = np.array(coordinates, dtype=np.intp), list(enumerate(coordinates))
        torques = [p for p in effects if p.effect.side is not Side.SENSOR and overrides(p.effect, "torque")]
        acting = [(p.effect, p.effect.torque(robot, p.values)) for p in torques]
        acting = [(effect, hook) for effect, hook in acting if hook is not no_torque]
        hooks = [(effect.side, hook) for effect, hook in acting]
        # Springs and links first: the others may depend on the torque that springs transmit and rigid joints carry.
        self._joint_springs, self._springs = _by_kind([h for side, h in hooks if side is Side.SPRING], coordinates)
        self._joint_links, self._links = _by_kind([h for side, h in hooks if side is Side.LINK], coordinates)
        self._joint_others, self._others = _by_kind(
            [h for side, h in hooks if side not in (Side.SPRING, Side.LINK)], coordinates
        )
        every = (*self._joint_springs, *self._joint_links, *self._joint_others)
        self._damping = [at for at in every if at.action.of_speed]
        self._on_robot = bool(self._springs or self._links or self._others)
        self._rigid = ~np.array(robot.elastic, dtype=bool)
        self._memory = [hook.accept for _, hook in hooks if hasattr(hook, "accept")]
        rigid = {joint.name for joint in robot.joints if not joint.elastic}
        self.needs_load = any(isinstance(effect, LoadEffect) and effect.joint in rigid for effect, _ in acting)
        self.idle = not hooks
        self._state = _states(n)
        self._link, self._torque = np.zeros(n), np.zeros(n)
        self._size = n + len(robot.elastic_indices)

    def _set(
        self,
        time: float,
        elapsed: float,
        u: FloatArray,
        w: FloatArray,
        tau_motor: list[float],
        tau_spring: list[float],
    ) -> None:
        state, n = self._state, len(self._link)
        object.__setattr__(state, "time", max(time, self._begin))
        object.__setattr__(state, "elapsed", elapsed)
        state.q[:] = u[:n]
        state.dq[:] = w[:n]
        u.take(self._motor, out=state.theta)
        w.take(self._motor, out=state.dtheta)
        state.tau_motor[:] = tau_motor
        state.tau_spring[:] = tau_spring

    def _act(self) -> list[float]:
        """(size,) torques of what depends on the robot, at the state that is set, whose spring torques these change."""
        state, link, motor = self._state, self._link, self._torque
        link[:] = 0.0
        motor[:] = 0.0
        for act in self._springs:
            act(state, link, motor)
        if self._springs:
            state.tau_spring[:] -= link
        if self._links:
            before = link.copy()
            for act in self._links:
                act(state, link, motor)
            state.tau_spring[self._rigid] += (link - before)[self._rigid]
        for act in self._others:
            act(state, link, motor)
        out = [0.0] * self._size
        for (i, m), on_link, on_motor in zip(self._sides, link.tolist(), motor.tolist(), strict=True):
            out[i] += on_link
            out[m] += on_motor
        return out

    def add(
        self,
        time: float,
        elapsed: float,
        u: FloatArray,
        w: FloatArray,
        tau_motor: list[float],
        tau_spring: list[float],
        out: list[float],
    ) -> None:
        """Subtract the torques from the forces `out`, and add those in springs and on rigid joints to `tau_spring`."""
        instant = _Instant(max(time, self._begin), u.tolist(), w.tolist(), tau_motor, tau_spring)
        for at in self._joint_springs:
            tau_spring[at.i] -= at.action.on_link * at.add(instant, out)
        for at in self._joint_links:
            amount = at.add(instant, out)
            if self._rigid[at.i]:
                tau_spring[at.i] += at.action.on_link * amount
        if self._on_robot:
            self._set(time, elapsed, u, w, tau_motor, tau_spring)
            for i, torque in enumerate(self._act()):
                out[i] -= torque
            if self._springs or self._links:
                tau_spring[:] = self._state.tau_spring.tolist()
        for at in self._joint_others:
            at.add(instant, out)

    def add_damping(
        self,
        time: float,
        u: FloatArray,
        w: FloatArray,
        tau_motor: list[float],
        tau_spring: list[float],
        damping: list[float],
    ) -> None:
        """Add the slopes of the torques over the speeds, one side at a time, where they damp."""
        slopes = [0.0] * self._size
        if self._damping:
            instant = _Instant(max(time, self._begin), u.tolist(), w.tolist(), tau_motor, tau_spring)
            for at in self._damping:
                at.add_slopes(instant, slopes)
        if self._on_robot:
            n = len(self._link)
            self._set(time, 0.0, u, w, tau_motor, tau_spring)
            base = self._act()
            for side in (slice(0, n), slice(n, len(u))):
                moved = w.copy()
                moved[side] += np.where(w[side] >= 0.0, SMALL_SPEED, -SMALL_SPEED)
                self._set(time, 0.0, u, moved, tau_motor, tau_spring)
                changed = self._act()
                for k in range(len(u))[side]:
                    slopes[k] += (changed[k] - base[k]) / (moved[k] - w[k])
        for k, slope in enumerate(slopes):
            if slope > 0.0:
                damping[k] += slope

    def accept(
        self, time: float, u: FloatArray, w: FloatArray, tau_motor: list[float], tau_spring: list[float]
    ) -> None:
        """Tell the effects with memory where the step ended; torques are those of the last stage."""
        if self._memory:
            self._set(time, 0.0, u, w, tau_motor, tau_spring)
            for accept in self._memory:
                accept(self._state)


class _AtJoint:
    """What acts at joint i alone, whose motor has the coordinate m."""

    __slots__ = ("_moved", "_state", "action", "i", "m")

    def __init__(self, action: JointAction, m: int) -> None:
        self.action, self.i, self.m = action, action.index, m
        # The state, and the state beside one with the speed of one side moved, of the other: without a spring of both.
        self._state, self._moved = (_states(count) for count in (1, 2 if m == self.i else 3))

    def _put(self, state: SimulationState, instant: _Instant) -> None:
        time, position, velocity, tau_motor, tau_spring = instant
        i, m = self.i, self.m
        object.__setattr__(state, "time", time)
        state.q[:], state.theta[:] = position[i], position[m]
        state.dq[:], state.dtheta[:] = velocity[i], velocity[m]
        state.tau_spring[:], state.tau_motor[:] = tau_spring[i], tau_motor[i]

    def add(self, instant: _Instant, out: list[float]) -> float:
        """Subtract the torque from the forces `out`, and return it."""
        self._put(self._state, instant)
        action = self.action
        amount = float(action.amounts(self._state)[0])
        out[self.i] -= action.on_link * amount
        out[self.m] -= action.on_motor * amount
        return amount

    def add_slopes(self, instant: _Instant, slopes: list[float]) -> None:
        """Add the slopes over the speeds of both sides."""
        i, m, action, state = self.i, self.m, self.action, self._moved
        self._put(state, instant)
        step_link, step_motor = (SMALL_SPEED if instant.velocity[k] >= 0.0 else -SMALL_SPEED for k in (i, m))
        state.dq[1] += step_link
        state.dtheta[-1] += step_motor
        amounts = action.amounts(state)
        change = (amounts[1:] - amounts[0]).tolist()
        # without a spring the only moved state is that of both sides
        slopes[i] += action.on_link * change[0] / step_link
        slopes[m] += action.on_motor * change[-1] / step_motor


def _by_kind(hooks: Sequence[Action], coordinates: Sequence[int]) -> tuple[list[_AtJoint], list[Action]]:
    """What acts at a single joint, with the coordinate of its motor, and the others."""
    at_joint = [_AtJoint(hook, coordinates[hook.index]) for hook in hooks if isinstance(hook, JointAction)]
    return at_joint, [hook for hook in hooks if not isinstance(hook, JointAction)]


def altered_robot(robot: Robot, effects: Sequence[PlantedEffect]) -> Robot:
    """The robot after the effects that change its bodies, its couplings or gravity."""
    for planted in effects:
        robot = planted.effect.modified(robot, planted.values)
    return robot


def demands(robot: Robot, effects: Sequence[PlantedEffect]) -> FloatArray:
    """(n,) torque that each motor is asked for over what its load and its rotor need, with all effects [-]."""
    factors = np.ones(robot.n)
    for planted in effects:
        factors *= planted.effect.demand(robot, planted.values)
    return factors


def check_planted(robot: Robot, effects: Sequence[PlantedEffect]) -> None:
    """Refuse effects that cannot act.

    Raises:
        SimulationError: wrong number of values, or an effect without any hook.
    """
    for planted in effects:
        effect, columns = planted.effect, planted.effect.columns(robot)
        if np.shape(planted.values) != (len(columns),):
            raise SimulationError(
                f"the effect {effect.name!r} has {len(columns)} parameters "
                f"({', '.join(c.name for c in columns)}); {np.shape(planted.values)} values were given"
            )
        if not any(overrides(effect, hook) for hook in ("torque", "measured", "modified", "demand")):
            raise SimulationError(f"the effect {effect.name!r} has no way to act in a simulation")
