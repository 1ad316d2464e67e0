"""Samples around reversals of a speed, where no model of friction can be right."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sea_ident._typing import FloatArray

REVERSAL_SAMPLES = 2
"""Samples to either side of a reversal of a motor that are left out of its equation."""

SLOWEST = 0.02
"""Samples slower than this share of the rms speed are left out of the equation of a motor."""

UNCERTAIN_SIGN = 2.0
"""Samples slower than this many times their scatter from period to period are left out too: a mean of signs is none."""


ALIKE = 1e-4
"""Power of a combination of samples beside the strongest below which it is nothing of its own within a band [-]."""


def around_reversal(speed: FloatArray, samples: int = REVERSAL_SAMPLES) -> NDArray[np.bool_]:
    """(N,) whether a speed (N,) is about to change its sign."""
    left_out = np.abs(speed) < SLOWEST * float(np.sqrt(np.mean(speed**2)))
    crossing = np.flatnonzero(np.sign(speed) != np.sign(np.roll(speed, 1)))
    for shift in range(-samples, samples):
        left_out[(crossing + shift) % len(speed)] = True
    return left_out


def around_mean_reversal(
    speed: FloatArray,
    periods: Sequence[FloatArray],
    errors: FloatArray | None = None,
    *,
    samples: int = REVERSAL_SAMPLES,
    uncertain: float = UNCERTAIN_SIGN,
) -> NDArray[np.bool_]:
    """(N,) the same of the mean (N,) of speeds of periods, each (N,): also where these do not agree on its sign.

    There a sample falls on one or the other side of a jump (of friction, of the efficiency of the gear) by a velocity
    that is known no better than to its sign: no model of the mean can be right. Errors (K, N) that are in every period
    alike blur a sign as the scatter of the periods does.
    """
    left_out = around_reversal(speed, samples)
    if len(periods) > 1:
        spread = np.std(periods, axis=0, ddof=1)
        if errors is not None:
            spread = np.hypot(spread, np.sqrt(np.mean(errors**2)))
        left_out |= np.abs(speed) < uncertain * spread
    return left_out


def without_ringing(values: FloatArray, left_out: NDArray[np.bool_], harmonics: int) -> FloatArray:
    """Residuals at the samples that are not left out, without what rings there from those that are.

    A motion is known up to some harmonics, and what it lacks at a reversal, where accelerations jump, is in the
    samples around it too. It has the shape of anything at the samples that are left out, within that band.

    Args:
        values: (..., N) residuals over one period.
        left_out: (N,) samples around reversals.
        harmonics: H, of the motion.

    Returns:
        (..., N) residuals; those left out are as they were.
    """
    samples, kept = len(left_out), ~left_out
    # next to nothing comes from the middle of a long rest, and neighbours that the band does not tell apart are one
    reach = samples // harmonics
    ends = left_out & np.any([np.roll(kept, shift) for shift in range(-reach, reach + 1)], axis=0)
    at = np.flatnonzero(ends)[:: max(1, samples // (16 * harmonics))]
    spectrum = np.zeros(samples // 2 + 1)
    spectrum[: harmonics + 1] = 1.0
    pulse = np.fft.irfft(spectrum, samples)
    columns = pulse[(np.flatnonzero(kept)[:, None] - at) % samples]
    power, mixed = np.linalg.eigh(columns.T @ columns)
    seen = power > ALIKE * power.max(initial=0.0)
    basis = columns @ (mixed[:, seen] / np.sqrt(power[seen]))
    out = values.copy()
    out[..., kept] -= (values[..., kept] @ basis) @ basis.T
    return out
