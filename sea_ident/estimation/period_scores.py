"""Scores of the periods: by how much each of them moves an estimate."""

from collections.abc import Sequence

import numpy as np

from sea_ident._typing import FloatArray

OVERLAP = 0.1
"""Share of a period over which it hands over to the next."""


def period_scores(residuals: FloatArray, instruments: FloatArray, places: Sequence[int]) -> FloatArray:
    """Sums of instruments times residual over every period, with soft borders between periods that follow each other.

    Noise of an encoder enters as its second derivative. Summed over a period, that is a little noise of the bulk and a
    lot of it at both borders, which the next period has with the opposite sign: it leaves no trace in the mean of all
    periods, but their spread would be made of it. Where one period hands over to the next gradually it is not there in
    the first place. What is summed over all periods stays the same.

    Args:
        residuals: (P, N, n) residual of every period.
        instruments: (N, n, c).
        places: (P,) number of every period in the recording, rising.

    Returns:
        (P, c) scores. Their spread is that of sums over whole periods with sharp borders and noise without memory.
    """
    periods, samples = residuals.shape[:2]
    scores = np.einsum("pkn,knc->pc", residuals, instruments)
    half = round(0.5 * OVERLAP * samples)
    joined = np.flatnonzero(np.diff(np.asarray(places)) == 1)
    if not half or not joined.size:
        return np.asarray(scores, dtype=np.float64)
    # a quarter turn of a cosine on each side of the border: half there, none at the far end
    given = 0.5 * (1.0 - np.sin(0.5 * np.pi * (np.arange(half) + 0.5) / half))[:, None, None]
    forward = np.einsum("pkn,knc->pc", residuals[joined, -half:], given[::-1] * instruments[-half:])
    backward = np.einsum("pkn,knc->pc", residuals[joined + 1, :half], given * instruments[:half])
    np.add.at(scores, joined, backward - forward)
    np.add.at(scores, joined + 1, forward - backward)
    # noise that is shared by two periods scatters less: by sum of squares of the shares
    lost = 2.0 * len(joined) * float(np.sum(1.0 - given**2 - (1.0 - given) ** 2))
    return np.asarray(scores / np.sqrt(1.0 - lost / (periods * samples)), dtype=np.float64)
