"""Linear algebra of whitened columns."""

import numpy as np
import scipy.linalg

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.noise import ComplexArray, stacked

RANK_TOLERANCE = 1e-9
"""Singular directions of the normalised columns below this share of the largest are left out."""


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
    norms = np.linalg.norm(columns, axis=0)
    scale = np.where(norms > 1e-300, norms, 1.0)
    # QR first: the singular values of a small triangle cost next to nothing
    q, r = scipy.linalg.qr(columns / scale, mode="economic", check_finite=False)
    left, strength, right = np.linalg.svd(r)
    keep = strength > RANK_TOLERANCE * max(float(strength[0]), 1e-300)
    basis = q @ left[:, : len(strength)][:, keep]
    factor = (right[: len(strength)][keep].T / strength[keep]) / scale[:, None]
    return factor @ (basis.T @ target), basis, factor


def whiten(whitener: ComplexArray, values: ComplexArray) -> FloatArray:
    """(M, ...) whitened real numbers from coefficients (H + 1, E) or (H + 1, E, p)."""
    if values.ndim == 2:
        return stacked(np.matmul(whitener, values[:, :, None])[:, :, 0])
    return stacked(np.matmul(whitener, values))


def off(basis: FloatArray, columns: FloatArray) -> FloatArray:
    """Columns without their part in the span of an orthonormal basis."""
    left: FloatArray = columns - basis @ (basis.T @ columns)
    return left
