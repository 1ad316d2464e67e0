"""Covariance of the estimate from what the data show, not from what was assumed about the noise."""

from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise

import numpy as np
from scipy import stats

from sea_ident._typing import FloatArray
from sea_ident.estimation.estimators import Estimate
from sea_ident.estimation.observations import Observations, stands
from sea_ident.estimation.period_scores import period_scores
from sea_ident.estimation.turning import turning_covariance
from sea_ident.plain import plain

FEWEST_BLOCKS = 20
"""Smallest number of pieces of a period from which a covariance is estimated."""

FEW_PERIODS = 6
"""Below this number of periods the spread of whole periods says too little about a variance."""

BLOCK = 1.0
"""Length of the pieces into which few periods are cut [s]."""

DRIFT = 0.95
"""Probability with which chance keeps the difference of whole periods below what counts as drift."""

MISFIT = 1.5
"""Energy of the mean residual over that of its noise from which on the model is said to lack something."""


class CovarianceKind(StrEnum):
    """Where a covariance comes from."""

    PERIODS = "spread between periods"
    BLOCKS = "spread between periods, piece by piece"
    RESIDUAL = "correlated residual"
    REMAINDER = "spread between periods and correlated residual"
    UPDATED = "new data and an earlier model"
    MODEL = "model of white torque noise"


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """Covariance of the base parameters.

    Attributes:
        covariance: (b, b).
        degrees_of_freedom: of the variances, for Student's quantiles; infinite where they are taken as known.
        kind: where it comes from.
        influences: (P, b) influence of every period on the estimate, its sum zero; empty where there are no periods.
        repeatability: (b, b) part of the covariance that is seen when the experiment is repeated.
        warnings: disagreement with the model-based covariance and the like.
    """

    covariance: FloatArray
    degrees_of_freedom: float
    kind: CovarianceKind
    influences: FloatArray
    repeatability: FloatArray
    warnings: tuple[str, ...] = ()

    @property
    def std(self) -> FloatArray:
        """(b,) standard deviations."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))

    def half_width(self, level: float = 0.95) -> FloatArray:
        """(b,) half width of the intervals that cover the truth with this probability."""
        return student_factor(self.degrees_of_freedom, level) * self.std


def student_factor(degrees_of_freedom: float, level: float) -> float:
    """How many standard deviations an interval of this probability reaches to each side."""
    if not np.isfinite(degrees_of_freedom):
        return float(stats.norm.ppf(0.5 + level / 2.0))
    return float(stats.t.ppf(0.5 + level / 2.0, degrees_of_freedom))


def honest_uncertainty(observations: Observations, estimate: Estimate) -> Uncertainty:
    """Covariance from the spread between periods; without periods, from the correlation of the residual.

    The estimate solves ``Z' (torque - F values) = 0``, so period p moves it by ``(Z' F)^-1 Z' r_p / P``, with r_p the
    residual of that period at its own motion: noise of encoders and torque, coloured or not, and what the
    controller makes of both, are all inside. Whole periods are taken as independent; nothing is assumed within one.
    What the mean residual is beyond that, and how friction may turn over, comes on top.

    Args:
        observations: the data.
        estimate: what was estimated from them.

    Returns:
        The covariance, with the degrees of freedom of its variances.

    References:
        Liang, Zeger, Longitudinal data analysis using generalized linear models, Biometrika, 1986.
    """
    if observations.periods < 2:
        covariance = _from_residual(observations, estimate)
        text = (
            "one stretch of data only: standard deviations rest on the correlation of the residual, which cannot tell "
            "noise from model error"
        )
        none = np.zeros((0, len(estimate.values)))
        return Uncertainty(covariance, np.inf, CovarianceKind.RESIDUAL, none, covariance, (text,))
    residuals = observations.period_residuals(estimate.values, estimate.period_torque)
    residuals -= residuals.mean(axis=0)
    periods = len(residuals)
    drifted: tuple[str, ...] = ()
    scores = period_scores(residuals, estimate.instruments, observations.processed.places)
    influences = scores @ estimate.inverse.T / periods
    if periods >= FEW_PERIODS:
        covariance = influences.T @ influences * (periods / (periods - 1.0))
        kind, freedom = CovarianceKind.PERIODS, periods - 1.0
    else:
        covariance, freedom, drifted = _with_drift(*_from_blocks(observations, estimate, residuals), influences)
        kind = CovarianceKind.BLOCKS
    found = (*drifted, *_disagreement(observations, estimate, covariance))
    mean = observations.residual(estimate.values)
    if estimate.period_torque is not None:
        mean = mean + estimate.period_torque.mean(axis=0) - observations.torque
    if estimate.band is not None:
        mean = estimate.band.part_of(mean)
        residuals = np.stack([estimate.band.part_of(own) for own in residuals])
    misfit, text = _misfit(observations, estimate, mean, residuals)
    if text:
        kind, found = CovarianceKind.REMAINDER, (*found, text)
    rest = misfit + turning_covariance(observations, estimate, mean, residuals)
    rest += _standing_covariance(observations, estimate, mean)
    return Uncertainty(covariance + rest, freedom, kind, influences, covariance, found)


def _standing_covariance(observations: Observations, estimate: Estimate, mean: FloatArray) -> FloatArray:
    """(b, b) part of the covariance by the torque with which friction holds a motor that stands.

    It is anything up to that of breakaway, and may go along with the very torque of a parameter: as large as what it
    leaves in the residual (N, n), and the same in all samples.
    """
    covariance = np.zeros((len(estimate.values),) * 2)
    for i in np.flatnonzero(stands(observations.robot, observations.processed)):
        moves = estimate.instruments[:, i] @ estimate.inverse.T
        covariance += float(np.sum(mean[:, i] ** 2)) * moves.T @ moves
    return covariance


def _misfit(
    observations: Observations, estimate: Estimate, mean: FloatArray, residuals: FloatArray
) -> tuple[FloatArray, str]:
    """Covariance from the part of the mean residual that repeats in every period, so is no noise.

    It is treated as a random error with the correlation that the residual shows along the period: that is what an
    interval can say of a model error that nobody has named. Only what moves the estimate counts. So does what is too
    little to be sure of: where it gathers in a few parameters, a tenth of the noise is much for them.

    Args:
        observations: the data.
        estimate: what was estimated from them.
        mean: (N, n) residual of the mean, within the band of the estimate.
        residuals: (P, N, n) those of the periods, their mean taken off.

    Returns:
        (b, b) covariance, and in words what lacks; empty where no more is left than may be noise.
    """
    periods = len(residuals)
    noise = (residuals**2).sum(axis=0) / (periods * (periods - 1.0))
    noise_energy, energy = (estimate.weights * noise).sum(axis=0), (estimate.weights * mean**2).sum(axis=0)
    ratio = energy / np.maximum(noise_energy, 1e-300)
    if noise_energy.max() <= 0.0:
        return np.zeros((len(estimate.values),) * 2), ""
    covariance = _scores(observations, estimate, mean * np.sqrt(1.0 - 1.0 / np.maximum(ratio, 1.0)))
    large = ratio > MISFIT
    if not np.any(large):
        return covariance, ""
    names = observations.robot.joint_names
    parts = ", ".join(f"{names[i]} {plain(ratio[i] ** 0.5)} times" for i in np.flatnonzero(large))
    steps = observations.processed.encoder_steps
    if steps is not None and np.all(steps.joints[large]):
        cause = (
            "the steps of these encoders, which repeat in every period, may be all of it, or the model lacks something"
        )
    else:
        cause = "the model lacks something"
    text = (
        f"the residual of the mean is larger than its noise ({parts}): {cause}. Standard deviations count this as "
        "random; diagnose tells what it is"
    )
    return covariance, text


def _disagreement(observations: Observations, estimate: Estimate, covariance: FloatArray) -> tuple[str, ...]:
    """A warning where the model-based standard deviations are far from what the periods show."""
    assumed = np.sqrt(np.diag(estimate.covariance))
    seen = np.sqrt(np.diag(covariance))
    ratio = np.median(seen / np.maximum(assumed, 1e-300))
    if 0.5 <= ratio <= 2.0:
        return ()
    names = observations.base.names
    worst = int(np.argmax(np.abs(np.log(np.maximum(seen, 1e-300) / np.maximum(assumed, 1e-300)))))
    return (
        f"standard deviations from the spread between periods are {plain(ratio)} times those of white torque noise "
        f"(eq. 13), at worst {plain(seen[worst] / max(assumed[worst], 1e-300))} times for {names[worst]}: the noise is "
        "not what eq. 13 assumes; the spread between periods is reported",
    )


def _block_count(observations: Observations) -> int:
    samples = observations.processed.samples
    count = max(samples * observations.processed.interval / BLOCK, FEWEST_BLOCKS)
    return int(np.clip(count, 1, max(samples // 4, 1)))


def _from_blocks(observations: Observations, estimate: Estimate, residuals: FloatArray) -> tuple[FloatArray, float]:
    """Few periods: pieces of about a second, each against the same piece of the other periods, neighbours together."""
    periods, samples = residuals.shape[:2]
    edges = np.linspace(0, samples, _block_count(observations) + 1).astype(int)
    parts = np.stack(
        [np.einsum("pkn,knb->pb", residuals[:, a:b], estimate.instruments[a:b]) for a, b in pairwise(edges)],
        axis=1,
    )
    parts = parts @ estimate.inverse.T / periods
    factor = periods / (periods - 1.0)
    own = np.einsum("pkb,pkc->bc", parts, parts)
    if parts.shape[1] > 2:
        neighbour = np.einsum("pkb,pkc->bc", parts, np.roll(parts, -1, axis=1))
        covariance = own + 0.5 * (neighbour + neighbour.T)
    else:
        covariance = own
    # where neighbours happen to be opposed more than they can be, they are left out
    covariance = np.where(np.diag(covariance).min() > 0.25 * np.diag(own).min(), covariance, own) * factor
    energy = np.einsum("pkb,pkb->kb", parts, parts)
    share = float(np.median(energy.sum(axis=0) ** 2 / np.maximum((energy**2).sum(axis=0), 1e-300)))
    return covariance, max((periods - 1.0) * share / 1.5, 1.0)


def _with_drift(
    covariance: FloatArray, freedom: float, influences: FloatArray
) -> tuple[FloatArray, float, tuple[str, ...]]:
    """Few periods that differ as a whole by more than their pieces say: what drifts counts, too.

    Args:
        covariance: (b, b) from pieces of the periods.
        freedom: of its variances.
        influences: (P, b) of whole periods.

    Returns:
        Covariance, degrees of freedom, and a warning where they differ more than chance would have it.
    """
    periods = len(influences)
    own = np.diag(covariance)
    if np.any(own <= 0.0):
        return covariance, freedom, ()
    ratio = float(np.mean((influences**2).sum(axis=0) / own)) * periods / (periods - 1.0)
    correlation = covariance / np.sqrt(np.outer(own, own))
    independent = (periods - 1.0) * len(own) ** 2 / float(np.sum(correlation**2))
    if ratio <= stats.chi2.ppf(DRIFT, independent) / independent:
        return covariance, freedom, ()
    text = (
        f"whole periods differ by {plain(ratio**0.5)} times what the scatter within them explains: something drifts "
        "from period to period. Standard deviations count it; record more periods"
    )
    return ratio * covariance, min(freedom, independent), (text,)


def _from_residual(observations: Observations, estimate: Estimate) -> FloatArray:
    """Without periods: the residual takes the place of the noise, at least as large as white noise would be."""
    covariance = _scores(observations, estimate, observations.residual(estimate.values))
    low = np.diag(covariance) < np.diag(estimate.covariance)
    if np.any(low):
        if np.any(np.diag(covariance) <= 0.0):
            return estimate.covariance
        scale = np.where(low, np.sqrt(np.diag(estimate.covariance) / np.diag(covariance)), 1.0)
        covariance = covariance * np.outer(scale, scale)
    return np.asarray(covariance, dtype=np.float64)


def _scores(observations: Observations, estimate: Estimate, residual: FloatArray) -> FloatArray:
    """(b, b) covariance from the scores of a residual (N, n) summed over pieces, with Bartlett weights between them."""
    samples = len(residual)
    edges = np.linspace(0, samples, _block_count(observations) + 1).astype(int)
    scores = np.stack([np.einsum("kn,knb->b", residual[a:b], estimate.instruments[a:b]) for a, b in pairwise(edges)])
    return bartlett(scores @ estimate.inverse.T, residual.shape[1])


def bartlett(scores: FloatArray, joints: int) -> FloatArray:
    """Covariance of a sum of terms that are correlated with their neighbours.

    Args:
        scores: (blocks, b) terms in their order.
        joints: n; every block has lost b / n degrees of freedom to the fit.

    Returns:
        (b, b) covariance, with Bartlett's weights for two neighbours on each side.
    """
    own = scores.T @ scores
    covariance = own.copy()
    for lag, weight in ((1, 2.0 / 3.0), (2, 1.0 / 3.0)):
        if len(scores) > 3 * lag:
            product = scores[lag:].T @ scores[:-lag]
            covariance = covariance + weight * (product + product.T)
    if np.any(np.diag(covariance) < 0.25 * np.diag(own)):
        covariance = own
    freedom = max(len(scores) - scores.shape[1] / max(joints, 1), 1.0)
    return np.asarray(covariance * (len(scores) / freedom), dtype=np.float64)
