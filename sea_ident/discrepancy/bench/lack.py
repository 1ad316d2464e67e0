"""Lack of fit: is there more in the mean residual than noise leaves?"""

import numpy as np
from scipy import stats

from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.gap import excess_power, excess_power_of_sums
from sea_ident.discrepancy.bench.judge import flat_steps
from sea_ident.discrepancy.bench.settle import Settled
from sea_ident.discrepancy.measured.noise import closed_directions, closed_freedom_of_many

LACK_LEVEL = 1e-3
"""Probability below which a remainder counts as something that is missing."""


def lack_of_fit(bench: Bench, settled: Settled) -> tuple[float, int, float]:
    """Test a fit against the noise alone.

    The ratio of the statistic and its degrees of freedom is one for a model that is right. How far from one it may
    be depends on how the noise is spread: where it fills a few directions only, chi-square with all degrees of freedom
    would reject too often.

    Args:
        bench: the recording.
        settled: the model and its noise floor.

    Returns:
        Statistic, its degrees of freedom, and the probability of as much by noise; one where nothing is compared.
    """
    statistic, dof = settled.fit.statistic, settled.fit.dof
    if dof <= 0:
        return statistic, 0, 1.0
    steps, basis = flat_steps(bench, settled), settled.fit.basis
    steps = steps - (steps @ basis) @ basis.T  # the samples that are left out are out of them already
    # a floor that is an estimate of its own for every few harmonics spreads the statistic as fewer directions would
    directions = min(closed_directions(steps), float(dof)) * settled.noise.certainty
    freedom = directions * closed_freedom_of_many(len(steps))
    return statistic, dof, float(stats.f.sf(statistic / max(dof, 1), directions, freedom))


def remainder_share(bench: Bench, settled: Settled) -> float:
    """Rms of what a fit leaves beyond noise in an equation or in the sum of those of a joint.

    As a share of the rms torque there: the largest of all.
    """
    alone, together = (power(bench, settled.fit, settled.noise) for power in (excess_power, excess_power_of_sums))
    excess = np.sqrt(np.maximum(alone, together))
    return float(np.max(excess / np.maximum(bench.torque_rms, 1e-300)))
