"""Maximise a quadratic model inside linearised walls by primal-dual steps, and correct the step for what bends them.

The linearised walls tell the slacks at the end of a step only to first order. Where the true ones are smaller, the same
walls shifted by the difference are gone through once more: the end of the step comes to lie inside, and nothing of the
gain is lost to shrinking the trajectory.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg

from sea_ident._typing import FloatArray
from sea_ident.excitation.walls import Tangent

_BOUNDARY = 0.95
_SMALLEST = 1e-8
_INNER = 12
_CORRECTIONS = 3


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
class Step:
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
class StepProblem:
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

    def advance(self, found: Step, missing: Sequence[FloatArray] | None = None) -> float:
        """One primal-dual step.

        Args:
            found: where it begins, and after it where it ends.
            missing: (r, M) of every side, by how much its slack is too large; it is made up for.

        Returns:
            The part of the step that was taken.
        """
        slacks, forces, barrier = found.slacks, found.forces, found.barrier
        pushed = self.gradient - self.curvature @ found.step
        walled = self.curvature.copy()
        for k, tangent in self.tangents.items():
            here = [j for j, side in enumerate(self.sides) if side.wall == k]
            stiffness = [forces[j] / slacks[j] for j in here]
            push = [self.sides[j].sign * barrier / slacks[j] for j in here]
            if missing is not None:
                push += [self.sides[j].sign * stiff * missing[j] for j, stiff in zip(here, stiffness, strict=True)]
            pushed -= tangent.pull(np.sum(push, axis=0))
            walled += tangent.curvature(np.sum(stiffness, axis=0))
        # near a wall its curvature is beyond all others; a step that ends inside is all that is asked of it
        factor = scipy.linalg.cho_factor(walled, overwrite_a=True, check_finite=False)
        change = scipy.linalg.cho_solve(factor, pushed, check_finite=False)
        moved = {k: tangent.push(change.reshape(self.shape)) for k, tangent in self.tangents.items()}
        closings = {j: side.sign * moved[side.wall] for j, side in enumerate(self.sides) if side.wall in self.tangents}
        if missing is not None:
            closings = {j: closing + missing[j] for j, closing in closings.items()}
        length = min(_fraction(slacks[j], closing) for j, closing in closings.items())
        found.step = found.step + length * change
        for j, closing in closings.items():
            force = barrier / slacks[j] * (1.0 + closing * forces[j] / barrier)
            slacks[j] = slacks[j] - length * closing
            forces[j] = np.clip(force, 0.3 * barrier / slacks[j], 30.0 * barrier / slacks[j])
        return length

    def solve(self, barrier: float) -> Step:
        """Maximise, with this weight of the barrier to begin with."""
        sides = self.sides
        step = np.zeros(len(self.gradient))
        found = Step(step, [side.slack for side in sides], [side.force for side in sides], barrier)
        for _ in range(_INNER):
            length = self.advance(found)
            gain = float(self.gradient @ found.step - 0.5 * found.step @ self.curvature @ found.step)
            if length > 0.8:
                if found.barrier * len(self.gradient) < 0.1 * gain or found.barrier <= _SMALLEST:
                    break
                found.barrier = max(_SMALLEST, 0.2 * found.barrier)
        return found

    def correct(self, found: Step, there: Sequence[Side]) -> FloatArray:
        """(v,) the step once more, with what bends the walls on the way to its end.

        Args:
            found: the step.
            there: slacks that were found at its end.
        """
        missing = [slack - side.slack for slack, side in zip(found.slacks, there, strict=True)]
        bent = replace(found, slacks=list(found.slacks), forces=list(found.forces))
        for _ in range(_CORRECTIONS):
            length = self.advance(bent, missing)
            missing = [(1.0 - length) * part for part in missing]
            if length > 0.99:
                break
        return bent.step


def _fraction(slack: FloatArray, closing: FloatArray) -> float:
    """Largest part of a step that uses up no more than nearly all of any slack."""
    worst = float((closing / slack).max(initial=0.0))
    return 1.0 if worst <= _BOUNDARY else _BOUNDARY / worst
