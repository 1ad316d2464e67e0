"""Scatter of the torque between periods (paper, eq. 20)."""

import numpy as np

from sea_ident._typing import FloatArray


def sample_variance(stack: FloatArray) -> FloatArray:
    """(N, n) unbiased variance over P >= 2 periods of (P, N, n) torques (paper, eq. 20)."""
    return np.asarray(stack.var(axis=0, ddof=1), dtype=np.float64)


def smooth_over_phase(variance: FloatArray, interval: float, width: float) -> FloatArray:
    """Circular moving average, as a period follows the one before.

    Args:
        variance: (N, n).
        interval: time between samples [s].
        width: of the window [s]; below two intervals nothing is smoothed.

    Returns:
        (N, n) smoothed variance.
    """
    samples = len(variance)
    count = min(round(width / interval), samples)
    if count < 2:
        return variance.copy()
    count += 1 - count % 2
    half = count // 2
    padded = np.concatenate([variance[samples - half :], variance, variance[:half]])
    total = np.concatenate([np.zeros((1, variance.shape[1])), np.cumsum(padded, axis=0)])
    return np.asarray(np.maximum((total[count:] - total[:-count])[:samples] / count, 0.0), dtype=np.float64)


def noise_from_curvature(values: FloatArray) -> FloatArray:
    """(n,) variance of the fast part of signals (N, n), robust against what changes slowly.

    From second differences, whose variance is six times that of white noise; by the median, so that steps do not count.
    """
    if len(values) < 3:
        return np.zeros(values.shape[1])
    second = np.abs(np.diff(values, 2, axis=0))
    deviation = np.median(second, axis=0) / 0.6744897501960817
    return np.asarray(deviation**2 / 6.0, dtype=np.float64)
