"""Monotone ascent of a criterion inside limits that hold for all t.

Sequential quadratic programming: the exact gradient, a Gauss-Newton curvature (the derivative of the information matrix
is known for every coefficient, its second derivative is left out), and a QP for the step. The limits enter the QP at
the times where the present trajectory and the proposed one have their extrema (cutting planes), and a step is taken
only if it stays inside for all t and the criterion rises.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from sea_ident._typing import FloatArray, IntArray
from sea_ident.excitation.criteria import Criterion
from sea_ident.excitation.information import Information
from sea_ident.excitation.linear_limits import LinearLimits
from sea_ident.excitation.quadratic import solve_quadratic
from sea_ident.motion import FourierSeries

# The QP keeps this part of each range as a reserve against what falls between its cuts.
RESERVE = 1e-6
_CUT_ROUNDS = 8


@dataclass(frozen=True, eq=False)
class Problem:
    """A criterion to be raised inside limits.

    Attributes:
        information: the information matrix.
        criterion: function of it.
        limits: limits that are linear in the coefficients.
    """

    information: Information
    criterion: Criterion
    limits: LinearLimits

    @property
    def shape(self) -> tuple[int, int]:
        """(n, 2 L + 1) shape of the coefficients."""
        return self.information.columns.robot.n, 2 * self.information.harmonics + 1

    def series(self, coefficients: FloatArray) -> FourierSeries:
        """The motion."""
        return FourierSeries.from_coefficients(coefficients, self.information.base_frequency)

    def value(self, coefficients: FloatArray) -> float:
        """The criterion, minus infinity where G is singular."""
        eigenvalues = np.linalg.eigvalsh(self.information.matrix(coefficients))
        return self.criterion.value(eigenvalues) if eigenvalues[0] > 0.0 else -np.inf

    def inside(self, coefficients: FloatArray) -> bool:
        """Whether all limits hold for all t."""
        return bool(np.all(self.limits.margins(self.series(coefficients)) >= 0.0))


@dataclass(eq=False)
class Cuts:
    """The times at which the limits enter the QP; grows as extrema are found."""

    problem: Problem
    which: IntArray = field(default_factory=lambda: np.zeros(0, dtype=np.intp))
    time: FloatArray = field(default_factory=lambda: np.zeros(0))
    rows: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))

    def add(self, which: IntArray, time: FloatArray) -> None:
        """Add limits at times."""
        information = self.problem.information
        new = self.problem.limits.rows((information.base_frequency, information.harmonics), which, time)
        self.rows = new if not len(self.rows) else np.vstack([self.rows, new])
        self.which, self.time = np.concatenate([self.which, which]), np.concatenate([self.time, time])

    def keep(self, chosen: FloatArray) -> None:
        """Drop all others."""
        self.which, self.time, self.rows = self.which[chosen], self.time[chosen], self.rows[chosen]

    def add_extrema(self, coefficients: FloatArray, within: float) -> int:
        """Add the extrema of a trajectory that lie within a part of the range of their limit, or beyond it.

        Returns:
            How many were added.
        """
        limits, series = self.problem.limits, self.problem.series(coefficients)
        _, _, which, time = limits.extremes(series)
        if not len(which):
            return 0
        information = self.problem.information
        rows = limits.rows((information.base_frequency, information.harmonics), which, time)
        value = rows @ coefficients.ravel()
        distance = np.minimum(value - limits.lower[which], limits.upper[which] - value) / limits.width[which]
        take = distance < within
        self.rows = rows[take] if not len(self.rows) else np.vstack([self.rows, rows[take]])
        self.which = np.concatenate([self.which, which[take]])
        self.time = np.concatenate([self.time, time[take]])
        return int(np.count_nonzero(take))


def grid_cuts(problem: Problem, points: int) -> Cuts:
    """Cuts at equidistant times, moved against each other from limit to limit."""
    cuts = Cuts(problem)
    period = 1.0 / problem.information.base_frequency
    count = len(problem.limits)
    which = np.repeat(np.arange(count), points)
    time = (np.tile(np.arange(points), count) + np.repeat(np.arange(count) / max(count, 1), points)) * period / points
    cuts.add(which, time)
    return cuts


def constrained_step(
    cuts: Cuts, coefficients: FloatArray, gradient: FloatArray, hessian: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """The step that maximises ``gradient p - 1/2 p hessian p`` inside the limits.

    Args:
        cuts: where the limits enter; extrema of what the QP proposes are added.
        coefficients: (n, 2 L + 1) present point.
        gradient: (v,).
        hessian: (v, v), positive definite.

    Returns:
        (v,) step, and (R,) multipliers of the cuts.
    """
    limits = cuts.problem.limits.tightened(2.0 * RESERVE)
    loose = cuts.problem.limits.tightened(RESERVE)
    start: tuple[FloatArray, FloatArray] | None = None
    for _ in range(_CUT_ROUNDS):
        present = cuts.rows @ coefficients.ravel()
        step, multipliers = solve_quadratic(
            hessian, -gradient, cuts.rows, limits.lower[cuts.which] - present, limits.upper[cuts.which] - present, start
        )
        trial = coefficients + step.reshape(coefficients.shape)
        series = cuts.problem.series(trial)
        if np.all(loose.margins(series) >= 0.0):
            break
        before = len(cuts.which)
        cuts.add_extrema(trial, 2.0 * RESERVE)
        start = (step, np.concatenate([multipliers, np.zeros(len(cuts.which) - before)]))
    return step, multipliers


def pull_inside(problem: Problem, inner: FloatArray, outer: FloatArray) -> float:
    """Largest found part of the way from `inner` to `outer` that stays inside; the limits are convex."""
    if problem.inside(outer):
        return 1.0
    low, high = 0.0, 1.0
    for _ in range(30):
        middle = 0.5 * (low + high) if low > 0.0 or high < 1.0 else 0.999
        if problem.inside(inner + middle * (outer - inner)):
            low = middle
        else:
            high = middle
        if high - low < 1e-3 * max(low, 1e-6):
            break
    return low


@dataclass(frozen=True, eq=False)
class Ascent:
    """What an ascent found.

    Attributes:
        coefficients: (n, 2 L + 1) best trajectory.
        value: its criterion.
        history: criterion after every step.
    """

    coefficients: FloatArray
    value: float
    history: tuple[float, ...]


def climb(
    problem: Problem,
    coefficients: FloatArray,
    *,
    iterations: int = 100,
    tolerance: float = 1e-4,
    report: Callable[[float, FloatArray], bool] | None = None,
) -> Ascent:
    """Climb from a feasible trajectory.

    Args:
        problem: what to raise, inside what.
        coefficients: (n, 2 L + 1) start, inside all limits.
        iterations: at most so many steps.
        tolerance: stop when the predicted gain is below it.
        report: called with value and coefficients after every step; True stops.

    Returns:
        The best trajectory; it is inside all limits, and no worse than the start.
    """
    point, value = coefficients, problem.value(coefficients)
    history = [value]
    cuts = grid_cuts(problem, 2 * problem.information.harmonics + 2)
    fixed = len(cuts.which)
    damping = 1e-3
    poor = 0
    for _ in range(iterations):
        cuts.add_extrema(point, 0.05)
        local = problem.information.model(point)
        eigenvalues, vectors = np.linalg.eigh(local.matrix)
        slope, weights = problem.criterion.slope(eigenvalues)
        gradient = local.gradient((vectors * slope) @ vectors.T)
        changes = local.changes(vectors)
        scaled = (changes * np.sqrt(np.maximum(weights, 0.0)).astype(np.float32)).reshape(len(changes), -1)
        curvature = (scaled @ scaled.T).astype(np.float64)
        diagonal = np.diag(curvature)
        diagonal = np.maximum(diagonal, 1e-6 * diagonal.max())
        accepted = False
        while not accepted and damping < 1e8:
            hessian = curvature + damping * np.diag(diagonal)
            step, multipliers = constrained_step(cuts, point, gradient, hessian)
            move = step.reshape(point.shape)
            length = pull_inside(problem, point, point + move)
            predicted = float(gradient @ step - 0.5 * step @ curvature @ step)
            for _ in range(2):
                trial = point + length * move
                found = problem.value(trial)
                if found > value:
                    accepted = True
                    break
                length *= 0.3
            if not accepted:
                if predicted < tolerance:
                    break
                damping = max(damping, 1e-3) * 10.0
        if not accepted:
            break
        gain, value, point = found - value, found, trial
        history.append(value)
        damping = damping * (0.3 if gain > 0.6 * predicted else 1.0 if gain > 0.2 * predicted else 4.0)
        damping = max(damping, 1e-6)
        active = np.abs(multipliers) > 1e-9
        active = np.concatenate([active, np.zeros(len(cuts.which) - len(active), dtype=bool)])
        active[:fixed] = True
        cuts.keep(active)
        if report is not None and report(value, point):
            break
        poor = poor + 1 if gain < tolerance else 0
        if poor >= 2:
            break
    return Ascent(point, value, tuple(history))
