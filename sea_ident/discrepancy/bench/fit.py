"""A model fitted to a recording."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sea_ident._typing import FloatArray, IntArray
from sea_ident.discrepancy.bench.freed import Freed
from sea_ident.discrepancy.bench.linear import off, solve, solve_near
from sea_ident.discrepancy.measured.noise import ComplexArray
from sea_ident.effects import Column, Effect, Shape


@dataclass(frozen=True, eq=False)
class Known:
    """What is there beside a model that is fitted.

    Attributes:
        torque: (H + 1, E) [N m].
        stiffness: (E,) what it adds to the slope of the spring torque of a link over its deflection.
    """

    torque: ComplexArray
    stiffness: FloatArray


@dataclass(frozen=True, eq=False)
class Solution:
    """What a fit came to: all that it takes to have it again, and light enough to be sent from one process to another.

    Attributes:
        effects: the model, with its shapes.
        values: (p,) parameters.
        frame: of the fit.
    """

    effects: tuple[Effect, ...]
    values: FloatArray
    frame: FloatArray | None


@dataclass(frozen=True, eq=False)
class Fit:
    """A model fitted to the mean residual, everything free.

    Attributes:
        effects: the model, with its shapes.
        columns: (p,) labels.
        values: (p,) parameters; where the data tell only combinations, as near to the priors as they let.
        residual: (H + 1, E) complex residual of the mean [N m].
        scale: (E,) factor of the residual before it is whitened [-].
        whitened: (M,) whitened residual.
        free: the samples that are left out.
        linear: gives `flat` and `directions` to those that ask: most fits are trials of which nothing but the statistic
            is wanted.
        free_shapes: (s,) which shapes are free: index of the effect, and the shape.
        frame: (p, r) what makes `flat` nearly orthonormal, where no shape is free and it is known.
        known: what is there beside the model; None where that is nothing.
        followed: gives the part (M, p) of what parameters do that a step of a fit does not know: what effects are
            anchored in they follow in the next step. None where there is none.
    """

    effects: tuple[Effect, ...]
    columns: tuple[Column, ...]
    values: FloatArray
    residual: ComplexArray
    scale: FloatArray
    whitened: FloatArray
    free: Freed
    linear: Callable[[], tuple[FloatArray, ComplexArray]]
    free_shapes: tuple[tuple[int, Shape], ...]
    frame: FloatArray | None = None
    known: Known | None = None
    followed: Callable[[], FloatArray | None] = lambda: None

    @property
    def solution(self) -> Solution:
        """What it came to."""
        return Solution(self.effects, self.values, self.frame)

    @property
    def statistic(self) -> float:
        """Weighted sum of squared residuals."""
        return float(self.whitened @ self.whitened)

    @cached_property
    def _linear(self) -> tuple[FloatArray, ComplexArray]:
        return self.linear()

    @property
    def flat(self) -> FloatArray:
        """(M, p + s) whitened `directions`, without the samples that are left out."""
        return self._linear[0]

    @property
    def directions(self) -> ComplexArray:
        """(H + 1, E, p + s) scaled torque by columns, and tangents of the shapes."""
        return self._linear[1]

    @property
    def basis(self) -> FloatArray:
        """(M, r) orthonormal basis of what is free beside the samples left out: columns, and tangents of the shapes."""
        return self._solved[0]

    @property
    def step_factor(self) -> FloatArray:
        """(p + s, r) what takes amounts along `basis` to those of parameters and shapes."""
        return self._solved[1]

    @cached_property
    def covariance_factor(self) -> FloatArray:
        """(p + s, r) factor whose square is the covariance of parameters and shapes."""
        followed = self.followed()
        if followed is None:
            return self._solved[1]
        whole = self.flat.copy()
        whole[:, : followed.shape[1]] += followed
        return solve(whole, self.whitened)[2]

    @cached_property
    def _solved(self) -> tuple[FloatArray, FloatArray]:
        return solve(self.flat, self.whitened)[1:] if self.frame is None else solve_near(self.frame, self.flat)

    @property
    def dof(self) -> int:
        """Degrees of freedom of the statistic."""
        return int(len(self.whitened) - self.free.count - self.basis.shape[1])

    @property
    def unit(self) -> float:
        """What a difference of the statistic is measured in, where the model leaves more than noise; at least one."""
        return max(self.statistic / max(self.dof, 1), 1.0)

    @property
    def excess(self) -> float:
        """Part of the statistic beyond what noise leaves, at least zero."""
        return max(self.statistic - self.dof, 0.0)

    def off(self, columns: FloatArray) -> FloatArray:
        """Columns (M, ...) without what anything that is free could take up of them."""
        return off(self.basis, self.free.off(columns))

    @cached_property
    def parameters(self) -> dict[str, float]:
        """Value of every parameter by name."""
        return {column.name: float(value) for column, value in zip(self.columns, self.values, strict=True)}

    def std(self, index: int) -> float:
        """Standard deviation of a parameter (index < p) or a shape (p + position in `free_shapes`)."""
        return float(np.linalg.norm(self.covariance_factor[index]))

    def lost_by(self, rows: slice | IntArray, values: FloatArray) -> float:
        """By how much the statistic grows, to second order, where parameters are off by values (k,): v' C^-1 v."""
        factor = self.covariance_factor[rows]
        return float(values @ np.linalg.lstsq(factor @ factor.T, values, rcond=None)[0])

    def slice_of(self, position: int, robot_columns: Sequence[int]) -> slice:
        """Columns of one effect, given the number of columns of every effect."""
        start = int(sum(robot_columns[:position]))
        return slice(start, start + int(robot_columns[position]))
