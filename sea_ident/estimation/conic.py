"""A small conic problem, built block by block and solved by Clarabel."""

from dataclasses import dataclass, field
from typing import Any

import clarabel
import numpy as np
from scipy import sparse

from sea_ident._typing import FloatArray
from sea_ident.exceptions import IdentificationError

SOLVED = ("Solved", "AlmostSolved")

TOLERANCES = (1e-10, 1e-8, 1e-6)
"""Tried one after the other: close to the border of the cones the tightest may be out of reach."""


@dataclass
class ConicProgram:
    """minimise x' H x / 2 + g' x subject to affine expressions of x in cones.

    Attributes:
        size: number of variables.
        hessian: (size, size) H.
        gradient: (size,) g.
    """

    size: int
    hessian: FloatArray = field(init=False)
    gradient: FloatArray = field(init=False)

    def __post_init__(self) -> None:
        self.hessian = np.zeros((self.size, self.size))
        self.gradient = np.zeros(self.size)
        self._rows: list[FloatArray] = []
        self._sides: list[FloatArray] = []
        self._cones: list[Any] = []

    def _add(self, matrix: FloatArray, offset: FloatArray, cone: Any) -> None:
        # Clarabel wants s = b - A x in the cone
        self._rows.append(-np.atleast_2d(matrix))
        self._sides.append(np.atleast_1d(offset))
        self._cones.append(cone)

    def equal(self, matrix: FloatArray, side: FloatArray) -> None:
        """``matrix @ x = side``."""
        if len(matrix):
            self._add(matrix, -side, clarabel.ZeroConeT(len(matrix)))

    def nonnegative(self, matrix: FloatArray, offset: FloatArray) -> None:
        """``matrix @ x + offset >= 0``."""
        if len(matrix):
            self._add(matrix, offset, clarabel.NonnegativeConeT(len(matrix)))

    def positive_semidefinite(self, coefficients: FloatArray, offset: FloatArray) -> None:
        """``sum_j x_j coefficients[j] + offset`` (n, n) is positive semidefinite; coefficients (size, n, n)."""
        n = len(offset)
        rows, columns = zip(*[(i, j) for j in range(n) for i in range(j + 1)], strict=True)
        scale = np.where(np.array(rows) == np.array(columns), 1.0, np.sqrt(2.0))
        matrix = coefficients[:, rows, columns].T * scale[:, None]
        self._add(matrix, offset[rows, columns] * scale, clarabel.PSDTriangleConeT(n))

    def exponential(self, matrix: FloatArray, offset: FloatArray) -> None:
        """The three entries (a, b, c) of ``matrix @ x + offset`` satisfy b exp(a / b) <= c, b > 0."""
        self._add(matrix, offset, clarabel.ExponentialConeT())

    def solve(self, what: str) -> FloatArray:
        """The optimal x.

        Args:
            what: what is solved for, for the message.

        Raises:
            IdentificationError: if there is none, or it is not found.
        """
        hessian = sparse.csc_matrix(np.triu(self.hessian))
        rows, sides = sparse.csc_matrix(np.vstack(self._rows)), np.concatenate(self._sides)
        status = ""
        for tolerance in TOLERANCES:
            settings = clarabel.DefaultSettings()
            settings.verbose = False
            settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = tolerance
            settings.max_iter = 200
            solution = clarabel.DefaultSolver(hessian, self.gradient, rows, sides, self._cones, settings).solve()
            status = str(solution.status)
            values: FloatArray = np.array(solution.x, dtype=np.float64)
            usable = status in SOLVED or status == "InsufficientProgress"
            if usable and np.all(np.isfinite(values)):
                return values
        raise IdentificationError(f"{what}: the conic solver ends with {status!r}; there may be no solution")
