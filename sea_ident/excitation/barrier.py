"""Ascent of a criterion inside walls, by an interior-point method for each quadratic model.

The criterion is replaced by its gradient and a Gauss-Newton curvature. A few primal-dual steps maximise that model
inside all limits at once, each taken on a dense grid of times (linear limits cost next to nothing there); then the true
criterion decides how far to go. What a limit does between the grid points is taken off it.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg

from sea_ident._typing import FloatArray
from sea_ident.excitation.criteria import Criterion
from sea_ident.excitation.information import Information, LocalModel
from sea_ident.excitation.walls import Tangent, Wall

_BOUNDARY = 0.95
_SMALLEST = 1e-8
_OPEN = 1e6  # stands for a side without limit
_INNER = 12
_CORRECTIONS = 3
import os
KLO,KHI,KMIN,KMAX = map(float, os.environ.get('KK', '0.5,2,0.25,16').split(','))
_FAR = 0.25  # of the room at rest: a nonlinear wall with more slack takes no part in a step
_INSET = 1e-6  # of the room between rest and limit: kept free


@dataclass(eq=False)
class Side:
    """One side of a wall: slack = sign * (bound - value) - beyond > 0.

    Attributes:
        wall: index of the wall.
        sign: 1 for the upper side, -1 for the lower.
        bound: (r, 1) bounds.
        beyond: (r, M) what the value does between the grid points.
        slack: (r, M) distance.
        force: (r, M) multipliers.
        room: (r, 1) slack of the trajectory at rest.
    """

    wall: int
    sign: float
    bound: FloatArray
    beyond: FloatArray
    slack: FloatArray
    force: FloatArray
    room: FloatArray


@dataclass(eq=False)
class _Inner:
    """Where the maximisation of a quadratic model stands.

    Attributes:
        step: (v,).
        slacks: (r, M) of every side, as far as linearised walls tell.
        forces: (r, M) multipliers of every side.
        barrier: weight of the barrier.
    """

    step: FloatArray
    slacks: list[FloatArray]
    forces: list[FloatArray]
    barrier: float


@dataclass(frozen=True, eq=False)
class _InnerProblem:
    """A quadratic model inside linearised walls.

    Attributes:
        gradient: (v,).
        curvature: (v, v), positive definite.
        tangents: the walls that are near, by index.
        sides: their slacks and multipliers at the beginning.
        shape: of the coefficients.
    """

    gradient: FloatArray
    curvature: FloatArray
    tangents: Mapping[int, Tangent]
    sides: Sequence[Side]
    shape: tuple[int, int]

    def advance(self, inner: _Inner, missing: Sequence[FloatArray] | None = None) -> float:
        """One primal-dual step; what slacks are too large by is made up for.

        Returns:
            The part of the step that was taken.
        """
        slacks, forces, barrier = inner.slacks, inner.forces, inner.barrier
        pushed = self.gradient - self.curvature @ inner.step
        walled = self.curvature.copy()
        for k, tangent in self.tangents.items():
            here = [j for j, side in enumerate(self.sides) if side.wall == k]
            stiffness = [forces[j] / slacks[j] for j in here]
            push = [self.sides[j].sign * barrier / slacks[j] for j in here]
            if missing is not None:
                push += [self.sides[j].sign * stiff * missing[j] for j, stiff in zip(here, stiffness, strict=True)]
            pushed -= tangent.pull(np.sum(push, axis=0))
            walled += tangent.curvature(np.sum(stiffness, axis=0))
        change = scipy.linalg.solve(walled, pushed, assume_a="pos", check_finite=False)
        moved = {k: tangent.push(change.reshape(self.shape)) for k, tangent in self.tangents.items()}
        closings = {j: side.sign * moved[side.wall] for j, side in enumerate(self.sides) if side.wall in self.tangents}
        if missing is not None:
            closings = {j: closing + missing[j] for j, closing in closings.items()}
        length = min(_fraction(slacks[j], closing) for j, closing in closings.items())
        inner.step = inner.step + length * change
        for j, closing in closings.items():
            force = barrier / slacks[j] * (1.0 + closing * forces[j] / barrier)
            slacks[j] = slacks[j] - length * closing
            forces[j] = np.clip(force, 0.3 * barrier / slacks[j], 30.0 * barrier / slacks[j])
        return length

    def solve(self, barrier: float) -> _Inner:
        """Maximise, with this weight of the barrier to begin with."""
        sides = self.sides
        step = np.zeros(len(self.gradient))
        inner = _Inner(step, [side.slack for side in sides], [side.force for side in sides], barrier)
        for _ in range(_INNER):
            length = self.advance(inner)
            gain = float(self.gradient @ inner.step - 0.5 * inner.step @ self.curvature @ inner.step)
            if length > 0.8:
                if inner.barrier * len(self.gradient) < 0.1 * gain or inner.barrier <= _SMALLEST:
                    break
                inner.barrier = max(_SMALLEST, 0.2 * inner.barrier)
        return inner

    def correct(self, inner: _Inner, there: Sequence[Side]) -> FloatArray:
        """(v,) the step once more, with what bends the walls on the way to its end.

        Args:
            inner: the step.
            there: slacks that were found at its end.
        """
        missing = [slack - side.slack for slack, side in zip(inner.slacks, there, strict=True)]
        bent = replace(inner, slacks=list(inner.slacks), forces=list(inner.forces))
        for _ in range(_CORRECTIONS):
            length = self.advance(bent, missing)
            missing = [(1.0 - length) * part for part in missing]
            if length > 0.99:
                break
        return bent.step


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
            inner_problem = _InnerProblem(gradient, damped, tangents, sides, point.shape)
            inner = inner_problem.solve(barrier)
            step = inner.step
            predicted = float(gradient @ step - 0.5 * step @ damped @ step)
            bend = np.zeros(len(step))
            measured, worst = measure(walls, middle, point + step.reshape(point.shape))
            if worst < 1.0:
                bend = inner_problem.correct(inner, measured) - step
            for halvings in range(4):
                part = 0.4**halvings
                trial = point + (part * step + part**2 * bend).reshape(point.shape)
                placed = (trial, measured) if worst >= 1.0 and halvings == 0 else place_inside(walls, middle, centre, trial)
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
        stiffness = float(np.clip(stiffness * np.clip(2.0 - gain / predicted, KLO, KHI), KMIN, KMAX))
        point, sides = placed
        forces, barrier = inner.forces, inner.barrier
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


def measure(
    walls: Sequence[Wall], middle: Sequence[FloatArray], coefficients: FloatArray
) -> tuple[list[Side], float]:
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


def _fraction(slack: FloatArray, closing: FloatArray) -> float:
    """Largest part of a step that uses up no more than nearly all of any slack."""
    worst = float((closing / slack).max(initial=0.0))
    return 1.0 if worst <= _BOUNDARY else _BOUNDARY / worst
