"""Periods that close: means and differences of periods that have no jump where these were cut out of a recording."""

from collections.abc import Sequence

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.motion import Motion

SIGNALS = ("q", "dq", "ddq", "theta", "dtheta", "ddtheta")

FEWEST_TO_CLOSE = 6
"""Periods from which on a part of one is given for a mean that closes."""


def closing_weights(places: Sequence[int], samples: int) -> FloatArray:
    """(N, P) weights of the periods in a mean that closes: each phase adds up to one.

    The plain mean of P periods begins with the begin of the first and ends with the end of the last; what lies between
    them is noise, and where noise is differentiated that jump is seen in all harmonics. So a period that follows none
    is faded in, and one that none follows is faded out: what the mean ends with is then what it begins with. It is as
    noisy as a plain mean of a third of a period less. Of few periods that would be much: fewer than `FEWEST_TO_CLOSE`
    are averaged as they are.

    Args:
        places: (P,) number of every period in the recording, rising.
        samples: N of a period.
    """
    follows = np.diff(np.asarray(places)) == 1
    weights = np.ones((samples, len(places)))
    if np.count_nonzero(follows) >= FEWEST_TO_CLOSE - 1:
        phase = np.arange(samples) / samples
        fade = np.sin(np.pi * phase) ** 2
        weights[:, np.concatenate([[True], ~follows])] *= np.where(phase < 0.5, fade, 1.0)[:, None]
        weights[:, np.concatenate([~follows, [True]])] *= np.where(phase > 0.5, fade, 1.0)[:, None]
    return np.asarray(weights / weights.sum(axis=1, keepdims=True), dtype=np.float64)


def mean_of_periods(motions: Sequence[Motion], tau: FloatArray, places: Sequence[int]) -> tuple[Motion, FloatArray]:
    """Mean motion and torque (N, n) of periods, with the weights of `closing_weights`.

    Args:
        motions: (P,) of the periods.
        tau: (P, N, n) motor torques [N m].
        places: (P,) number of every period in the recording, rising.
    """
    weights = closing_weights(places, tau.shape[1])
    parts = (np.einsum("tp,pti->ti", weights, [getattr(m, name) for m in motions]) for name in SIGNALS)
    return Motion(motions[0].time, *parts), np.asarray(np.einsum("tp,pti->ti", weights, tau), dtype=np.float64)


def successive(values: FloatArray, places: Sequence[int]) -> FloatArray:
    """(N, S, ...) steps between successive periods (N, P, ...) over the root of two, that close where there are enough.

    Args:
        values: what every period differs by from the mean.
        places: (P,) number of every period in the recording, rising.
    """
    follows = np.diff(np.asarray(places)) == 1
    if np.count_nonzero(follows[1:] & follows[:-1]) < FEWEST_TO_CLOSE - 2:
        return np.asarray(np.diff(values, axis=1) / np.sqrt(2.0), dtype=np.float64)
    phase = np.arange(len(values)) / len(values)
    turn = 2.0 / 3.0 * (np.pi * phase - 0.5 * np.sin(2.0 * np.pi * phase))
    # a^2 - a b + b^2 = 1: steps between a period with b times the one before keep the energy of plain ones
    before = (2.0 / np.sqrt(3.0) * np.sin(turn)).reshape(-1, *[1] * (values.ndim - 1))
    own = np.cos(turn).reshape(before.shape) + 0.5 * before
    closed = own * values[:, 1:] + before * values[:, :-1]
    steps = np.diff(closed, axis=1)[:, follows[1:] & follows[:-1]]
    return np.asarray(steps / np.sqrt(2.0), dtype=np.float64)
