"""Quadratic programs by ProxQP."""

import numpy as np
from proxsuite import proxqp

from sea_ident._typing import FloatArray


def solve_quadratic(
    hessian: FloatArray,
    linear: FloatArray,
    rows: FloatArray,
    lower: FloatArray,
    upper: FloatArray,
    start: tuple[FloatArray, FloatArray] | None = None,
    *,
    accuracy: float = 1e-8,
) -> tuple[FloatArray, FloatArray]:
    """Minimise 1/2 x' H x + g' x with lower <= rows x <= upper.

    Args:
        hessian: (v, v) H, positive definite.
        linear: (v,) g.
        rows: (R, v).
        lower: (R,).
        upper: (R,).
        start: x and multipliers to begin with.
        accuracy: of the constraints, in the units of the scaled rows.

    Returns:
        (v,) solution and (R,) multipliers.
    """
    # variables in units of one unit of curvature, rows of unit length: ProxQP's accuracy is absolute
    scale = 1.0 / np.sqrt(np.diag(hessian))
    scaled_rows = rows * scale
    length = np.linalg.norm(scaled_rows, axis=1)
    length = np.where(length > 0.0, length, 1.0)
    size = max(float(np.abs(linear * scale).max()), 1e-12)
    v, count = len(linear), len(rows)
    solver = proxqp.dense.QP(
        v, 0, count, False, proxqp.dense.HessianType.Dense,
        proxqp.dense.DenseBackend.PrimalDualLDLT if count < 8 * v else proxqp.dense.DenseBackend.PrimalLDLT,
    )  # fmt: skip
    solver.settings.eps_abs = accuracy
    solver.settings.eps_rel = 0.0
    solver.settings.max_iter = 500
    # the problem is divided by `size` in objective and variables alike: gradients of order one
    solver.init(
        hessian * np.outer(scale, scale),
        linear * scale / size,
        None,
        None,
        scaled_rows / length[:, None],
        np.maximum(lower / length, -1e20 * size) / size,
        np.minimum(upper / length, 1e20 * size) / size,
    )
    if start is None:
        solver.solve()
    else:
        solver.settings.initial_guess = proxqp.InitialGuess.WARM_START
        solver.solve(start[0] / scale / size, None, start[1] * length / size)
    result = solver.results
    return np.array(result.x) * scale * size, np.array(result.z) / length * size
