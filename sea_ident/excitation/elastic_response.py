"""How the links of a robot with known springs move while its motors follow a periodic motion.

The motion of the links is a Fourier series with more harmonics than that of the motors; its coefficients are those for
which the link rows of the equations of motion hold on average against every harmonic (harmonic balance), found by
Newton's method.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pinocchio as pin
import scipy.linalg

from sea_ident._typing import FloatArray, IntArray
from sea_ident.excitation.dynamic_limits import KnownFriction, known_friction
from sea_ident.excitation.local_slopes import local_slopes
from sea_ident.excitation.springs import SpringTorque
from sea_ident.motion import FourierSeries, Motion, fourier_basis
from sea_ident.robot import Robot

# harmonics of the links for one of the motors, as a cubic spring triples a frequency; at most so many more, as links do
# not follow what is far above their resonance
_TIMES = 3
_MOST_MORE = 40
# samples for one harmonic of the links: products of four of them do not alias into those that are balanced
_SAMPLES = 4
_ROUNDS = 15
_CONVERGED = 1e-9
# shortest part of a step of Newton's method
_LEAST_PART = 0.02
# shortest part of the amplitude by which a motion is grown where Newton's method fails at once
_SHORTEST = 1.0 / 64.0


@dataclass(frozen=True, eq=False)
class Springs:
    """The springs of a robot whose stiffness is known; a joint with another spring counts as rigid.

    Attributes:
        robot: the robot, with its prior parameters.
        joints: (e,) joints with a known spring.
        stiffness: (e,) K1 [N m/rad].
        cubic: (e,) K3 [N m/rad3].
        damping: (e,) D [N m s/rad].
        friction: friction of known size.
    """

    robot: Robot
    joints: IntArray
    stiffness: FloatArray
    cubic: FloatArray
    damping: FloatArray
    friction: tuple[KnownFriction, ...]

    @staticmethod
    def of(robot: Robot, given: SpringTorque | None = None) -> "Springs":
        """Those that the description of a robot gives numbers for, with the stiffness of others where it is given."""
        stiffness, cubic, damping = np.zeros((3, robot.n))
        for i in robot.elastic_indices:
            spring = robot.spring(robot.joint_names[int(i)])
            stiffness[i], cubic[i] = spring.stiffness or 0.0, spring.cubic_stiffness or 0.0
            damping[i] = spring.damping or 0.0
        if given is not None:
            stiffness[given.joints], cubic[given.joints] = given.linear[given.joints], given.cubic[given.joints]
        known = np.flatnonzero(stiffness > 0.0)
        return Springs(robot, known, stiffness[known], cubic[known], damping[known], known_friction(robot))

    def lowest_frequency(self, q: FloatArray) -> float:
        """Of the links around a position (n,) while the motors stand still [Hz]; without springs it is infinite."""
        if not len(self.joints):
            return np.inf
        inertia = self.robot.inertia(q)[np.ix_(self.joints, self.joints)]
        square = scipy.linalg.eigh(np.diag(self.stiffness), inertia, eigvals_only=True)[0]
        return float(np.sqrt(square) / (2.0 * np.pi))

    def missing(self, motion: Motion) -> tuple[FloatArray, FloatArray, FloatArray]:
        """What the torques of the springs lack of those that move the links.

        Args:
            motion: (N, n) motion.

        Returns:
            (N, e) torque of the link rows minus that of the springs [N m], its slopes (3, N, e, e) by position,
            velocity and acceleration of links on springs, and (3, N, e, n) by those of the motors, which take the other
            links along.
        """
        robot, joints = self.robot, self.joints
        torque, slopes = extended_slopes(robot, motion)
        found, by_state = torque @ robot.link_map[:, joints], robot.link_map[:, joints].T @ slopes
        by_links, by_motors = by_state @ robot.link_map[:, joints], by_state @ self.moved_by_motors
        d, rate = motion.deflection[:, joints], motion.deflection_rate[:, joints]
        found = found - (self.stiffness * d + self.cubic * d**3 + self.damping * rate)
        own = np.arange(len(joints))
        for order, slope in enumerate((self.stiffness + 3.0 * self.cubic * d**2, self.damping)):
            by_links[order][:, own, own] += slope
            by_motors[order][:, own, joints] -= slope
        for friction in self.friction:
            if not friction.link or friction.joint not in joints:
                continue
            i, k = friction.joint, int(np.flatnonzero(joints == friction.joint)[0])
            state = (motion.q[:, i], motion.dq[:, i], motion.theta[:, i], motion.dtheta[:, i])
            found[:, k] += friction.effect.local_columns(*state) @ friction.values
            by_velocity = local_slopes(friction.effect, *state)[1]
            if by_velocity is not None:
                by_links[1][:, k, k] += by_velocity @ friction.values
        return found, by_links, by_motors

    @cached_property
    def moved_by_motors(self) -> FloatArray:
        """(nv, n) coordinates of the extended model that the motors take along."""
        tied = self.robot.link_map.copy()
        tied[:, self.joints] = 0.0
        return self.robot.motor_map + tied


def extended_slopes(robot: Robot, motion: Motion) -> tuple[FloatArray, FloatArray]:
    """(N, nv) torques of the extended model, and (3, N, nv, nv) their slopes by position, velocity, acceleration."""
    model = robot.extended_model
    data = model.createData()
    x = np.ascontiguousarray(robot.extended_state(motion.q, motion.theta))
    v = np.ascontiguousarray(robot.extended_rate(motion.dq, motion.dtheta))
    a = np.ascontiguousarray(robot.extended_rate(motion.ddq, motion.ddtheta))
    torque, slopes = np.empty(x.shape), np.empty((3, len(x), model.nv, model.nv))
    for k in range(len(x)):
        slopes[0, k], slopes[1, k], slopes[2, k] = pin.computeRNEADerivatives(model, data, x[k], v[k], a[k])
        torque[k] = data.tau
    return torque, slopes


@dataclass(frozen=True, eq=False)
class ElasticResponse:
    """A periodic motion of motors and of the links that follow on their springs.

    Attributes:
        motors: of all joints.
        links: of all joints, with more harmonics.
    """

    motors: FourierSeries
    links: FourierSeries

    def motion(self, time: FloatArray) -> Motion:
        """The motion at the times (N,) [s]."""
        links, motors = self.links.motion(time), self.motors.motion(time)
        return replace(links, theta=motors.q, dtheta=motors.dq, ddtheta=motors.ddq)


def padded(series: FourierSeries, harmonics: int) -> FourierSeries:
    """The same motion with more harmonics, the new ones zero."""
    more = ((0, 0), (0, harmonics - series.harmonics))
    return FourierSeries(series.base_frequency, series.offset, np.pad(series.a, more), np.pad(series.b, more))


def elastic_response(springs: Springs, motors: FourierSeries) -> ElasticResponse | None:
    """The periodic motion of the links while the motors follow a series.

    Where springs stiffen there may be several such motions near a resonance; the one found is reached from rest by
    growing amplitude if it is not found at once.

    Args:
        springs: the robot and its springs.
        motors: the motion of the motors.

    Returns:
        Motors and links, None if no such motion was found.
    """
    more = min((_TIMES - 1) * motors.harmonics, _MOST_MORE)
    balance = _Balance(springs, motors, motors.harmonics + more)
    links = balance.solve(1.0, balance.start)
    if links is None:
        share, step, last = 0.0, 0.25, balance.start
        while share < 1.0:
            following = balance.solve(min(1.0, share + step), last)
            if following is None:
                step *= 0.5
                if step < _SHORTEST:
                    return None
                continue
            share, step, last = min(1.0, share + step), 1.5 * step, following
        links = last
    return ElasticResponse(motors, balance.series(links))


def response_slopes(springs: Springs, response: ElasticResponse) -> FloatArray:
    """How the motion of the links changes with that of the motors.

    Args:
        springs: the robot and its springs.
        response: the motion.

    Returns:
        (n, 2 M + 1, n, 2 L + 1) slopes of the coefficients of the links by those of the motors.
    """
    motors, links = response.motors, response.links
    balance = _Balance(springs, motors, links.harmonics)
    return balance.slopes(response)


class _Balance:
    """Link rows of the equations of motion, harmonic by harmonic; unknown are amplitudes of position (e, 2 M + 1)."""

    def __init__(self, springs: Springs, motors: FourierSeries, harmonics: int) -> None:
        self._springs, self._motors, self._wide = springs, motors, padded(motors, harmonics)
        samples = _SAMPLES * harmonics
        self._time: FloatArray = np.arange(samples, dtype=np.float64) * (motors.period / samples)
        # amplitudes of velocity, as a series has them, would be of very different sizes
        omega = 2.0 * np.pi * motors.base_frequency * np.arange(1, harmonics + 1)
        self._scale = np.concatenate([omega, omega, [1.0]])
        self._bases = [
            fourier_basis(self._time, motors.base_frequency, harmonics, order) * self._scale for order in range(3)
        ]
        self.start = self._wide.coefficients[springs.joints] / self._scale

    def series(self, amplitudes: FloatArray) -> FourierSeries:
        """The motion of the links."""
        coefficients = self._wide.coefficients
        coefficients[self._springs.joints] = amplitudes * self._scale
        return FourierSeries.from_coefficients(coefficients, self._wide.base_frequency)

    def solve(self, share: float, amplitudes: FloatArray) -> FloatArray | None:
        """Amplitudes of the links for a share of the amplitude of the motors, None if Newton's method fails."""
        wide = self._wide
        motors = FourierSeries(wide.base_frequency, wide.offset, share * wide.a, share * wide.b).motion(self._time)
        wrong, slopes = self._evaluate(motors, amplitudes)
        for _ in range(_ROUNDS):
            try:
                step = np.linalg.solve(self._balanced(slopes, self._bases), -wrong.ravel()).reshape(amplitudes.shape)
            except np.linalg.LinAlgError:
                return None
            size, part = float(np.linalg.norm(wrong)), 1.0
            while True:
                trial = amplitudes + part * step
                wrong, slopes = self._evaluate(motors, trial)
                if float(np.linalg.norm(wrong)) < size or part < _LEAST_PART:
                    break
                part *= 0.5
            amplitudes = trial
            if float(np.abs(step).max(initial=0.0)) < _CONVERGED:
                return amplitudes
        return None

    def slopes(self, response: ElasticResponse) -> FloatArray:
        """(n, 2 M + 1, n, 2 L + 1) slopes of the coefficients of the links by those of the motors."""
        motors, n = self._motors, self._motors.n
        width, wide = 2 * motors.harmonics + 1, len(self._scale)
        _, by_links, by_motors = self._springs.missing(response.motion(self._time))
        bases = [fourier_basis(self._time, motors.base_frequency, motors.harmonics, order) for order in range(3)]
        moved = np.linalg.solve(self._balanced(by_links, self._bases), -self._balanced(by_motors, bases))
        found = np.zeros((n, wide, n, width))
        places = np.concatenate([np.arange(motors.harmonics), self._wide.harmonics + np.arange(motors.harmonics), [-1]])
        for i in range(n):
            found[i, places, i, np.arange(width)] = 1.0
        amplitudes = moved.reshape(len(self._springs.joints), wide, n, width)
        found[self._springs.joints] = amplitudes * self._scale[:, None, None]
        return found

    def _evaluate(self, motors: Motion, amplitudes: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(e, 2 M + 1) torque that lacks at each harmonic, and its slopes by the links at the samples."""
        states = [motors.q.copy(), motors.dq.copy(), motors.ddq.copy()]
        for state, basis in zip(states, self._bases, strict=True):
            state[:, self._springs.joints] = basis @ amplitudes.T
        missing, slopes, _ = self._springs.missing(replace(motors, q=states[0], dq=states[1], ddq=states[2]))
        return missing.T @ self._bases[0] / len(self._time), slopes

    def _balanced(self, slopes: FloatArray, bases: list[FloatArray]) -> FloatArray:
        """(e (2 M + 1), j w) slopes of what lacks, by the coefficients of j joints in bases of width w."""
        _, _, e, joints = slopes.shape
        wide, width = self._bases[0].shape[1], bases[0].shape[1]
        found = np.empty((e, wide, joints, width))
        for i in range(e):
            for j in range(joints):
                moved = np.zeros_like(bases[0])
                for order, basis in enumerate(bases):
                    moved += slopes[order][:, i, j, None] * basis
                found[i, :, j] = self._bases[0].T @ moved / len(self._time)
        return found.reshape(e * wide, joints * width)
