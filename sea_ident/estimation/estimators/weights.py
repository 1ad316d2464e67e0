"""Weights per sample: scatter between periods, and what the model lacks."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import isotonic_regression

from sea_ident._typing import FloatArray
from sea_ident.effects.coulomb_friction import CoulombFriction
from sea_ident.estimation.observations import Observations
from sea_ident.estimation.solve import Solution, solve_weighted
from sea_ident.processing import ProcessedRecording
from sea_ident.processing.variance import smooth_over_phase

Share = Callable[[Observations, FloatArray], FloatArray]
"""From observations and the variance of the torque between periods (N, n) to how much every sample counts (N, n)."""

VARIANCE_FLOOR = 1e-6
"""Smallest variance of a sample as a share of the mean variance of its joint."""

ROUNDS = 5
"""Rounds in which the rest of the residual is found."""

FEWEST_PERIODS = 6
"""Periods from which on the scatter is known well enough to tell where it rises."""

SPEED_BINS = 40
"""Classes of speed in which the scatter is compared."""

RISE = 0.1
"""Rise of the variance over that at speed at which friction is taken to vary from pass to pass."""

LEAST_SHARE = 1e-3
"""Samples that would count less than this do not count."""

LEAST_REST = 0.2
"""A rest below this share of the noise variance is chance."""


@dataclass(frozen=True, eq=False)
class SampleWeights:
    """Weights, and the weighted least-squares solution that they give.

    Attributes:
        weights: (N, n) inverse variances of the mean torque, less where the model claims less, 0 where nothing.
        variance: (N, n) variance of the mean torque and what the model lacks [(N m)^2].
        rest: (n,) what the model lacks, in the variance of every sample of a joint [(N m)^2].
        solution: weighted least squares with them.
        notes: what adds to the scatter.
        warnings: what a user should know.
    """

    weights: FloatArray
    variance: FloatArray
    rest: FloatArray
    solution: Solution
    notes: tuple[str, ...]
    warnings: tuple[str, ...]


def sample_weights(observations: Observations, smoothing: float, share: Share) -> SampleWeights:
    """Weights from the variance of every sample (paper, eq. 20), smoothed over phase.

    The scatter says nothing of what the model lacks. Where the residual is larger than the scatter of the mean, the
    rest is added to the variance of every sample of that joint.

    Args:
        observations: the data.
        smoothing: width of the window [s].
        share: how much of a sample counts, from 0 to 1, `steady` or `all_alike`. Samples at which the friction model
            does not claim to hold count nothing in any case.

    Returns:
        The weights.

    Raises:
        IdentificationError: the data do not determine the parameters.
    """
    processed = observations.processed
    variance, warnings = _mean_variance(processed, processed.raw_tau_variance, smoothing)
    rows, torque = observations.rows, observations.torque
    valid = observations.valid * share(observations, processed.raw_tau_variance)
    count = np.maximum(valid.sum(axis=0) - rows.shape[-1] / rows.shape[1], 1.0)
    noise = (variance * valid).sum(axis=0) / np.maximum(valid.sum(axis=0), 1.0)
    rest = np.zeros(rows.shape[1])
    for _ in range(ROUNDS):
        weights = valid / (variance + rest)
        solution = solve_weighted(rows, torque, weights)
        residual = torque - rows @ solution.values
        excess = (residual**2 * valid).sum(axis=0) / count - noise
        before, rest = rest, np.where(excess > LEAST_REST * noise, excess, 0.0)
        if np.allclose(rest, before, rtol=1e-2):
            break
    notes = tuple(
        f"{name}: {r**0.5:.3g} of the residual is beyond the scatter between periods and adds to the weighting"
        for name, r in zip(observations.robot.joint_names, rest, strict=True)
        if r > 0.0 and processed.periods > 1
    )
    return SampleWeights(weights, variance + rest, rest, solution, notes, warnings)


def _mean_variance(
    processed: ProcessedRecording, scatter: FloatArray, smoothing: float
) -> tuple[FloatArray, tuple[str, ...]]:
    """(N, n) variance of the mean torque from that of one period (N, n), and warnings."""
    if processed.periods > 1:
        scatter = smooth_over_phase(scatter, processed.interval, smoothing)
    return floored(scatter / processed.periods, processed.joint_names)


def weight_influences(
    observations: Observations,
    found: SampleWeights,
    smoothing: float,
    share: Share,
    residual: FloatArray,
    instruments: FloatArray,
) -> FloatArray:
    """Influence of every period on an estimate through the weights, which were found from the same periods.

    Where the mean residual is larger than chance at samples whose weights are uncertain, as around reversals of a
    friction that varies, other weights would give another estimate. The spread of the residuals between periods does
    not see that. So every period is left out of the scatter in turn.

    Args:
        observations: the data.
        found: the weights.
        smoothing: as they were found with [s].
        share: the same.
        residual: (N, n) residual of the mean torque [N m] or [N].
        instruments: (N, n, b) weighted regressor or instruments.

    Returns:
        (P, b) by how much each period moves ``instruments' residual``, as part of a sum over the periods over P; zero
        with too few periods to leave one out.

    References:
        Efron, The Jackknife, the Bootstrap and Other Resampling Plans, SIAM, 1982.
    """
    processed = observations.processed
    periods = processed.periods
    moves = np.zeros((periods, instruments.shape[-1]))
    if periods < FEWEST_PERIODS:
        return moves
    terms = residual[:, :, None] * instruments
    deviation = processed.period_tau_motor - processed.tau_motor
    inverse = np.divide(1.0, found.weights, out=np.zeros_like(found.weights), where=found.weights > 0.0)
    for p in range(periods):
        # variance of the others: without this period's deviation, and about their own mean
        others = (periods - 1.0) * processed.raw_tau_variance - periods / (periods - 1.0) * deviation[p] ** 2
        scatter = np.maximum(others, 0.0) / (periods - 2.0)
        variance, _ = _mean_variance(processed, scatter, smoothing)
        without = observations.valid * share(observations, scatter) / (variance + found.rest)
        change = np.where(found.weights > 0.0, without * inverse - 1.0, 0.0)
        moves[p] = (1.0 - periods) * np.einsum("kn,knb->b", change, terms)
    return np.asarray(moves - moves.mean(axis=0), dtype=np.float64)


def all_alike(observations: Observations, scatter: FloatArray) -> FloatArray:
    """(N, n) ones: every sample counts as a whole, whatever the scatter."""
    return np.ones_like(scatter)


def steady(observations: Observations, scatter: FloatArray) -> FloatArray:
    """(N, n) how much a sample counts: little at speeds so low that friction varies from pass to pass.

    Where the torque scatters more near reversal than at speed, friction there is not the same at every pass. Its mean
    is then not that of the model either: at a pass with more friction the joint is slower at the same instant, so the
    scatter is not averaged out. Weights by the variance alone are small but not small enough for that bias. A limit in
    speed, found from the same scatter, would fall elsewhere in the next recording and move the friction with it, which
    no spread between periods shows; so the share falls smoothly as the scatter rises. With few periods, or where no
    scatter rises, all of every sample counts.

    Args:
        observations: the data.
        scatter: (N, n) variance of the torque between periods [(N m)^2].

    Returns:
        Share of every sample, from 0 to 1.
    """
    processed = observations.processed
    speed, share = np.abs(processed.motion.dtheta), np.ones(processed.tau_motor.shape)
    if processed.periods < FEWEST_PERIODS:
        return share
    for effect in observations.effects:
        if not isinstance(effect, CoulombFriction):
            continue
        j = observations.robot.index(effect.required_joint)
        order = np.argsort(speed[:, j])
        bins = np.array_split(order, SPEED_BINS)
        # the median, so that a spike does not make its class look like a reversal
        level = np.array([np.median(scatter[part, j]) for part in bins])
        usual = float(np.median(level[SPEED_BINS // 2 :]))
        if usual <= 0.0:
            continue
        # scatter that falls with speed: the best fit of that kind, so that chance in one class does not decide
        falling = isotonic_regression(level, increasing=False).x
        rise = np.maximum(falling / usual - 1.0, 0.0)
        counts = np.exp(-0.5 * (rise / RISE) ** 2)
        counts[SPEED_BINS // 2 :] = 1.0
        for part, count in zip(bins, np.where(counts > LEAST_SHARE, counts, 0.0), strict=True):
            share[part, j] = count
    return share


def floored(variance: FloatArray, names: Sequence[str]) -> tuple[FloatArray, tuple[str, ...]]:
    """Variances that can be divided by: none below a small share of the joint's mean.

    Args:
        variance: (N, n).
        names: (n,) joints.

    Returns:
        (N, n) positive variances, and warnings. A joint without any scatter gets the smallest scatter of the others;
        where there is none at all every sample counts alike.
    """
    mean = variance.mean(axis=0)
    warnings = []
    dead = mean <= 0.0
    if np.all(dead):
        return np.ones_like(variance), ("the torque does not scatter between periods: all samples weigh the same",)
    if np.any(dead):
        which = ", ".join(name for name, no in zip(names, dead, strict=True) if no)
        warnings.append(
            f"the torque of {which} does not scatter between periods: it weighs as that of the quietest other joint. "
            "Is it measured?"
        )
        mean = np.where(dead, mean[~dead].min(), mean)
        variance = np.where(dead, mean, variance)
    zero = np.count_nonzero(variance <= 0.0, axis=0)
    if np.any(zero):
        which = ", ".join(f"{name} {number}" for name, number in zip(names, zero, strict=True) if number)
        warnings.append(
            f"samples of the torque have no scatter between periods ({which} of {len(variance)} in a period): a "
            "measured torque never repeats exactly; is it held or filled in there? They weigh as if their scatter were "
            f"{VARIANCE_FLOOR**0.5:g} of the joint's usual one"
        )
    return np.maximum(variance, VARIANCE_FLOOR * mean), tuple(warnings)
