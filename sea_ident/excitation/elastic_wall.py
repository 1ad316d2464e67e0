"""Limits of links on springs, linearised at a motion of the motors."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sea_ident._typing import FloatArray, IntArray
from sea_ident.excitation.elastic_limits import ElasticLimits
from sea_ident.excitation.elastic_response import ElasticResponse, elastic_response, extended_slopes, response_slopes
from sea_ident.excitation.walls import DynamicTangent, parabolic_overshoot
from sea_ident.motion import FourierSeries, fourier_basis

# points of the grid for one harmonic of the motors
_POINTS = 16
# part of the room at rest that a linearised limit leaves at least
_LEAST_ROOM = 0.02


@dataclass(frozen=True, eq=False)
class ElasticWall:
    """Linearised limits, with slopes that do not depend on the trajectory.

    What the slopes miss on the way from rest to where they were taken is taken off the bounds, time by time.

    Attributes:
        lower: (r, M) lowest values.
        upper: (r, M) highest values.
        middle: (r, 1) values at rest.
        rows: (r, M, v) slopes by the coefficients.
        bend: (r, M) what the slopes miss.
        rest: (n, 2 L + 1) trajectory at rest.
    """

    lower: FloatArray
    upper: FloatArray
    middle: FloatArray
    rows: FloatArray
    bend: FloatArray
    rest: FloatArray

    def values(self, coefficients: FloatArray) -> FloatArray:
        """(r, M)."""
        return self.middle + self._tangent.push(coefficients - self.rest)

    def tangent(self, coefficients: FloatArray) -> DynamicTangent:
        """The same everywhere."""
        return self._tangent

    @cached_property
    def _tangent(self) -> DynamicTangent:
        return DynamicTangent(self.rows)

    def overshoot(self, values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """By parabolas through neighbouring points of all that is limited: without its bend it turns over elsewhere."""
        return parabolic_overshoot(values + self.bend)


def elastic_wall(limits: ElasticLimits, motors: FourierSeries, rest: FloatArray) -> ElasticWall | None:
    """The limits of links on springs, and those on torque and deflection, linearised at a motion.

    Args:
        limits: the limits.
        motors: the motion of the motors.
        rest: (n, 2 L + 1) a trajectory at rest, inside.

    Returns:
        The wall; None if the motion of the links was not found.
    """
    response, resting = (
        elastic_response(limits.springs, series)
        for series in (motors, FourierSeries.from_coefficients(rest, motors.base_frequency))
    )
    if response is None or resting is None:
        return None
    count = _POINTS * motors.harmonics
    time: FloatArray = np.arange(count, dtype=np.float64) * (motors.period / count)
    # friction turns over too fast for a slope: its largest torque is taken off
    reduced = limits.dynamic.bound - np.abs(limits.friction(response.motion(time))).max(axis=0, initial=0.0)
    about: IntArray = np.flatnonzero(np.any(limits.linear.joints[:, limits.springs.joints] != 0.0, axis=1))
    lower = np.concatenate([limits.linear.lower[about], -reduced])[:, None]
    upper = np.concatenate([limits.linear.upper[about], reduced])[:, None]
    values, rows = _linearised(limits, about, response, time)
    middle = _values(limits, about, resting, time[:1])
    bend = values - middle - rows @ (motors.coefficients - rest).ravel()
    return ElasticWall(
        np.minimum(lower - bend, middle - _LEAST_ROOM * (middle - lower)),
        np.maximum(upper - bend, middle + _LEAST_ROOM * (upper - middle)),
        middle,
        rows,
        bend,
        rest,
    )


def wall_size(limits: ElasticLimits, motors: FourierSeries) -> int:
    """Number of slopes of an `elastic_wall`, at most."""
    return (len(limits.linear) + len(limits.dynamic)) * _POINTS * motors.harmonics * motors.coefficients.size


def _values(limits: ElasticLimits, about: IntArray, response: ElasticResponse, time: FloatArray) -> FloatArray:
    """(r, M) limited values, torques without friction."""
    motion, linear = response.motion(time), limits.linear
    parts = [response.links.evaluate(time, int(linear.derivative[k])) @ linear.joints[k] for k in about]
    torque = limits.torques(motion) - limits.friction(motion)
    return np.concatenate([np.array(parts).reshape(len(parts), len(time)), torque.T])


def _linearised(
    limits: ElasticLimits, about: IntArray, response: ElasticResponse, time: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """(r, M) limited values and (r, M, v) their slopes by the coefficients of the motors."""
    motors, links, robot = response.motors, response.links, limits.springs.robot
    n, v, count = motors.n, motors.coefficients.size, len(time)
    by_motors = response_slopes(limits.springs, response).reshape(n, -1, v)

    def moved(order: int) -> tuple[FloatArray, FloatArray]:
        """(M, n, v) slopes of a derivative of links and of motors."""
        wide, own = (fourier_basis(time, s.base_frequency, s.harmonics, order) for s in (links, motors))
        link: FloatArray = np.moveaxis(wide @ by_motors, 0, 1)
        motor: FloatArray = (np.eye(n)[None, :, :, None] * own[:, None, None, :]).reshape(count, n, v)
        return link, motor

    rows = np.zeros((len(about) + len(limits.dynamic), count, v))
    bends = rows[len(about) :]
    _, slopes = extended_slopes(robot, response.motion(time))
    both = (robot.link_map + robot.motor_map)[:, limits.dynamic.rows].T
    for order in range(1 + max(2, int(limits.linear.derivative.max(initial=0)))):
        link, motor = moved(order)
        for r, k in enumerate(about):
            if limits.linear.derivative[k] == order:
                rows[r] = np.einsum("n,mnv->mv", limits.linear.joints[k], link)
        if order < 3:
            by_state = both @ slopes[order]
            bends += np.moveaxis(by_state @ robot.link_map @ link + by_state @ robot.motor_map @ motor, 0, 1)
        if order == 0:
            stiffness = limits.stiffness(response.motion(time).deflection)[1]
            bending = np.moveaxis(stiffness[:, :, None] * (motor - link), 0, 1)
    bends[limits.dynamic.springs] = bending[limits.dynamic.rows[limits.dynamic.springs]]
    return _values(limits, about, response, time), rows
