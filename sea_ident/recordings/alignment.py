"""Signals of different clocks or rates brought onto one grid of times, inside the window that all of them cover."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sea_ident._typing import FloatArray
from sea_ident.exceptions import RecordingError
from sea_ident.recordings.clock_offset import estimate_offset
from sea_ident.recordings.naming import dimension_of
from sea_ident.recordings.recording import GAP_FACTOR, Recording

MOST_SAMPLES = 100_000_000
"""Samples of a grid."""


SMOOTH = ("position", "velocity")
"""Physical dimensions of signals that have no jumps."""

FEWEST_FOR_SPLINE = 8
"""Samples between gaps from which on they are joined by a spline."""


@dataclass(frozen=True, eq=False)
class Stream:
    """Signals that share one clock.

    Attributes:
        name: Name of the clock: its time column, or its topic.
        time: Sample times, strictly rising, shape (N,), [s].
        columns: Column name to samples of shape (N,).
    """

    name: str
    time: FloatArray
    columns: Mapping[str, FloatArray]


@dataclass(frozen=True)
class ClockAlignment:
    """How streams of different clocks become one recording.

    Attributes:
        rate: Even grid of this rate [Hz]; by default the sample times of the reference are the grid.
        reference: Name of the stream whose clock counts; by default the first.
        offsets: Stream -> seconds to add to its times [s].
        estimate: Streams whose offset is estimated from the motion that they share with the reference.
        largest_offset: Bound of the estimated offsets [s].
        longest_gap: Longest interval that may be interpolated across [s]; by default three median intervals of
            the stream. Grid points inside longer ones are dropped.
    """

    rate: float | None = None
    reference: str | None = None
    offsets: Mapping[str, float] = field(default_factory=dict)
    estimate: Collection[str] = ()
    largest_offset: float = 0.5
    longest_gap: float | None = None


@dataclass(frozen=True)
class StreamReport:
    """What happened to one stream.

    Attributes:
        name: Name of the clock.
        samples: Samples that it had.
        rate: Its median rate [Hz].
        offset: Added to its times [s].
        correlation: Of the motion shared with the reference at that offset; None where it was not estimated.
        interpolated: False where all its samples could be taken as they are.
        dropped: Grid points dropped because they lie in its gaps.
    """

    name: str
    samples: int
    rate: float
    offset: float
    correlation: float | None
    interpolated: bool
    dropped: int


@dataclass(frozen=True, eq=False)
class AlignedRecording:
    """A recording made from several streams.

    Attributes:
        recording: All columns on one grid; its notes and warnings repeat the report.
        streams: What happened to each stream.
    """

    recording: Recording
    streams: tuple[StreamReport, ...]

    def summary(self) -> str:
        """The recording's summary, which holds the report among its notes."""
        return self.recording.summary()


def align_streams(
    streams: Sequence[Stream],
    how: ClockAlignment | None = None,
    *,
    source: str = "streams",
) -> AlignedRecording:
    """Interpolate streams onto one grid, inside the window that all cover; nothing is extrapolated.

    Positions and velocities are interpolated by cubic splines between gaps: straight lines between the samples of a
    slow clock have accelerations that no robot has. Other signals may jump, and are interpolated linearly.

    Args:
        streams: The signals by clock.
        how: Grid, reference and offsets; by default the sample times of the first stream, and no offsets.
        source: File name or description for messages.

    Returns:
        The recording, and what happened to each stream.

    Raises:
        RecordingError: the streams do not overlap, an offset cannot be estimated, or a name is not known.
    """
    how = how or ClockAlignment()
    # Each stream is a recording of its own: that checks its time and its columns.
    checked = {stream.name: _checked(stream, source) for stream in streams}
    if len(checked) != len(streams) or not streams:
        raise RecordingError(f"{source}: streams need different names; there are {[s.name for s in streams]}")
    _check_names(how, checked, source)
    reference = how.reference or streams[0].name
    offsets = {name: float(how.offsets.get(name, 0.0)) for name in checked}
    correlations: dict[str, float] = {}
    for name in how.estimate:
        offsets[name], correlations[name] = estimate_offset(
            checked[name], checked[reference], how.largest_offset, f"{source}: stream {name!r}"
        )
    times = {name: recording.time + offsets[name] for name, recording in checked.items()}
    grid = _grid(times, reference, how.rate, source)
    keep = np.ones(grid.size, dtype=np.bool_)
    lost = {}
    for name, time in times.items():
        allowed = how.longest_gap or GAP_FACTOR * float(np.median(np.diff(time)))
        inside = in_gap(grid, time, allowed)
        lost[name] = int(np.count_nonzero(inside))
        keep &= ~inside
    columns: dict[str, FloatArray] = {}
    for name, recording in checked.items():
        for column, values in recording.columns.items():
            if column in columns:
                raise RecordingError(f"{source}: column {column} comes from two streams, the second being {name!r}")
            allowed = how.longest_gap or GAP_FACTOR * float(np.median(np.diff(times[name])))
            smooth = dimension_of(column) in SMOOTH
            columns[column] = between(grid[keep], times[name], values, allowed if smooth else None)
    reports = tuple(
        StreamReport(
            name,
            recording.samples,
            recording.sample_rate,
            offsets[name],
            correlations.get(name),
            not bool(np.all(np.isin(grid[keep], times[name]))),
            lost[name],
        )
        for name, recording in checked.items()
    )
    if np.count_nonzero(keep) < 2:
        raise RecordingError(f"{source}: fewer than 2 grid points lie outside the gaps of the streams")
    notes, warnings = _report(reports, reference, grid[keep], how.rate)
    return AlignedRecording(Recording(grid[keep], columns, source, warnings, notes), reports)


