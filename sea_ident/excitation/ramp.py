"""Ramps: from rest into the periodic motion and back to rest, inside the same limits."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.interpolate import BSpline

from sea_ident._typing import FloatArray
from sea_ident.arguments import expect_number
from sea_ident.exceptions import ExcitationError, InfeasibleError
from sea_ident.excitation.linear_limits import LinearLimits
from sea_ident.excitation.quadratic import solve_quadratic
from sea_ident.motion import FourierSeries, Motion

_DEGREE = 5
_SPANS = 16
_PHASES = 48
_SLOWER = (1.0, 1.5, 2.0, 3.0, 5.0)
_TIED = 3  # control points at each end that the state there fixes: position, velocity, acceleration


@dataclass(frozen=True)
class Ramp:
    """Ask for ramps at both ends.

    Attributes:
        duration: shortest duration of each [s]; it is prolonged where the limits ask for it. Default: half a period.
    """

    duration: float | None = None

    def __post_init__(self) -> None:
        expect_number(self.duration, "Ramp: duration", "s")
        if self.duration is not None and not (np.isfinite(self.duration) and self.duration > 0.0):
            raise ExcitationError(f"the duration of the ramp is {self.duration} s; it must be positive")


@dataclass(frozen=True, eq=False)
class RampMotion:
    """A motion of n joints between rest and a phase of the periodic motion.

    Attributes:
        knots: (K,) of a clamped spline of degree 5 [s], from 0 to the duration.
        points: (K - 6, n) control points [rad] or [m].
        phase: time of the periodic motion at which it joins or leaves it [s].
    """

    knots: FloatArray
    points: FloatArray
    phase: float

    @property
    def duration(self) -> float:
        """[s]."""
        return float(self.knots[-1])

    def motion(self, time: FloatArray) -> Motion:
        """The motion at times (N,) from 0 to the duration [s]."""
        spline = BSpline(self.knots, self.points, _DEGREE)
        q, dq, ddq = (np.asarray(spline.derivative(order)(time) if order else spline(time)) for order in range(3))
        return Motion.rigid(time, q, dq, ddq)

    def to_dict(self) -> dict[str, Any]:
        """A form that JSON can hold."""
        return {"knots": self.knots.tolist(), "points": self.points.tolist(), "phase": self.phase}

    @staticmethod
    def from_dict(record: Mapping[str, Any], n: int) -> "RampMotion":
        """What `to_dict` wrote, for n joints.

        Raises:
            ValueError: wrong sizes, or numbers that are not finite.
            KeyError: something is missing.
        """
        knots, points = (np.asarray(record[key], dtype=np.float64) for key in ("knots", "points"))
        phase = float(record["phase"])
        if points.ndim != 2 or points.shape != (len(knots) - _DEGREE - 1, n) or np.any(np.diff(knots) < 0.0):
            raise ValueError(f"a ramp with {knots.shape} knots and {points.shape} control points")
        if not (np.all(np.isfinite(knots)) and np.all(np.isfinite(points)) and np.isfinite(phase)):
            raise ValueError("a ramp holds numbers that are not finite")
        return RampMotion(knots, points, phase)

    def reversed(self, phase: float) -> "RampMotion":
        """The same path backward in time, for a series run backward."""
        return RampMotion(self.duration - self.knots[::-1], self.points[::-1].copy(), phase)


def design_ramp(
    series: FourierSeries,
    limits: LinearLimits,
    duration: float,
    centre: FloatArray,
    allowed: Callable[[RampMotion], bool],
) -> RampMotion:
    """A ramp from rest into a periodic motion.

    The ramp is a spline whose control points, and those of its derivatives, are inside the limits: so is the spline
    between them, at all times. One QP finds the smoothest; phases at which to join are tried from the easiest on.

    Args:
        series: the periodic motion.
        limits: linear limits.
        duration: shortest duration [s].
        centre: (n,) position near which to rest.
        allowed: whether a ramp keeps all other limits.

    Returns:
        The ramp.

    Raises:
        InfeasibleError: none was found.
    """
    phases = np.arange(_PHASES) * series.period / _PHASES
    for slower in _SLOWER:
        for phase in _by_ease(series, limits, phases):
            ramp = _spline_to(series, limits, slower * duration, float(phase), centre)
            if ramp is not None and allowed(ramp):
                return ramp
    raise InfeasibleError(
        f"no ramp of at most {_SLOWER[-1] * duration:g} s from rest into the motion was found inside the limits; ask "
        f"for a longer one"
    )


def design_ramp_out(
    series: FourierSeries,
    limits: LinearLimits,
    duration: float,
    centre: FloatArray,
    allowed: Callable[[RampMotion], bool],
) -> RampMotion:
    """A ramp from a periodic motion to rest: one into the motion run backward, run backward.

    Arguments, result and errors are those of `design_ramp`.
    """
    mirrored = FourierSeries(series.base_frequency, series.offset, -series.a, series.b)
    turned = LinearLimits(
        limits.names,
        np.where((limits.derivative % 2 == 1)[:, None], -limits.joints, limits.joints),
        limits.derivative,
        limits.lower,
        limits.upper,
        limits.units,
    )

    def back(ramp: RampMotion) -> RampMotion:
        return ramp.reversed((series.period - ramp.phase) % series.period)

    return back(design_ramp(mirrored, turned, duration, centre, lambda ramp: allowed(back(ramp))))


def _by_ease(series: FourierSeries, limits: LinearLimits, phases: FloatArray) -> FloatArray:
    """Phases in the order of how far the state there is from the limits."""
    if not len(limits):
        return phases
    count = len(limits)
    which = np.repeat(np.arange(count), len(phases))
    rows = limits.rows((series.base_frequency, series.harmonics), which, np.tile(phases, count))
    value = (rows @ series.coefficients.ravel()).reshape(count, -1)
    room = np.minimum(value - limits.lower[:, None], limits.upper[:, None] - value) / limits.width[:, None]
    return phases[np.argsort(-room.min(axis=0), kind="stable")]


def _spline_to(
    series: FourierSeries, limits: LinearLimits, duration: float, phase: float, centre: FloatArray
) -> RampMotion | None:
    """The smoothest spline from rest to the state of the series at a phase; None where the limits exclude it."""
    knots = np.concatenate([np.zeros(_DEGREE), np.linspace(0.0, duration, _SPANS + 1), np.full(_DEGREE, duration)])
    count, n = len(knots) - _DEGREE - 1, len(centre)
    derivatives = [derivative_points(knots, count, order) for order in range(4)]
    # the last control points follow from the state at the end, the first ones are equal: at rest
    ends = np.array([matrix[-1, -_TIED:] for matrix in derivatives[:_TIED]])
    state = np.array([series.evaluate(np.array([phase]), order)[0] for order in range(_TIED)])
    fixed = np.zeros((count, n))
    fixed[-_TIED:] = np.linalg.solve(ends, state)
    free = np.zeros((count, count - 2 * _TIED + 1))
    free[:_TIED, 0] = 1.0
    free[_TIED:-_TIED, 1:] = np.eye(count - 2 * _TIED)
    width = free.shape[1]
    rows, lower, upper = [], [], []
    for k in range(len(limits)):
        matrix = derivatives[int(limits.derivative[k])]
        rows.append(np.einsum("rw,i->riw", matrix @ free, limits.joints[k]).reshape(len(matrix), n * width))
        known = matrix @ fixed @ limits.joints[k]
        # what the state at the end fixes may use up the limit; the rest keeps a trace of room
        trace = 1e-7 * limits.width[k]
        lower.append(limits.lower[k] + trace - known)
        upper.append(limits.upper[k] - trace - known)
    smooth = derivatives[3] @ free
    target = derivatives[3] @ fixed
    scale = duration**6 / len(smooth)
    block = scale * smooth.T @ smooth + 1e-9 * np.eye(width)
    block[0, 0] += 1e-3
    hessian = np.asarray(np.kron(np.eye(n), block), dtype=np.float64)
    pull = scale * smooth.T @ target
    pull[0] -= 1e-3 * centre
    bounds_low, bounds_high = (np.concatenate(values) if values else np.zeros(0) for values in (lower, upper))
    matrix = np.vstack(rows) if rows else np.zeros((0, n * width))
    active = np.any(np.abs(matrix) > 1e-12, axis=1)
    if np.any(bounds_low[~active] > 1e-6) or np.any(bounds_high[~active] < -1e-6):
        return None
    solution, _ = solve_quadratic(
        hessian, pull.T.ravel(), matrix[active], bounds_low[active], bounds_high[active], accuracy=1e-9
    )
    points = fixed + free @ solution.reshape(n, width).T
    ramp = RampMotion(knots, points, phase)
    return ramp if ramp_margin(ramp, limits) >= -1e-12 else None


def ramp_margin(ramp: RampMotion, limits: LinearLimits) -> float:
    """Smallest distance of the control points to a limit, as a part of its range; at most that of the motion itself."""
    worst = np.inf
    for k in range(len(limits)):
        matrix = derivative_points(ramp.knots, len(ramp.points), int(limits.derivative[k]))
        value = matrix @ ramp.points @ limits.joints[k]
        room = np.minimum(value - limits.lower[k], limits.upper[k] - value) / limits.width[k]
        worst = min(worst, float(room.min()))
    return worst


def derivative_points(knots: FloatArray, count: int, order: int) -> FloatArray:
    """Matrix from control points to those of a derivative."""
    matrix = np.eye(count)
    degree = _DEGREE
    for step in range(order):
        inner = knots[step : len(knots) - step]
        span = inner[degree + 1 : -1] - inner[1 : -degree - 1]
        matrix = (degree / span)[:, None] * np.diff(matrix, axis=0)
        degree -= 1
    return matrix
