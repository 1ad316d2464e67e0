"""Linear algebra of whitened columns."""

import numpy as np
import scipy.linalg

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.measured.noise import ComplexArray, stacked
from sea_ident.singular_values import svd

RANK_TOLERANCE = 1e-9
"""Singular directions of the normalised columns below this share of the largest are left out."""

NEARLY_ORTHONORMAL = 0.1
"""Share of the longest that the shortest of columns, less what the others have of it, may be: their products then tell
as much as the columns."""

FAR_FROM_SINGULAR = 1e-6
"""Reciprocal condition number of normalised columns from which on all of them are kept for sure."""

FAR_FROM_LOSS = 1e-3
"""Reciprocal condition number of normalised columns from which on a basis from their products has ten digits."""


def solve(columns: FloatArray, target: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Least squares with columns that may depend on each other.

    Args:
        columns: (M, p).
        target: (M,).

    Returns:
        (p,) smallest solution in normalised columns, (M, r) orthonormal basis, and (p, r) factor L so that L L' is the
        covariance of the solution for targets of unit variance.
    """
    if columns.shape[1] == 0:
        return np.zeros(0), np.zeros((len(columns), 0)), np.zeros((0, 0))
    scale = _norms(columns)
    # QR first: the singular values of a small triangle cost next to nothing
    q, r = scipy.linalg.qr(columns / scale, mode="economic", overwrite_a=True, check_finite=False)
    left, strength, right = svd(r)
    keep = strength > RANK_TOLERANCE * max(float(strength[0]), 1e-300)
    basis = q @ left[:, keep]
    factor = (right[keep].T / strength[keep]) / scale[:, None]
    return factor @ (basis.T @ target), basis, factor


def least_squares(columns: FloatArray, target: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The solution of `solve` alone, at half the price, and what makes the next one cheaper still.

    Returns:
        (p,) solution, and (p, r) frame: `columns @ frame` is orthonormal.
    """
    width = columns.shape[1]
    if width == 0:
        return np.zeros(0), np.zeros((0, 0))
    scale = _norms(columns)
    both = np.empty((len(columns), width + 1), order="F")
    np.divide(columns, scale, out=both[:, :width])
    both[:, width] = target
    # with the target as one more column, what the basis would be needed for is in the triangle
    r = scipy.linalg.qr(both, mode="raw", overwrite_a=True, check_finite=False)[1]
    left, strength, right = svd(r[:width, :width])
    keep = strength > RANK_TOLERANCE * max(float(strength[0]), 1e-300)
    frame = right[keep].T / strength[keep] / scale[:, None]
    return frame @ (left[:, keep].T @ r[:width, width]), frame


def least_squares_near(frame: FloatArray, columns: FloatArray, target: FloatArray) -> FloatArray:
    """(p,) solution for columns (M, p) that differ a little from those that the frame (p, r) makes orthonormal."""
    made = columns @ frame
    triangle = _triangle(made)
    if triangle is None:
        return least_squares(columns, target)[0]
    found: FloatArray = frame @ scipy.linalg.cho_solve((triangle, True), made.T @ target, check_finite=False)
    return found


def solve_near(frame: FloatArray, columns: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Basis and factor, as from `solve`, of columns (M, p) near those that the frame (p, r) makes orthonormal."""
    made = columns @ frame
    triangle = _triangle(made)
    if triangle is None:
        return solve(columns, np.zeros(len(columns)))[1:]
    basis, factor = (
        scipy.linalg.solve_triangular(triangle, part.T, lower=True, check_finite=False).T for part in (made, frame)
    )
    return basis, factor


def _triangle(made: FloatArray) -> FloatArray | None:
    """(r, r) lower triangle L with L L' the products of columns (M, r), None where these are far from orthonormal."""
    try:
        triangle: FloatArray = np.linalg.cholesky(made.T @ made).astype(np.float64, copy=False)
    except np.linalg.LinAlgError:
        return None
    lengths = np.diagonal(triangle)
    return triangle if lengths.size == 0 or lengths.min() > NEARLY_ORTHONORMAL * lengths.max() else None


def span(columns: FloatArray) -> FloatArray:
    """(M, r) orthonormal basis of columns (M, p) that may depend on each other."""
    if columns.shape[1] == 0:
        return np.zeros((len(columns), 0))
    scaled = columns / _norms(columns)
    made = _by_products(scaled)
    if made is not None:
        return made
    basis: FloatArray
    basis, r = scipy.linalg.qr(scaled, mode="economic", overwrite_a=True, check_finite=False)
    if columns.shape[1] < len(columns) and scipy.linalg.lapack.dtrcon(r)[0] > FAR_FROM_SINGULAR:
        return basis
    # pivots of the small triangle tell the rank as well as its singular values, at a tenth of the price
    turned, r, _ = scipy.linalg.qr(r, mode="economic", pivoting=True, overwrite_a=True, check_finite=False)
    lengths = np.abs(np.diagonal(r))
    return np.asarray(basis @ turned[:, lengths > RANK_TOLERANCE * max(float(lengths[0]), 1e-300)], dtype=np.float64)


def _by_products(scaled: FloatArray) -> FloatArray | None:
    """(M, p) orthonormal basis of normalised columns from their products: half the price of their factorisation.

    The error grows with the square of the condition number; None where that is not small.
    """
    if scaled.shape[1] > len(scaled):
        return None
    triangle, failed = scipy.linalg.lapack.dpotrf(scaled.T @ scaled, lower=1)
    if failed or scipy.linalg.lapack.dtrcon(triangle, uplo="L")[0] < FAR_FROM_LOSS:
        return None
    return np.asarray(scipy.linalg.solve_triangular(triangle, scaled.T, lower=True, check_finite=False).T)


def _norms(columns: FloatArray) -> FloatArray:
    """(p,) lengths of columns, one where there is nothing."""
    norms = np.linalg.norm(columns, axis=0)
    return np.where(norms > 1e-300, norms, 1.0)


def whiten(whitener: ComplexArray, values: ComplexArray) -> FloatArray:
    """(M, ...) whitened real numbers from coefficients (H + 1, E) or (H + 1, E, p).

    The whitener is (H + 1, E, E), or those of its columns that belong to the equations of the coefficients.
    """
    if values.ndim == 2:
        return stacked(np.matmul(whitener, values[:, :, None])[:, :, 0])
    return stacked(np.matmul(whitener, values))


def off(basis: FloatArray, columns: FloatArray) -> FloatArray:
    """Columns without their part in the span of an orthonormal basis."""
    left: FloatArray = columns - basis @ (basis.T @ columns)
    return left