def _checked(stream: Stream, source: str) -> Recording:
    return Recording(stream.time, stream.columns, f"{source}, clock {stream.name!r}")


def _check_names(how: ClockAlignment, known: Collection[str], source: str) -> None:
    for name in [*how.offsets, *how.estimate, *([how.reference] if how.reference else [])]:
        if name not in known:
            raise RecordingError(f"{source}: no clock is called {name!r}; there are {', '.join(known)}")
    for name, offset in how.offsets.items():
        if name in how.estimate:
            raise RecordingError(f"{source}: the offset of {name!r} is both given and to be estimated")
        if not np.isfinite(offset):
            raise RecordingError(f"{source}: the offset of {name!r} is {offset}")
    if how.rate is not None and not (np.isfinite(how.rate) and how.rate > 0.0):
        raise RecordingError(f"{source}: the rate is {how.rate} Hz; it must be positive")


def _grid(times: Mapping[str, FloatArray], reference: str, rate: float | None, source: str) -> FloatArray:
    start = max(float(time[0]) for time in times.values())
    stop = min(float(time[-1]) for time in times.values())
    grid = times[reference]
    if rate is None:
        grid = grid[(grid >= start) & (grid <= stop)]
    elif stop > start:
        count = (stop - start) * rate
        if count > MOST_SAMPLES:
            raise RecordingError(f"{source}: {count:.0f} samples at {rate:g} Hz; at most {MOST_SAMPLES} are made")
        grid = start + np.arange(int(count * (1.0 + 1e-12)) + 1) / rate
        grid = grid[grid <= stop]
    if stop <= start or grid.size < 2:
        spans = "; ".join(f"{name} from {time[0]:g} s to {time[-1]:g} s" for name, time in times.items())
        raise RecordingError(f"{source}: the clocks do not overlap: {spans}. State the offset between them")
    return grid


def between(grid: FloatArray, time: FloatArray, values: FloatArray, allowed: float | None) -> FloatArray:
    """Values (M,) at the points of a grid: by cubic splines between gaps longer than allowed [s], linearly where None.

    Args:
        grid: (M,) points inside the time of the samples [s].
        time: (N,) of the samples [s].
        values: (N,) of the samples.
        allowed: longest interval that a spline goes across [s].
    """
    found: FloatArray = np.interp(grid, time, values)
    if allowed is None or np.all(np.isin(grid, time)):
        return found
    from scipy.interpolate import make_interp_spline

    stops = [*(np.flatnonzero(np.diff(time) > allowed) + 1).tolist(), len(time)]
    for start, stop in zip([0, *stops[:-1]], stops, strict=True):
        first, last = np.searchsorted(grid, [time[start], time[stop - 1]], side="left")
        if stop - start >= FEWEST_FOR_SPLINE and last > first:
            spline = make_interp_spline(time[start:stop], values[start:stop], k=3)
            found[first:last] = spline(grid[first:last])
    return found


def in_gap(grid: FloatArray, time: FloatArray, allowed: float) -> NDArray[np.bool_]:
    """Which points of a grid (N,) [s] lie strictly inside an interval of `time` (M,) [s] longer than allowed [s]."""
    after = np.clip(np.searchsorted(time, grid, side="left"), 1, time.size - 1)
    long = time[after] - time[after - 1] > allowed
    return np.asarray(long & (grid > time[after - 1]) & (grid < time[after]))


def _report(
    reports: Sequence[StreamReport], reference: str, grid: FloatArray, rate: float | None
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    target = float(1.0 / np.median(np.diff(grid)))
    onto = f"the sample times of {reference!r}" if rate is None else f"an even grid of {rate:g} Hz"
    notes = [f"clocks aligned on {onto}, from {grid[0]:g} s to {grid[-1]:g} s, {grid.size} samples"]
    warnings = []
    for report in reports:
        text = f"clock {report.name!r}: {report.samples} samples at {report.rate:.6g} Hz"
        if report.offset != 0.0 or report.correlation is not None:
            text += f", offset {report.offset:+.6g} s"
        if report.correlation is not None:
            text += f" (estimated, correlation {report.correlation:.4f})"
        notes.append(text + (", interpolated" if report.interpolated else ", taken as it is"))
        if report.dropped:
            warnings.append(
                f"clock {report.name!r}: {report.dropped} samples dropped, which fall into its gaps; "
                "nothing is filled in"
            )
        if report.interpolated and report.rate > 1.5 * target:
            warnings.append(
                f"clock {report.name!r}: {report.rate:.6g} Hz sampled at {target:.6g} Hz without a filter; what it "
                f"holds above {target / 2.0:.6g} Hz folds back. State a higher rate"
            )
    return tuple(notes), tuple(warnings)
