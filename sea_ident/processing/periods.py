"""Whole periods out of a recording: their length, their place, and whether they are periods at all."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline

from sea_ident._typing import FloatArray
from sea_ident.exceptions import RecordingError
from sea_ident.processing.variance import noise_from_curvature

REPEATS_WITHIN = 0.02
"""Mean square difference of two periods, as a share of twice the variance, up to which a lag can be a period."""

ALIKE = 0.5 * 0.01**2
"""The same where repeats differ by a hundredth of the motion: machines that follow a periodic reference stay below."""

DRIFTING = 0.5 * 0.05**2
"""The same where repeats differ by a twentieth of the motion after half of all periods, ..."""

FEWEST_DRIFTING = 5
"""... if there are so many of them, as the motion of a robot whose friction drifts; of fewer it may be chance."""

NOISE = 9.0
"""Mean square difference over that of the noise up to which noise explains it."""

WHOLE = 0.01
"""Deviation of a ratio from a whole number up to which it is one [-]."""

GROWTH = 2.5
"""Growth of the mean square difference over more periods up to which it does not grow: what repeats nearly, as two
frequencies that hardly fit together, differs twice as much after two periods, so four times in square."""


@dataclass(frozen=True, eq=False)
class Cut:
    """Where the whole periods lie.

    Attributes:
        period: [s].
        samples: N per period.
        periods: P.
        first: index of the first sample used where the samples fall on the period, else -1.
        start: time of the first sample used [s].
    """

    period: float
    samples: int
    periods: int
    first: int
    start: float

    def stack(self, time: FloatArray, values: FloatArray) -> FloatArray:
        """(P, N, k) periods of the samples (M, k); resampled by cubic splines where they fall beside the grid."""
        shape = (self.periods, self.samples, values.shape[1])
        if self.first >= 0:
            stop = self.first + self.periods * self.samples
            return np.ascontiguousarray(values[self.first : stop]).reshape(shape)
        steps = np.arange(self.periods * self.samples) * (self.period / self.samples)
        spline = make_interp_spline(time, values, k=3)
        return np.asarray(spline(np.minimum(self.start + steps, time[-1])), dtype=np.float64).reshape(shape)


def mismatch(values: FloatArray, measured: NDArray[np.bool_] | None = None) -> FloatArray:
    """How badly a uniformly sampled signal (M, k) repeats itself after every lag.

    Args:
        values: (M, k) signals.
        measured: (M,) samples that count; all where None. Others, as in a gap of time, are compared with nothing.

    Returns:
        (M - M // 4,) for lags 0, 1, ...: mean square difference over twice the variance; 1 for unrelated samples.
    """
    samples = len(values)
    lags = samples - max(samples // 4, 1)
    total = np.zeros(lags)
    columns = [column - column.mean() for column in values.T]
    columns = [column / column.std() for column in columns if np.ptp(column) > 0.0]
    size = 1 << int(np.ceil(np.log2(2 * samples)))
    count: FloatArray = samples - np.arange(lags, dtype=np.float64)
    if measured is not None and not np.all(measured):
        return _mismatch_of_some(columns, measured, lags, size)
    for column in columns:
        spectrum = np.fft.rfft(column, size)
        products = np.fft.irfft(np.abs(spectrum) ** 2, size)[:lags]
        energy = np.concatenate([[0.0], np.cumsum(column**2)])
        head = energy[samples - np.arange(lags)]
        tail = energy[samples] - energy[np.arange(lags)]
        total += (head + tail - 2.0 * products) / (2.0 * count)
    if not columns:
        return np.ones(lags)
    return np.maximum(total / len(columns), 0.0)


def _mismatch_of_some(columns: list[FloatArray], measured: NDArray[np.bool_], lags: int, size: int) -> FloatArray:
    """As `mismatch`, of pairs of samples that are both measured."""
    if not columns:
        return np.ones(lags)
    mask = np.fft.rfft(measured.astype(np.float64), size)
    count = np.round(np.fft.irfft(np.abs(mask) ** 2, size)[:lags])
    total = np.zeros(lags)
    for column in columns:
        seen = np.where(measured, column, 0.0)
        spectrum, squares = np.fft.rfft(seen, size), np.fft.rfft(seen**2, size)
        cross = squares * mask.conj() + squares.conj() * mask - 2.0 * np.abs(spectrum) ** 2
        total += np.fft.irfft(cross, size)[:lags]
    compared = count > 0.5 * (len(measured) - np.arange(lags) - 2.0 * np.count_nonzero(~measured))
    found: FloatArray = np.where(compared & (count > 0.0), total / (2.0 * np.maximum(count, 1.0) * len(columns)), 1.0)
    return np.maximum(found, 0.0)


def detect_period(time: FloatArray, values: FloatArray, measured: NDArray[np.bool_] | None = None) -> float | None:
    """The period of signals, if they repeat themselves beyond doubt.

    A smooth motion is always a little like itself some time later. It counts as periodic where repeats differ by no
    more than their noise explains, or than a hundredth of the motion (of many repeats a twentieth, by which a motion
    may drift), or by no more after several periods than after one. The first of three or more periods is not looked at:
    it is where motions begin.

    Args:
        time: (M,) uniform times [s].
        values: (M, k) signals.
        measured: (M,) samples that count; all where None.

    Returns:
        The smallest lag [s] after which all signals repeat, refined between samples over several periods; None where
        there is none.
    """
    interval = float((time[-1] - time[0]) / (len(time) - 1))
    thin = max(1, len(time) // 200_000)
    values, interval = values[::thin], interval * thin
    measured = None if measured is None else measured[::thin]
    if not np.any(np.ptp(values, axis=0) > 0.0):
        return None
    lag = _first_repeat(mismatch(values, measured))
    if lag is None:
        return None
    if len(values) >= 3 * lag:
        values, measured = values[lag:], None if measured is None else measured[lag:]
    error, moving = mismatch(values, measured), np.ptp(values, axis=0) > 0.0
    repeats = len(values) / lag
    last = max(int(repeats / 2.0), min(2, int(repeats - 0.5)), 1)
    period, differences = float(lag), []
    for k in range(1, last + 1):
        place, difference = _minimum(error, round(k * period))
        period = place / k
        differences.append(difference)
    noise = float(np.mean(noise_from_curvature(values[:, moving]) / values[:, moving].var(axis=0)))
    alike = DRIFTING if repeats >= FEWEST_DRIFTING else ALIKE
    bound = max(alike, NOISE * noise, GROWTH * differences[0] if last > 1 else 0.0)
    if max(differences) > bound:
        return None
    # many logs hold a whole number of samples per period; what is that within the accuracy of the lag is that
    if abs(period - round(period)) < 0.3 / last:
        period = float(round(period))
    return period * interval


def _first_repeat(error: FloatArray) -> int | None:
    """The smallest lag in samples that is as good a period as any, by the mismatch after every lag."""
    # leave the neighbourhood of lag zero: a period starts where the signal has first become unlike itself
    unlike = np.flatnonzero(error > 0.2)
    if not unlike.size:
        return None
    inner = np.arange(max(int(unlike[0]), 1), len(error) - 1)
    minima = inner[(error[inner] <= error[inner - 1]) & (error[inner] <= error[inner + 1])]
    minima = minima[error[minima] < REPEATS_WITHIN]
    if not minima.size:
        return None
    # a minimum between two samples is lower than both, and known to a small share of what it rises to the next
    found = [_minimum(error, int(lag)) for lag in minima]
    height = np.array([low for _, low in found])
    rise = error[minima - 1] + error[minima + 1] - 2.0 * error[minima]
    lag = int(minima[height <= max(4.0 * float(height.min()), 1e-9) + 0.02 * rise][0])
    if 3 * lag <= 4 * len(error) // 3:
        return lag
    # of what is hardly repeated chance makes one multiple of the period the best, where stamps of time wander
    parts = minima[(height <= ALIKE) & (minima < lag)]
    fits = [part for part in parts if abs(lag / part - round(lag / part)) < WHOLE]
    return int(fits[0]) if fits else lag


def _minimum(error: FloatArray, near: int) -> tuple[float, float]:
    """Place, between samples, and height of the minimum of the mismatch next to a lag."""
    near = min(near, len(error) - 2)
    while 1 < near < len(error) - 2 and min(error[near - 1], error[near + 1]) < error[near]:
        near += 1 if error[near + 1] < error[near - 1] else -1
    left, middle, right = error[near - 1], error[near], error[near + 1]
    curvature = left - 2.0 * middle + right
    if curvature <= 0.0:
        return float(near), float(middle)
    shift = float(np.clip(0.5 * (left - right) / curvature, -0.5, 0.5))
    return near + shift, max(float(middle - 0.5 * curvature * shift**2), 0.0)


def usual_interval(time: FloatArray) -> float:
    """Interval of samples at `time` (M,) [s]: where some are lost the others lie on a grid that the mean misses."""
    steps = np.diff(time)
    usual = float(np.median(steps))
    on_grid = np.mean(np.abs(steps - usual) < USUAL * usual) > 1.0 - USUAL
    return usual if on_grid else float(time[-1] - time[0]) / (len(time) - 1)


def cut_periods(time: FloatArray, uniform: bool, period: float, source: str) -> Cut:
    """The last whole periods of a recording.

    Args:
        time: (M,) [s].
        uniform: whether the samples are evenly spaced.
        period: [s].
        source: for messages.

    Returns:
        Where they lie.

    Raises:
        RecordingError: if the recording is shorter than one period, or has fewer than 8 samples in it.
    """
    if not (np.isfinite(period) and period > 0.0):
        raise RecordingError(f"{source}: the period is {period} s; it must be positive")
    duration = float(time[-1] - time[0])
    interval = duration / (len(time) - 1) if uniform else usual_interval(time)
    length = duration + interval  # the last sample lasts as long as the others
    periods = int(np.floor(length / period + 1e-6))
    if periods < 1:
        raise RecordingError(
            f"{source}: the recording lasts {length:g} s, less than one period of {period:g} s; "
            "record at least one whole period, better ten or more, or correct the period"
        )
    samples = round(period / interval)
    if samples < 8:
        raise RecordingError(
            f"{source}: {samples} samples in a period of {period:g} s are too few; is the period in seconds?"
        )
    aligned = uniform and abs(samples * interval - period) * periods <= 0.05 * interval
    if aligned:
        periods = min(periods, len(time) // samples)
        first = len(time) - periods * samples
        return Cut(period, samples, periods, first, float(time[first]))
    start = float(time[-1]) + interval - periods * period
    if start < time[0]:
        start = float(time[0])
    return Cut(period, samples, periods, -1, start)


USUAL = 0.2
"""Share of intervals that may differ from the usual one, and by which share of it, of samples on a grid."""

DIES_AWAY = 0.5
"""Share of its distance from later periods that a transient has one period on, at most [-]."""

GAP = 0.02
"""Share of a period that may be without samples: motion of many harmonics is not known within a longer gap."""


def holes(time: FloatArray, cut: Cut) -> set[int]:
    """Periods that a gap in time reaches into.

    Args:
        time: (M,) [s].
        cut: where the periods lie.
    """
    steps = np.diff(time)
    gaps = np.flatnonzero(steps > max(GAP * cut.period, 3.0 * float(np.median(steps))))
    found: set[int] = set()
    for k in gaps:
        first, last = ((time[[k, k + 1]] - cut.start) / cut.period).tolist()
        found.update(range(max(int(np.floor(first)), 0), min(int(np.floor(last)), cut.periods - 1) + 1))
    return found


def leading_transients(stack: FloatArray) -> int:
    """How many periods at the beginning are not yet like the others.

    Args:
        stack: (P, N, k) positions of all periods.

    A transient dies away from one period to the next. What changes by a little less every time is a drift of the robot,
    and its first periods show it best.

    Returns:
        Number of leading periods that differ from the middle one of the later half by more than five times the usual
        distance, and by much more than the next one does; at most half of them.
    """
    count = len(stack)
    if count < 4:
        return 0
    later = stack[count // 2 :]
    middle = np.median(later, axis=0)
    scale = np.maximum(stack.std(axis=(0, 1)), 1e-300)
    distance = np.sqrt(np.mean(((stack - middle) / scale) ** 2, axis=(1, 2)))
    usual = float(np.median(distance[count // 2 :]))
    limit = max(5.0 * usual, 1e-7)
    drop = 0
    while drop < count // 2 and distance[drop] > limit and distance[drop + 1] < DIES_AWAY * distance[drop]:
        drop += 1
    return drop


def repeated_periods(stack: FloatArray) -> list[tuple[int, int]]:
    """Pairs (copy, original) of periods that agree in every sample of every signal.

    Args:
        stack: (P, N, k) all signals of all periods.
    """
    seen: dict[bytes, int] = {}
    pairs = []
    for p in range(len(stack)):
        key = np.ascontiguousarray(stack[p]).tobytes()
        if key in seen:
            pairs.append((p, seen[key]))
        else:
            seen[key] = p
    return pairs
