"""Covariance of the estimate by how friction turns over where a joint reverses, which nobody knows."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects import Effect
from sea_ident.estimation.estimators import Estimate
from sea_ident.estimation.observations import Observations
from sea_ident.estimation.period_scores import period_scores
from sea_ident.regressor import build_total

OTHERWISE = 2.0
"""Factor by which the speed at which friction turns over may well be another one [-]."""


def turning_covariance(
    observations: Observations, estimate: Estimate, mean: FloatArray, residuals: FloatArray
) -> FloatArray:
    """(b, b) part of the covariance of the base parameters by the speeds at which friction turns over.

    These are held. That each is larger or smaller by a factor of two is one more parameter, about zero with a standard
    deviation of one, and known better where the data tell: a change of the torque that moves the estimate one way, and
    leaves the rest of it in the residual.

    Args:
        observations: the data.
        estimate: what was estimated from them.
        mean: (N, n) residual of the mean, within the band of the estimate.
        residuals: (P, N, n) those of the periods, their mean taken off.
    """
    count, periods = len(estimate.values), len(residuals)
    covariance = np.zeros((count, count))
    for torque in _turned(observations, estimate.values):
        moves = estimate.inverse @ np.einsum("knb,kn->b", estimate.instruments, torque)
        left = torque - observations.rows @ moves
        left = left if estimate.band is None else estimate.band.part_of(left)
        weighted = estimate.weights * left
        energy = float(np.sum(weighted * left))
        if not energy > 0.0:
            continue
        scores = period_scores(residuals, weighted[:, :, None], observations.processed.places)
        variance = float(np.sum((scores / energy) ** 2)) / (periods * (periods - 1.0))
        amount = float(np.sum(weighted * mean)) / energy / (1.0 + variance)
        covariance += np.outer(moves, moves) * (amount**2 + variance / (1.0 + variance))
    return covariance


def _turned(observations: Observations, values: FloatArray) -> Iterator[FloatArray]:
    """(N, n) change of the torque of every friction that turns over at twice the speed that it is modelled with.

    Halved and taken both ways, for the change with the logarithm of the speed is no line.
    """
    robot, processed = observations.robot, observations.processed
    place = {name: k for k, name in enumerate(observations.base.names)}
    for effect in observations.effects:
        own = [place.get(column.name) for column in effect.columns(robot)]
        if "smoothing" not in {shape.name for shape in effect.shapes} or None in own:
            continue
        amounts = np.array([values[k] for k in own if k is not None])
        fast, slow = (
            build_total(robot, (_at(effect, factor),), processed.motion, processed.channels) @ amounts
            for factor in (OTHERWISE, 1.0 / OTHERWISE)
        )
        yield 0.5 * (fast - slow)


def _at(effect: Effect, factor: float) -> Effect:
    """A friction that turns over at another speed."""
    return replace(effect, smoothing=factor * effect.smoothing)  # type: ignore[attr-defined, call-arg]
