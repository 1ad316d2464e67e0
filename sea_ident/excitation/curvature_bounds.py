"""Proven bounds between samples: how fast a torque can bend.

Between two samples h apart a function stays within ``h^2 / 8 max |f''|`` of the chord. For a torque that maximum is
bounded by carrying the norms of all quantities and of their first two time derivatives through the Newton-Euler
recursion: norms obey the triangle inequality and, for products, Leibniz' rule.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.excitation.dynamic_limits import DynamicLimits
from sea_ident.excitation.ramp import RampMotion, derivative_points
from sea_ident.motion import FourierSeries, Motion
from sea_ident.robot import Robot

# The bound between samples may take this part of a limit that is nearly reached.
_PART = 1e-3
_FAR = 0.05
_FEWEST_SAMPLES = 500
_MOST_SAMPLES = 32_000
_CHUNK = 4000


@dataclass(frozen=True)
class Jet:
    """Bounds on the norm of a function of time and on those of its first two derivatives."""

    value: float
    first: float
    second: float

    def __add__(self, other: "Jet") -> "Jet":
        return Jet(self.value + other.value, self.first + other.first, self.second + other.second)

    def __mul__(self, other: "Jet") -> "Jet":
        return Jet(
            self.value * other.value,
            self.first * other.value + self.value * other.first,
            self.second * other.value + 2.0 * self.first * other.first + self.value * other.second,
        )

    @staticmethod
    def constant(value: float) -> "Jet":
        """Of a function that does not change."""
        return Jet(value, 0.0, 0.0)


_NOTHING = Jet(0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class MotionBounds:
    """Largest absolute values over all time, by coordinate.

    Attributes:
        derivatives: (5, n) of position, velocity, acceleration, jerk and its derivative.
    """

    derivatives: FloatArray

    @staticmethod
    def of(series: FourierSeries) -> "MotionBounds":
        """From the amplitudes of the harmonics: ``|f| <= |offset| + sum of amplitudes``."""
        omega = 2.0 * np.pi * series.base_frequency * np.arange(1, series.harmonics + 1)
        amplitude = np.hypot(series.a, series.b)
        found = np.array([(amplitude * omega ** (order - 1)).sum(axis=1) for order in range(5)])
        found[0] += np.abs(series.offset)
        return MotionBounds(found)

    @staticmethod
    def of_ramp(ramp: RampMotion) -> "MotionBounds":
        """From the control points, whose hull holds the spline."""
        points = [np.abs(derivative_points(ramp.knots, len(ramp.points), order) @ ramp.points) for order in range(5)]
        return MotionBounds(np.array([values.max(axis=0) for values in points]))

    def mapped(self, matrix: FloatArray) -> "MotionBounds":
        """Of linear combinations (rows) of the coordinates."""
        return MotionBounds(self.derivatives @ np.abs(matrix).T)

    def jet(self, coordinate: int, order: int) -> Jet:
        """Of a derivative of a coordinate (at most the acceleration)."""
        value = self.derivatives[order : order + 3, coordinate]
        return Jet(float(value[0]), float(value[1]), float(value[2]))


def torque_bend(robot: Robot, bounds: MotionBounds) -> FloatArray:
    """Bound on the second time derivative of every torque of the extended model.

    Args:
        robot: the robot with its inertial parameters.
        bounds: of the motion of q, with theta = q.

    Returns:
        (nv,) bounds for the coordinates of the extended model [N m/s2].
    """
    model = robot.extended_model
    motion = bounds.mapped(robot.link_map + robot.motor_map)
    count = model.njoints
    omega, alpha, linear = ([_NOTHING] * count for _ in range(3))
    linear[0] = Jet.constant(float(np.linalg.norm(model.gravity.linear)))
    turn, lever, force, moment = ([_NOTHING] * count for _ in range(4))
    for k in range(1, count):
        parent, i = int(model.parents[k]), int(model.joints[k].idx_v)
        prismatic = "P" in model.joints[k].shortname().removeprefix("JointModel")
        position, velocity, acceleration = (motion.jet(i, order) for order in range(3))
        reach = Jet.constant(float(np.linalg.norm(model.jointPlacements[k].translation)))
        # rotation into the frame of the body: |R'| <= |w|, |R''| <= |w'| + w^2
        rotate = Jet.constant(1.0)
        if prismatic:
            reach = reach + position
        else:
            rotate = Jet(1.0, velocity.value, velocity.first + velocity.value**2)
        turn[k], lever[k] = rotate, reach
        carried = rotate * omega[parent]
        omega[k] = carried if prismatic else carried + velocity
        alpha[k] = rotate * alpha[parent]
        base = linear[parent] + alpha[parent] * reach + omega[parent] * omega[parent] * reach
        linear[k] = rotate * base
        if prismatic:
            linear[k] = linear[k] + Jet.constant(2.0) * carried * velocity + acceleration
        else:
            alpha[k] = alpha[k] + acceleration + carried * velocity
        inertia = model.inertias[k]
        mass, arm = Jet.constant(inertia.mass), Jet.constant(inertia.mass * float(np.linalg.norm(inertia.lever)))
        about = inertia.toDynamicParameters()
        tensor = np.array(
            [[about[4], about[5], about[7]], [about[5], about[6], about[8]], [about[7], about[8], about[9]]]
        )
        spin = Jet.constant(float(np.linalg.norm(tensor, 2)))
        force[k] = mass * linear[k] + arm * (alpha[k] + omega[k] * omega[k])
        moment[k] = arm * linear[k] + spin * (alpha[k] + omega[k] * omega[k])
    bend = np.zeros(model.nv)
    for k in range(count - 1, 0, -1):
        parent, i = int(model.parents[k]), int(model.joints[k].idx_v)
        prismatic = "P" in model.joints[k].shortname().removeprefix("JointModel")
        bend[i] = (force[k] if prismatic else moment[k]).second
        passed = turn[k] * force[k]
        force[parent] = force[parent] + passed
        moment[parent] = moment[parent] + turn[k] * moment[k] + lever[k] * passed
    return bend


def proven_margins(
    limits: DynamicLimits, motion: Callable[[FloatArray], Motion], duration: float, bounds: MotionBounds
) -> FloatArray:
    """Distances that are kept at all times, not only at samples.

    Args:
        limits: torque and deflection limits.
        motion: the motion at given times.
        duration: from 0 to this time [s].
        bounds: of the motion.

    Returns:
        (r,) distance to each limit that is not undercut [N m].
    """
    if not len(limits):
        return np.zeros(0)
    bend = np.abs(limits.fold).T @ torque_bend(limits.robot, bounds)
    samples = _FEWEST_SAMPLES
    while True:
        step = duration / samples
        faster: FloatArray = 0.5 * step * bounds.derivatives[2]
        largest, doubt = _largest(limits, motion, np.linspace(0.0, duration, samples + 1), faster)
        doubt = doubt + step**2 / 8.0 * bend
        margins: FloatArray = limits.bound - largest - doubt
        # finer where the proof takes more than it may of a limit that is nearly reached
        fine = (doubt <= _PART * limits.bound) | (margins >= _FAR * limits.bound)
        if np.all(fine) or samples >= _MOST_SAMPLES:
            return margins
        samples *= 4


def _largest(
    limits: DynamicLimits, motion: Callable[[FloatArray], Motion], time: FloatArray, faster: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """(r,) largest torque at samples, and by how much friction can raise it between them."""
    plain, raised = np.zeros(len(limits)), np.zeros(len(limits))
    for start in range(0, len(time), _CHUNK):
        part = motion(time[start : start + _CHUNK])
        # friction rises with velocity, which cannot change by more than `faster` on the way to the nearest sample
        torque = limits.evaluate(part, derivatives=False, shifts=(np.zeros_like(faster), faster, -faster))[0]
        found = np.abs(torque).max(axis=0).reshape(3, -1)
        plain, raised = np.maximum(plain, found[0]), np.maximum(raised, found[1:].max(axis=0))
    return plain, np.maximum(raised - plain, 0.0)
