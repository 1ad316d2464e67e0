"""Fourier series of periodic signals: how many harmonics the data support, and the derivatives."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from sea_ident._typing import FloatArray

SIGNIFICANCE = 1e-3

BANDS = (31, 125)
"""Numbers of neighbouring harmonics that are judged together: more see weaker signals, fewer where they end."""

AVERAGES_OUT = 1.5
"""Floor of the spectrum of the mean over what the scatter of the periods leaves there, up to which it is all noise."""

FEWEST_PERIODS = 6
"""Periods from which on the noise is known well enough to judge bands by it."""

REPEATED = 4.0
"""How much more the motor's signal that is left out counts than noise that is kept."""

FEWEST_AT_END = 6
"""Samples at least through which the end of a stretch of periods is laid."""


def spectrum(stack: FloatArray, repeated: FloatArray | None = None) -> FloatArray:
    """Power of the harmonics of the mean over the periods, and of its noise.

    The noise is the larger of what the scatter between periods says and of the floor of the mean's own spectrum:
    quantisation repeats itself from period to period and is not seen in the scatter. Steps that pass slowly for the
    sample rate are not seen in the floor either: they are in the harmonics of the motion and not in the upper half.

    Args:
        stack: (P, N, n) signals of P periods.
        repeated: (N // 2, n) powers of what steps of encoders leave in the mean, where they do not average out.

    Returns:
        (2, N // 2, n) powers |c_l|^2 of the mean, and of its noise, from harmonic 1 on.
    """
    periods, samples, _ = stack.shape
    coefficients = np.fft.rfft(stack, axis=1)[:, 1 : samples // 2 + 1] / samples
    mean = coefficients.mean(axis=0)
    power = np.abs(mean) ** 2
    harmonics = len(power)
    # what cannot repeat in any band-limited motion: the level of the upper half of the spectrum
    floor = np.median(power[harmonics // 2 :], axis=0) / np.log(2.0)
    noise = np.broadcast_to(floor, power.shape).copy()
    if periods > 1:
        scatter = (np.abs(coefficients - mean) ** 2).sum(axis=0) / (periods * (periods - 1))
        between = smoothed(scatter)
        noise = np.maximum(noise, between if repeated is None else between + repeated)
    rounding = (1e-15 * np.abs(stack).max(axis=(0, 1))) ** 2
    return np.stack([power, np.maximum(noise, np.maximum(rounding, 1e-300))])


def smoothed(powers: FloatArray) -> FloatArray:
    """(L, n) means of the powers (L, n) of neighbouring harmonics."""
    width = min(9, len(powers))
    kernel = np.ones(width) / width
    padded = np.pad(powers, ((width // 2, width - 1 - width // 2), (0, 0)), mode="edge")
    return np.stack([np.convolve(padded[:, i], kernel, mode="valid") for i in range(powers.shape[1])], axis=1)


def choose_harmonics(stack: FloatArray, most: int, repeated: FloatArray | None = None) -> int:
    """The number of harmonics that makes the error of the acceleration smallest.

    Every harmonic kept brings its noise, every harmonic left out its signal, both times the fourth power of its
    number in the acceleration. Only signal that stands out of the noise counts.

    Args:
        stack: (P, N, n) positions of P periods.
        most: largest number to choose.
        repeated: (N // 2, n) powers of what steps of encoders leave in the mean, where they do not average out.

    Returns:
        Number of harmonics, at least 1, the largest over the signals.
    """
    power, noise = spectrum(stack, repeated)[:, :most]
    return _cheapest(noise, _single_signal(power, noise))


def choose_motor_harmonics(stack: FloatArray, most: int, repeated: FloatArray | None = None) -> int:
    """The number of harmonics of motors, whose friction makes them jerk at every reversal.

    The tail of such a motion lies below the noise in every harmonic, and yet carries torque. As it repeats in every
    period, no average takes it away and no spread between periods shows it. So harmonics count by bands, in which the
    signal stands out where no harmonic of it does, and what is left out counts more than the noise of what is kept.
    Few periods tell too little of the noise for that, and so do encoders whose steps repeat in every period: their
    spectrum may have any shape.

    Args:
        stack: (P, N, n) positions of P periods.
        most: largest number to choose.
        repeated: (N // 2, n) powers of what steps of encoders leave in the mean, where they do not average out.

    Returns:
        Number of harmonics, at least 1, the largest over the signals.
    """
    if len(stack) < FEWEST_PERIODS:
        return choose_harmonics(stack, most, repeated)
    power, noise = spectrum(stack, repeated)[:, :most]
    single = _single_signal(power, noise)
    white = _averages_out(stack)
    if repeated is not None:
        white &= ~np.any(repeated > 0.0, axis=0)
    tail = np.where(white, _band_signal(power, noise, single == 0.0, len(stack)), 0.0)
    weight = np.where(np.any(tail != 0.0, axis=0), REPEATED, 1.0)
    return _cheapest(noise, weight * (single + tail))


def _averages_out(stack: FloatArray) -> NDArray[np.bool_]:
    """(n,) whether the upper half of the spectrum of the mean is what the scatter of the periods (P, N, n) leaves."""
    periods, samples, _ = stack.shape
    coefficients = np.fft.rfft(stack, axis=1)[:, samples // 4 + 1 : samples // 2 + 1]
    mean = coefficients.mean(axis=0)
    scatter = (np.abs(coefficients - mean) ** 2).sum(axis=0) / (periods * (periods - 1))
    floor = np.median(np.abs(mean) ** 2, axis=0) / np.log(2.0)
    return np.asarray(floor <= AVERAGES_OUT * scatter.mean(axis=0), dtype=np.bool_)


def _cheapest(noise: FloatArray, signal: FloatArray) -> int:
    """Where noise (L, n) kept and signal (L, n) left out are least in the acceleration, largest over the signals."""
    weight = np.arange(1, len(noise) + 1)[:, None] ** 4.0
    kept = np.cumsum(weight * noise, axis=0)
    lost = np.concatenate([np.cumsum((weight * signal)[::-1], axis=0)[::-1][1:], np.zeros((1, noise.shape[1]))])
    return int(np.argmin(kept + lost, axis=0).max()) + 1


def _single_signal(power: FloatArray, noise: FloatArray) -> FloatArray:
    """(L, n) power of the signal in harmonics that stand out of the noise one by one, else 0."""
    significant = power > noise * np.log(len(power) / SIGNIFICANCE)
    return np.where(significant, np.maximum(power - noise, 0.0), 0.0)


def _band_signal(power: FloatArray, noise: FloatArray, counted: NDArray[np.bool_], periods: int) -> FloatArray:
    """(L, n) power of the signal where a band of harmonics stands out of the noise together, else 0.

    Powers of noise are exponentially distributed; so their mean over a band, relative to a noise that was found from
    the scatter of the periods in that band, follows Fisher's distribution. The power is that beyond the noise, by the
    mean of the narrowest band; chance makes it negative in places, and is not to be rectified.

    Args:
        power: (L, n) of the mean over the periods.
        noise: (L, n) of it.
        counted: (L, n) harmonics that do not stand out by themselves; the others would spread over their band.
        periods: P that the noise comes from.
    """
    ratio = np.where(counted, power / noise, 0.0)
    means, standing = [], np.zeros_like(counted)
    for width in BANDS:
        number = _moving_sum(counted.astype(np.float64), width)
        mean = np.divide(_moving_sum(ratio, width), number, out=np.ones_like(ratio), where=number > 0.0)
        freedom = 2.0 * np.maximum(number, 1.0)
        limit = stats.f.isf(SIGNIFICANCE / max(len(power) / width, 1.0), freedom, freedom * (periods - 1))
        means.append(mean)
        standing |= mean > limit
    return np.asarray(np.where(counted & standing, noise * (means[0] - 1.0), 0.0), dtype=np.float64)


def _moving_sum(values: FloatArray, width: int) -> FloatArray:
    """(L, n) sums over an odd number of neighbours, fewer at the ends."""
    total = np.cumsum(np.pad(values, ((width // 2 + 1, width // 2), (0, 0))), axis=0)
    return np.asarray(total[width:] - total[:-width], dtype=np.float64)


def within(values: FloatArray, harmonics: int) -> FloatArray:
    """The part of periodic signals in their first harmonics, a projection.

    Args:
        values: (N, ...) one whole period.
        harmonics: L; 0 stands for all.

    Returns:
        (N, ...) the signals without their harmonics beyond L.
    """
    samples = len(values)
    if not 0 < harmonics < samples // 2:
        return values
    coefficients = np.fft.rfft(values, axis=0)
    coefficients[harmonics + 1 :] = 0.0
    return np.asarray(np.fft.irfft(coefficients, samples, axis=0), dtype=np.float64)


def differentiate(values: FloatArray, period: float, harmonics: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Fourier fit of one whole period and its analytic derivatives (paper, eqs. 15-17).

    On a whole period of evenly spaced samples, the least-squares fit of a Fourier series is the truncated discrete
    Fourier transform.

    Args:
        values: (..., N, n) positions.
        period: [s].
        harmonics: L, at most (N - 1) // 2.

    Returns:
        Positions, velocities and accelerations, each (..., N, n).
    """
    samples = values.shape[-2]
    coefficients = np.fft.rfft(values, axis=-2)
    keep = min(harmonics, (samples - 1) // 2)
    coefficients[..., keep + 1 :, :] = 0.0
    factor = (2j * np.pi / period * np.arange(coefficients.shape[-2]))[:, None]
    parts = []
    for order in range(3):
        parts.append(np.fft.irfft(coefficients * factor**order, samples, axis=-2))
    return parts[0], parts[1], parts[2]


def differentiate_periods(
    stack: FloatArray, period: float, harmonics: int, places: Sequence[int] | None = None
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Every period filtered and differentiated like the mean.

    The mean is a Fourier series. What a period differs by from it is not periodic: a series fitted to it alone would
    jump at both of its ends, and its derivatives with it. So the differences are laid end to end, as far as the periods
    follow each other. Where they do not, and at both ends of the recording, what comes next is not known: the
    differences are led on by their value and slope, so that their curvature there is taken too small, within about a
    wavelength of the last harmonic.

    Args:
        stack: (P, N, n) positions of the periods, in the order of their time.
        period: [s].
        harmonics: L, at most (N - 1) // 2.
        places: (P,) number of every period in the recording, rising, as some may have been left out; consecutive where
            None.

    Returns:
        Positions, velocities and accelerations, each (P, N, n).
    """
    periods, samples, joints = stack.shape
    runs = _consecutive(range(periods) if places is None else places)
    width = min(max(samples // (2 * harmonics), FEWEST_AT_END), samples // 2)
    centre = stack.mean(axis=0) - _seam(stack, runs, width)
    means = differentiate(centre, period, harmonics)
    parts = [np.empty_like(stack) for _ in range(3)]
    for run in runs:
        rest = (stack[run] - centre).reshape(-1, joints)
        long, reach = _extended(rest, width, samples)
        length = len(long) * period / samples
        found = differentiate(long, length, int((min(harmonics, (samples - 1) // 2) + 0.5) * length / period))
        for part, mean, more in zip(parts, means, found, strict=True):
            part[run] = mean + more[reach : reach + len(rest)].reshape(-1, samples, joints)
    return parts[0], parts[1], parts[2]


def _consecutive(places: Sequence[int]) -> list[slice]:
    """Stretches of periods that follow each other without a gap."""
    breaks = np.flatnonzero(np.diff(np.asarray(places)) != 1) + 1
    return [slice(int(a), int(b)) for a, b in pairwise([0, *breaks, len(places)])]


def _line_at(values: FloatArray, steps: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(n,) value and slope per step, where the steps are zero, of the parabola through (W, n) values."""
    found = np.polynomial.polynomial.polyfit(steps, values, 2)
    return found[0], found[1]


def _seam(stack: FloatArray, runs: Sequence[slice], width: int) -> FloatArray:
    """(N, n) the parabola that takes from the mean period the step, in value and slope, where its end meets its start.

    The mean of periods that drift does not close: at every place in between, the end of one period is the start of the
    next, but the first start and the last end remain. Both are compared with the mean of what passes over the places in
    between, which has no step.
    """
    periods, samples, joints = stack.shape
    inner = [p for run in runs for p in range(run.start, run.stop - 1)]
    if not inner:
        return np.zeros((samples, joints))
    before = np.mean([stack[p, -width:] for p in inner], axis=0)
    after = np.mean([stack[p + 1, :width] for p in inner], axis=0)
    starts = np.sum([stack[run.start, :width] - after for run in runs], axis=0)
    ends = np.sum([stack[run.stop - 1, -width:] - before for run in runs], axis=0)
    steps = np.arange(width, dtype=np.float64)
    value, slope = (
        (start - end) / periods
        for start, end in zip(_line_at(starts, steps), _line_at(ends, steps - width), strict=True)
    )
    phase = (np.arange(samples) / samples - 0.5)[:, None]
    return np.asarray(-value * phase - 0.5 * samples * slope * phase**2, dtype=np.float64)


def _extended(rest: FloatArray, width: int, samples: int) -> tuple[FloatArray, int]:
    """Differences (M, n), mirrored about both of their ends and faded out, so that they close without a jump.

    Mirrored in a point, the slope is the same on both sides. The point is that of a parabola through the last samples,
    so that the noise of a single one does not make a step.

    Returns:
        (M + 2 reach, n) differences, and the reach.
    """
    reach = min(samples, len(rest) - 1)
    fade = 0.5 * (1.0 + np.cos(np.pi * (np.arange(reach) + 1.0) / (reach + 1.0)))[:, None]
    steps = np.arange(width, dtype=np.float64)
    start, _ = _line_at(rest[:width], steps)
    end, _ = _line_at(rest[-width:], steps - (width - 1))
    before = (2.0 * start - rest[reach:0:-1]) * fade[::-1]
    after = (2.0 * end - rest[-2 : -reach - 2 : -1]) * fade
    return np.concatenate([before, rest, after]), reach
