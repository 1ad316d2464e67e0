"""Ascent of a criterion inside walls, by an interior-point method for each quadratic model.

The criterion is replaced by its gradient and a Gauss-Newton curvature. A few primal-dual steps maximise that model
inside all limits at once, each taken on a dense grid of times (linear limits cost next to nothing there); then the true
criterion decides how far to go, and how stiff the model is to be in the next step: the curvature leaves out that of the
columns and of the walls. What a limit does between the grid points is taken off it.
"""

from collections.abc import Callable, Sequence

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.excitation.criteria import Criterion
from sea_ident.excitation.information import Information, LocalModel
from sea_ident.excitation.model_step import Side, StepProblem
from sea_ident.excitation.walls import Wall

_OPEN = 1e6  # stands for a side without limit
_FAR = 0.25  # of the room at rest: a nonlinear wall with more slack takes no part in a step
_INSET = 1e-6  # of the room between rest and limit: kept free
# factor on the Gauss-Newton curvature, and by how much a step may change it
_STIFFNESS = (0.25, 16.0)
_STIFFER = (0.5, 2.0)
_GRAIN = 1.0 / 16.0


def raise_inside(
    information: Information,
    criterion: Criterion,
    walls: Sequence[Wall],
    centre: FloatArray,
    coefficients: FloatArray,
    *,
    iterations: int = 80,
    barrier: float = 1e-2,
    tolerance: float = 1e-3,
    report: Callable[[float, FloatArray], bool] | None = None,
) -> FloatArray:
    """Raise a criterion inside walls.

    Args:
        information: the information matrix.
        criterion: function of it.
        walls: limits on grids of times.
        centre: (n, 2 L + 1) a trajectory at rest, well inside.
        coefficients: (n, 2 L + 1) start, inside.
        iterations: at most so many steps.
        barrier: weight of the logarithm of the slacks at the start.
        tolerance: gain of a step that is too small to go on for.
        report: called with value and coefficients after every step; True stops.

    Returns:
        (n, 2 L + 1) coefficients, inside; the criterion is never below that of the start.
    """
    middle = [wall.values(centre) for wall in walls]
    placed = place_inside(walls, middle, centre, coefficients)
    if placed is None:
        return coefficients
    point, sides = placed
    there = information.model(point)
    value = criterion.value(there.matrix)
    forces = [barrier / side.slack for side in sides]
    damping, stiffness, small = 1e-3, 1.0, 0
    for _ in range(iterations):
        gradient, curvature = quadratic_model(there, criterion)
        curvature *= stiffness
        tangents = {k: wall.tangent(point) for k, wall in enumerate(walls) if _near(sides, k)}
        diagonal = np.diag(curvature).copy()
        found = -np.inf
        while found <= value:
            damped = curvature + np.diag(damping * diagonal + 1e-9 * diagonal.max())
            for side, force in zip(sides, forces, strict=True):
                side.force = np.clip(force, 0.3 * barrier / side.slack, 30.0 * barrier / side.slack)
            problem = StepProblem(gradient, damped, tangents, sides, point.shape)
            solved = problem.solve(barrier)
            step, bend = solved.step, np.zeros(point.size)
            predicted = float(gradient @ step - 0.5 * step @ damped @ step)
            end = point + step.reshape(point.shape)
            reached, factor = measure(walls, middle, end)
            if factor < 1.0:
                bend = problem.correct(solved, reached) - step
            for halvings in range(4):
                part = 0.4**halvings
                if halvings == 0 and factor >= 1.0:
                    placed = end, reached
                else:
                    trial = point + (part * step + part**2 * bend).reshape(point.shape)
                    placed = place_inside(walls, middle, centre, trial)
                if placed is not None:
                    there = information.model(placed[0])
                    found = criterion.value(there.matrix)
                    if found > value:
                        break
            if found <= value:
                if predicted < tolerance or damping > 1e4:
                    return point
                damping *= 10.0
        assert placed is not None
        gain, value = found - value, found
        if predicted > 0.0 and np.isfinite(gain):  # infinite where a parameter did not show before the step
            # of the parabola that begins with the slope of the model and ends with the true gain; rounded, as the last
            # digits of a gain would lead the ascent into another optimum
            stiffer = float(np.clip(round((2.0 - gain / predicted) / _GRAIN) * _GRAIN, *_STIFFER))
            stiffness = float(np.clip(stiffness * stiffer, *_STIFFNESS))
        point, sides = placed
        forces, barrier = solved.forces, solved.barrier
        damping = max(1e-6, damping * (0.3, 1.0, 4.0, 10.0)[halvings])
        if report is not None and report(value, point):
            break
        small = small + 1 if gain < tolerance else 0
        if small >= 2:
            break
    return point


def quadratic_model(there: LocalModel, criterion: Criterion) -> tuple[FloatArray, FloatArray]:
    """(v,) exact gradient and (v, v) Gauss-Newton curvature of a criterion at a point."""
    local = criterion.local(there.matrix)
    gradient = there.gradient(local.derivative)
    changes = there.changes(local.vectors)
    scaled = (changes * np.sqrt(local.weights).astype(np.float32)).reshape(len(changes), -1)
    return gradient, (scaled @ scaled.T).astype(np.float64)


def place_inside(
    walls: Sequence[Wall], middle: Sequence[FloatArray], centre: FloatArray, coefficients: FloatArray
) -> tuple[FloatArray, list[Side]] | None:
    """Shrink a trajectory toward rest until it is inside between the grid points too.

    Args:
        walls: the limits.
        middle: their values at rest.
        centre: (n, 2 L + 1) a trajectory at rest, inside.
        coefficients: (n, 2 L + 1) trajectory.

    Returns:
        The trajectory and its slacks, or None where it would have to shrink by more than half.
    """
    factor = 1.0
    for _ in range(8):
        trial = centre + factor * (coefficients - centre)
        sides, worst = measure(walls, middle, trial)
        if worst >= 1.0:
            return trial, sides
        factor *= worst
        if factor < 0.5:
            return None
    return None


def measure(walls: Sequence[Wall], middle: Sequence[FloatArray], coefficients: FloatArray) -> tuple[list[Side], float]:
    """Slacks of a trajectory.

    Args:
        walls: the limits.
        middle: their values at rest.
        coefficients: (n, 2 L + 1) trajectory.

    Returns:
        Its slacks, and the factor by which it has to shrink toward rest so that they are positive, 1 if they are.
    """
    sides: list[Side] = []
    worst = 1.0
    for k, wall in enumerate(walls):
        value = wall.values(coefficients)
        below, above = wall.overshoot(value)
        for sign, bound, beyond in ((1.0, wall.upper, above), (-1.0, wall.lower, below)):
            finite = np.where(np.isfinite(bound), bound, sign * _OPEN)
            slack = sign * (finite - value) - beyond
            room = sign * (finite - middle[k][:, :1])
            tight = slack < _INSET * room
            if np.any(tight):
                there = np.broadcast_to(room, slack.shape)[tight]
                worst = min(worst, float((there / (there - slack[tight])).min()) * (1.0 - 2.0 * _INSET))
            sides.append(Side(k, sign, finite, beyond, slack, slack, room))
    return sides, worst


def _near(sides: Sequence[Side], wall: int) -> bool:
    """Whether a wall is near enough to take part in a step; the first one, of linear limits, always is."""
    if wall == 0:
        return True
    return any(bool(np.any(side.slack < _FAR * side.room)) for side in sides if side.wall == wall)
