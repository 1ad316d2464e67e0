"""Lack of fit: is there more in the mean residual than noise leaves?"""

import numpy as np
from scipy import stats

from sea_ident.discrepancy.bench import Bench
from sea_ident.discrepancy.gap import excess_power
from sea_ident.discrepancy.search import Settled, flat_periods

FEWEST_STEPS = 4
"""Pairs of steps between periods from which on the spread of their energy is estimated."""


def lack_of_fit(bench: Bench, settled: Settled) -> tuple[float, int, float]:
    """Test a fit against the noise alone.

    The ratio of the statistic and its degrees of freedom is one for a model that is right. How far from one it may
    be depends on how the noise is spread: friction that differs from pass to pass fills a few directions only, and
    chi-square with all degrees of freedom would reject too often. The number of directions is the squared trace of the
    noise covariance over the trace of its square (Satterthwaite); the second follows from products of different steps
    between periods, which share no noise (as in Chen and Qin, Annals of Statistics 38, 2010).

    Args:
        bench: the recording.
        settled: the model and its noise floor.

    Returns:
        Statistic, its degrees of freedom, and the probability of as much by noise.
    """
    statistic, dof = settled.fit.statistic, settled.fit.dof
    periods = flat_periods(bench, settled)
    basis = settled.fit.basis
    periods = periods - (periods @ basis) @ basis.T
    steps = np.diff(periods, axis=0) / np.sqrt(2.0)
    gram = steps @ steps.T
    apart = gram[np.triu_indices(len(steps), 2)]
    directions = float(dof)
    if len(apart) >= FEWEST_STEPS:
        directions = min(float(np.mean(np.diag(gram)) ** 2 / max(np.mean(apart**2), 1e-300)), directions)
    count = bench.data.periods
    each = 2.0 * (count - 1) ** 2 / (3.0 * count - 4.0) if count > 2 else 1.0
    return statistic, dof, float(stats.f.sf(statistic / max(dof, 1), directions, directions * each))


def remainder_share(bench: Bench, settled: Settled) -> float:
    """Rms of what a fit leaves beyond noise, as a share of the rms torque there: the largest of all."""
    excess = np.sqrt(excess_power(bench, settled.fit, settled.noise))
    return float(np.max(excess / np.maximum(bench.torque_rms, 1e-300)))
