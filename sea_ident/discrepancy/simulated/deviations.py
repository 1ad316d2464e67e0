"""Power of what deviations have in common, and of their noise."""

import numpy as np

from sea_ident._typing import FloatArray


def common_power(deviations: FloatArray) -> FloatArray:
    """(n,) mean square of what k deviations (k, N, n) with independent noise have in common; may come out negative."""
    count, samples = deviations.shape[:2]
    total = np.sum(deviations.sum(axis=0) ** 2, axis=0) - np.sum(deviations**2, axis=(0, 1))
    return np.asarray(total / (count * (count - 1) * samples), dtype=np.float64)


def noise_power(deviations: FloatArray) -> FloatArray:
    """(n,) mean square of the noise of the mean of k deviations (k, N, n)."""
    return np.asarray(np.mean(np.var(deviations, axis=0, ddof=1), axis=0) / len(deviations), dtype=np.float64)


def spread_of_power(periods: FloatArray) -> FloatArray:
    """(n,) standard deviation of `common_power` where k periods (k, N, n) have nothing but noise.

    The noise of every period may as well have the opposite sign, independently: that gives the variance.
    """
    count, samples = periods.shape[:2]
    noise = (periods - periods.mean(axis=0)) * np.sqrt(count / (count - 1.0))
    products = np.einsum("ptj,qtj->jpq", noise, noise) / samples
    squares = np.sum(products**2, axis=(1, 2)) - np.sum(np.diagonal(products, axis1=1, axis2=2) ** 2, axis=1)
    return np.asarray(np.sqrt(2.0 * squares) / (count * (count - 1)), dtype=np.float64)
