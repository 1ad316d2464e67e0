"""Weights per sample: scatter between periods, and what the model lacks."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import isotonic_regression

from sea_ident._typing import FloatArray
from sea_ident.effects.coulomb_friction import CoulombFriction
from sea_ident.estimation.observations import Observations, stands
from sea_ident.estimation.solve import Solution, solve_weighted
from sea_ident.processing.variance import smooth_over_phase

VARIANCE_FLOOR = 1e-6
"""Smallest variance of a sample as a share of the mean variance of its joint."""

ROUNDS = 5
"""Rounds in which the rest of the residual is found."""

FEWEST_PERIODS = 2
"""Periods from which on there is a scatter that may rise. Of few it is known badly, and chance leaves out a sample more
or less at low speed; but all of them would leave the bias in, which is as large as it is for many."""

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
        solution: weighted least squares with them.
        notes: what adds to the scatter.
        warnings: what a user should know.
    """

    weights: FloatArray
    variance: FloatArray
    solution: Solution
    notes: tuple[str, ...]
    warnings: tuple[str, ...]


def sample_weights(observations: Observations, smoothing: float, share: FloatArray | None = None) -> SampleWeights:
    """Weights from the variance of every sample (paper, eq. 20), smoothed over phase.

    The scatter says nothing of what the model lacks. Where the residual is larger than the scatter of the mean, the
    rest is added to the variance of every sample of that joint.

    Args:
        observations: the data.
        smoothing: width of the window [s].
        share: (N, n) how much of a sample counts, from 0 to 1; all of it where None. Samples at which the friction
            model does not claim to hold count nothing in any case.

    Returns:
        The weights.

    Raises:
        IdentificationError: the data do not determine the parameters.
    """
    processed = observations.processed
    variance = processed.raw_tau_variance
    if processed.periods > 1:
        variance = smooth_over_phase(variance, processed.interval, smoothing)
    variance, warnings = floored(variance / processed.periods, processed.joint_names)
    rows, torque = observations.rows, observations.torque
    valid = observations.valid * (1.0 if share is None else share)
    count = np.maximum(valid.sum(axis=0) - rows.shape[-1] / rows.shape[1], 1.0)
    noise = (variance * valid).sum(axis=0) / np.maximum(valid.sum(axis=0), 1.0)
    rest = np.zeros(rows.shape[1])
    # what holds a motor that stands is one error all along, not another one in every sample
    errors = np.where(stands(observations.robot, processed), len(torque), 1)
    for _ in range(ROUNDS):
        weights = valid / (variance + rest)
        solution = solve_weighted(rows, torque, weights)
        residual = torque - rows @ solution.values
        excess = errors * ((residual**2 * valid).sum(axis=0) / count - noise)
        before, rest = rest, np.where(excess > LEAST_REST * noise, excess, 0.0)
        if np.allclose(rest, before, rtol=1e-2):
            break
    notes = tuple(
        f"{name}: {(r / e) ** 0.5:.3g} of the residual is beyond the scatter between periods and adds to the weighting"
        for name, r, e in zip(observations.robot.joint_names, rest, errors, strict=True)
        if r > 0.0 and processed.periods > 1
    )
    return SampleWeights(weights, variance + rest, solution, notes, warnings)


def steady(observations: Observations) -> FloatArray:
    """(N, n) how much a sample counts: little at speeds so low that friction varies from pass to pass.

    Where the torque scatters more near reversal than at speed, friction there is not the same at every pass. Its mean
    is then not that of the model either: at a pass with more friction the joint is slower at the same instant, so the
    scatter is not averaged out. Weights by the variance alone are small but not small enough for that bias. A limit in
    speed, found from the same scatter, would fall elsewhere in the next recording and move the friction with it, which
    no spread between periods shows; so the share falls smoothly as the scatter rises. With one period, or where no
    scatter rises, all of every sample counts.

    Args:
        observations: the data.

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
        level = np.array([np.median(processed.raw_tau_variance[part, j]) for part in bins])
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
