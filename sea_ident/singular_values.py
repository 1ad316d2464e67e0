"""Singular values by the fast way, and by the sure one where that fails."""

import numpy as np
import scipy.linalg

from sea_ident._typing import FloatArray


def svd(matrix: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Thin singular value decomposition.

    LAPACK's divide and conquer gives up on a finite matrix now and then (one of thousands of triangles with empty
    columns); its QR iteration is slower and does not.

    Args:
        matrix: (m, n).

    Returns:
        (m, k) left singular vectors, (k,) singular values, and (k, n) right singular vectors as rows; k = min(m, n).

    Raises:
        numpy.linalg.LinAlgError: the matrix is not finite.
    """
    try:
        left, strength, right = np.linalg.svd(matrix, full_matrices=False)
    except np.linalg.LinAlgError:
        if not np.all(np.isfinite(matrix)):
            raise
        left, strength, right = scipy.linalg.svd(matrix, full_matrices=False, lapack_driver="gesvd")
    return left, strength, right
