"""Recordings without a period: zero-phase filtering and central differences."""

import numpy as np
from scipy.signal import butter, sosfiltfilt

from sea_ident._typing import FloatArray
from sea_ident.exceptions import RecordingError

ORDER = 4

NOISE_COUNTS = 10.0
"""Weight of the noise that is kept over that of the signal that is left out [-]: with 1 a stiffness came out 9 standard
deviations wrong, with 10 to 100 up to 2 at every level of noise; with 30 friction at a reversal passed for a push."""


def choose_cutoff(values: FloatArray, interval: float) -> float:
    """Frequency up to which positions stand out of their noise.

    As for harmonics: what is kept brings its noise, what is left out its signal, both by the fourth power of frequency
    in the acceleration. But noise in what inertias are fitted to makes them wrong, always to one side, and no periods
    are there to tell it; signal that is left out is unlike what is kept, and makes them less sure only. Noise counts
    more for that. Its level is that of the upper half of the spectrum.

    Args:
        values: (N, n) positions.
        interval: [s].

    Returns:
        Cutoff [Hz], between ten over the record length and 0.2 of the sample rate.
    """
    samples = len(values)
    detrended = values - values[0] - np.linspace(0.0, 1.0, samples)[:, None] * (values[-1] - values[0])
    power = np.abs(np.fft.rfft(detrended * np.hanning(samples)[:, None], axis=0)) ** 2
    frequency = np.fft.rfftfreq(samples, interval)
    bands = np.array_split(np.arange(1, len(frequency)), min(800, max(len(frequency) // 8, 2)))
    level = np.array([power[band].mean(axis=0) for band in bands])
    centre = np.array([frequency[band].mean() for band in bands])
    floor = np.median(level[len(level) // 2 :], axis=0)
    weight = centre[:, None] ** 4
    signal = np.where(level > 3.0 * floor, level - floor, 0.0)
    kept = np.cumsum(weight * np.broadcast_to(floor, level.shape), axis=0)
    lost = np.concatenate([np.cumsum((weight * signal)[::-1], axis=0)[::-1][1:], np.zeros((1, level.shape[1]))])
    best = float(centre[np.argmin(NOISE_COUNTS * kept + lost, axis=0)].max())
    return float(np.clip(1.2 * best, 10.0 / (samples * interval), 0.2 / interval))


def zero_phase(values: FloatArray, interval: float, cutoff: float, source: str) -> FloatArray:
    """Butterworth filter, forwards and backwards.

    Args:
        values: (N, n).
        interval: [s].
        cutoff: [Hz].
        source: for messages.

    Returns:
        (N, n) filtered values.

    Raises:
        RecordingError: too few samples, or a cutoff outside what the sample rate allows.
    """
    if len(values) < 30:
        raise RecordingError(f"{source}: {len(values)} samples are too few for a filter; record longer")
    nyquist = 0.5 / interval
    if not 0.0 < cutoff < nyquist:
        raise RecordingError(f"{source}: a cutoff of {cutoff:g} Hz is outside 0 .. {nyquist:g} Hz; choose another")
    sections = butter(ORDER, cutoff / nyquist, output="sos")
    pad = min(len(values) - 1, int(3.0 / (cutoff * interval)) + 3 * (2 * len(sections) + 1))
    return np.asarray(sosfiltfilt(sections, values, axis=0, padlen=pad), dtype=np.float64)


def central_difference(values: FloatArray, interval: float) -> FloatArray:
    """(N, n) central differences; one-sided of second order at both ends."""
    return np.asarray(np.gradient(values, interval, axis=0, edge_order=2), dtype=np.float64)
