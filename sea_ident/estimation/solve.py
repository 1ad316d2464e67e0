"""Weighted least squares by orthogonal decomposition, and what follows from it."""

from dataclasses import dataclass

import numpy as np
import scipy.linalg

from sea_ident._typing import FloatArray
from sea_ident.exceptions import IdentificationError


@dataclass(frozen=True, eq=False)
class Solution:
    """A weighted least-squares solution ``x = (F' W F)^-1 F' W b`` (paper, eq. 9).

    Attributes:
        values: (b,) x.
        inverse: (b, b) (F' W F)^-1.
        triangle: (b, b) R of the QR decomposition of W^1/2 F.
    """

    values: FloatArray
    inverse: FloatArray
    triangle: FloatArray

    @property
    def log_det(self) -> float:
        """Natural logarithm of det F' W F."""
        return 2.0 * float(np.log(np.abs(np.diag(self.triangle))).sum())


def solve_weighted(rows: FloatArray, torque: FloatArray, weights: FloatArray | None = None) -> Solution:
    """Solve by QR of the column-normalised, weighted rows.

    Args:
        rows: (N, n, b) regressor.
        torque: (N, n).
        weights: (N, n) inverse variances up to a factor; all one where None.

    Returns:
        The solution.

    Raises:
        IdentificationError: fewer equations than parameters, or a column that is not independent of the others.
    """
    count = rows.shape[-1]
    matrix = rows.reshape(-1, count)
    side = torque.reshape(-1)
    if weights is not None:
        root = np.sqrt(weights).reshape(-1)
        matrix, side = matrix * root[:, None], side * root
    if len(matrix) < count:
        raise IdentificationError(f"{len(matrix)} equations cannot tell {count} parameters; record longer")
    upper = scipy.linalg.qr(np.column_stack([matrix, side]), mode="r", overwrite_a=True, check_finite=False)[0]
    return solve_triangle(upper[: count + 1])


def solve_triangle(upper: FloatArray) -> Solution:
    """Solve from the triangular factor of ``[W^1/2 F, W^1/2 b]``.

    Args:
        upper: (b + 1, b + 1) triangular factor (fewer rows are filled up with zeros).

    Returns:
        The solution.

    Raises:
        IdentificationError: the columns are not independent.
    """
    count = upper.shape[1] - 1
    triangle, side = upper[:count, :count], upper[:count, count]
    norms = np.linalg.norm(triangle, axis=0)
    if np.any(norms == 0.0):
        raise IdentificationError("a column of the regressor is zero: its parameter has no influence on this data")
    scaled = triangle / norms
    if np.linalg.cond(scaled) > 1e14:
        raise IdentificationError("the columns of the regressor depend on each other in this data")
    values = scipy.linalg.solve_triangular(scaled, side) / norms
    half = scipy.linalg.solve_triangular(scaled, np.eye(count)) / norms[:, None]
    return Solution(values, half @ half.T, triangle)


def condition_number(triangle: FloatArray) -> float:
    """Condition number of the column-normalised regressor from its triangular factor (paper, II.B)."""
    return float(np.linalg.cond(triangle / np.linalg.norm(triangle, axis=0)))


def solve_across(gram: FloatArray, side: FloatArray, nothing: FloatArray) -> FloatArray:
    """(c, ...) the solution of products (c, c) that has no part in directions (c, k) that these say nothing of."""
    if not nothing.size:
        return np.asarray(np.linalg.solve(gram, side), dtype=np.float64)
    across = np.eye(len(gram)) - nothing @ nothing.T
    # a product of one in these directions keeps the rest as it is
    found = across @ np.linalg.solve(across @ gram @ across + nothing @ nothing.T, across @ side)
    return np.asarray(found, dtype=np.float64)
