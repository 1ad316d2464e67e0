"""Recording: measured or simulated signals over time, checked once and read-only from then on."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from sea_ident._typing import FloatArray
from sea_ident.exceptions import RecordingError
from sea_ident.recordings.naming import DIMENSIONS, SI_UNITS, TIME, dimension_of, split_name

EVEN_SPACING_TOLERANCE = 0.05
"""Largest distance of a sample from an even time grid, as a share of the interval, that counts as uniform."""

GAP_FACTOR = 3.0
"""An interval longer than this many median intervals is reported as a gap."""

SHORTEST_INTERVAL = 1e-9
"""A median interval below this [s] is refused."""

WRAP_TOLERANCE = 0.3
"""A step of an angle this close to a whole turn [rad] is reported, where most steps are below this."""

SLOWEST_CLOCK = 0.5
"""A median interval from this on [s] is doubted: no motion shows in such samples."""

FASTEST_LOG = 0.02
"""A median interval from this on [s] is one of milliseconds where nothing moves faster than `SLOW` for `LONG`."""

SLOW = 0.01
"""Speed of positions [rad/s] or [m/s] below which no inertia shows: a robot that moves takes a thousandfold of that in
milliseconds."""

LONG = 1000.0
"""Duration [s] from which on a slow motion is doubted."""

SPEED_SAMPLES = 10
"""Samples over which a speed is taken: encoders step now and then."""

LARGEST_VALUE = 1e12
"""A time or a known quantity beyond this in SI units is refused: it is corrupt or in another unit."""


@dataclass(frozen=True, eq=False)
class Recording:
    """A table of signals in SI units over one clock.

    Construction checks everything and copies the arrays; they are read-only afterwards. Nothing is ever
    filled in, sorted or dropped. Column names that start with no known kind are kept, and listed in `warnings`.

    Attributes:
        time: Sample times, strictly rising, shape (N,), [s].
        columns: Column name (`q_hip`, `current_knee`, ...) to samples of shape (N,), without `time`.
        source: File path or description, used in messages.
        warnings: What a user should know before trusting the recording.
        notes: What was done on reading: conversions, alignment, columns left out.

    Raises:
        RecordingError: fewer than two samples; lengths that differ; NaN, infinite or absurd values; time that
            does not rise; malformed column names.
    """

    time: FloatArray
    columns: Mapping[str, FloatArray]
    source: str
    warnings: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    joints: tuple[str, ...] = field(init=False, repr=False)
    """Joints with a column `q_<joint>`, in the order of the columns."""

    def __post_init__(self) -> None:
        time = _own(self.time, TIME, self.source)
        _check_time(time, self.source)
        columns: dict[str, FloatArray] = {}
        for name, values in self.columns.items():
            _check_name(name, self.source)
            column = _own(values, name, self.source)
            _check_column(column, name, time, self.source)
            columns[name] = column
        found = [*self.warnings, *_warnings(time, columns, self.source)]
        joints = [parts[1] for parts in map(split_name, columns) if parts is not None and parts[0] == "q"]
        object.__setattr__(self, "time", time)
        object.__setattr__(self, "columns", MappingProxyType(columns))
        object.__setattr__(self, "warnings", tuple(dict.fromkeys(found)))
        object.__setattr__(self, "notes", tuple(self.notes))
        object.__setattr__(self, "joints", tuple(joints))

    def __reduce__(self) -> tuple[Any, ...]:
        # A mapping proxy does not travel between processes; the constructor builds and checks it again.
        return Recording, (self.time, dict(self.columns), self.source, self.warnings, self.notes)

    @property
    def samples(self) -> int:
        """Number of samples N."""
        return len(self.time)

    @property
    def duration(self) -> float:
        """Time from the first to the last sample [s]."""
        return float(self.time[-1] - self.time[0])

    @property
    def sample_rate(self) -> float:
        """One over the median interval [Hz]."""
        return float(1.0 / np.median(np.diff(self.time)))

    @property
    def is_uniform(self) -> bool:
        """Whether every sample lies within 5 % of an interval of an evenly spaced grid."""
        grid = np.linspace(self.time[0], self.time[-1], self.samples)
        interval = self.duration / (self.samples - 1)
        return bool(np.max(np.abs(self.time - grid)) <= EVEN_SPACING_TOLERANCE * interval)

    def has(self, kind: str, joint: str) -> bool:
        """Whether there is a column `<kind>_<joint>`."""
        return f"{kind}_{joint}" in self.columns

    def channel(self, kind: str, joints: Sequence[str]) -> FloatArray:
        """One kind of signal of several joints.

        Args:
            kind: `q`, `theta`, `tau_motor`, `current`, `tau_spring`, ... (`naming.DIMENSIONS` lists all).
            joints: Names of the joints, in the order wanted.

        Returns:
            A new array of shape (N, len(joints)), in SI units.

        Raises:
            RecordingError: a column is absent, or the kind is not known.
        """
        if isinstance(joints, str):
            raise RecordingError(f"channel({kind!r}, {joints!r}): joints must be a sequence, as [{joints!r}]")
        if kind not in DIMENSIONS:
            raise RecordingError(f"no kind of signal is called {kind!r}; there are {', '.join(DIMENSIONS)}")
        table = np.empty((self.samples, len(joints)))
        for i, joint in enumerate(joints):
            name = f"{kind}_{joint}"
            if name not in self.columns:
                raise RecordingError(self._absent(name, joint))
            table[:, i] = self.columns[name]
        return table

    def crop(self, start: float | None = None, stop: float | None = None) -> "Recording":
        """The samples with start <= time <= stop.

        Args:
            start: First time kept [s]; from the beginning by default.
            stop: Last time kept [s]; to the end by default.

        Returns:
            A new recording; times are not shifted.

        Raises:
            RecordingError: fewer than two samples lie in the window.
        """
        first = 0 if start is None else int(np.searchsorted(self.time, start, side="left"))
        last = self.samples if stop is None else int(np.searchsorted(self.time, stop, side="right"))
        if last - first < 2:
            raise RecordingError(
                f"{self.source}: only {max(last - first, 0)} of {self.samples} samples lie between "
                f"start {start} s and stop {stop} s; the recording runs from {self.time[0]:g} s to {self.time[-1]:g} s"
            )
        columns = {name: values[first:last] for name, values in self.columns.items()}
        return Recording(self.time[first:last], columns, self.source, self._given_warnings(), self.notes)

    def replace_columns(self, columns: Mapping[str, ArrayLike]) -> "Recording":
        """A copy in which the given columns, shape (N,) each, replace those of the same name or are added.

        Raises:
            RecordingError: as on construction.
        """
        arrays = {name: np.asarray(values, dtype=np.float64) for name, values in columns.items()}
        return Recording(self.time, {**self.columns, **arrays}, self.source, self._given_warnings(), self.notes)

    def summary(self) -> str:
        """Text for people: extent, joints, range of every column, warnings and notes."""
        spacing = "uniform" if self.is_uniform else "not uniform"
        lines = [
            f"Recording {self.source}",
            f"  {self.samples} samples over {self.duration:g} s (from {self.time[0]:g} s), "
            f"{self.sample_rate:.6g} Hz, {spacing}",
            f"  joints: {', '.join(self.joints) or 'none with a column q_<joint>'}",
        ]
        width = max((len(name) for name in self.columns), default=0)
        for name, values in self.columns.items():
            unit = SI_UNITS.get(dimension_of(name) or "", "unit not known")
            lines.append(f"  {name:<{width}}  {values.min():>12.5g} to {values.max():>12.5g}  [{unit}]")
        lines += [f"  warning: {text}" for text in self.warnings]
        lines += [f"  note: {text}" for text in self.notes]
        return "\n".join(lines)

    def _given_warnings(self) -> tuple[str, ...]:
        """The warnings without those found in the data, which a changed copy finds anew."""
        found = _warnings(self.time, self.columns, self.source)
        return tuple(text for text in self.warnings if text not in found)

    def _absent(self, name: str, joint: str) -> str:
        # a column of this project's names that is another joint's is meant as that
        foreign = [column for column in self.columns if (split_name(column) or ("", ""))[1] not in self.joints]
        near = get_close_matches(name, foreign, n=1, cutoff=0.8)
        hint = f" Did you mean {near[0]}?" if near else ""
        return (
            f"{self.source}: joint {joint!r} needs column {name}, which is absent.{hint} "
            f"There are: time, {', '.join(self.columns) or 'nothing else'}. "
            f"A column with another name is translated by columns={{'{name}': <name in the file>}}, on the command "
            f"line by --column {name}=<name in the file>.{self._without(name, joint)}"
        )

    def _without(self, name: str, joint: str) -> str:
        """What to do where there is no such column under another name either."""
        own = {kind for kind, other in filter(None, map(split_name, self.columns)) if other == joint}
        if not own:
            return (
                f" If {joint!r} was held still and not recorded, leave it out of the joints that move (joints of "
                "load_robot, on the command line identify --joints)."
            )
        if name.startswith("theta_") and "q" in own:
            return (
                " If there is no spring between its motor and its link, describe its transmission as "
                "transmission_interface/SimpleTransmission; of an elastic joint both sides must be measured."
            )
        return ""


def _own(values: object, name: str, source: str) -> FloatArray:
    """A read-only copy in float64, one-dimensional."""
    try:
        array = np.asarray(values)
    except ValueError as error:
        raise RecordingError(f"{source}: column {name} is not an array of numbers: {error}") from error
    if array.dtype.kind not in "biuf":
        raise RecordingError(f"{source}: column {name} holds {array.dtype} instead of real numbers")
    if array.ndim != 1:
        raise RecordingError(f"{source}: column {name} has shape {array.shape}; it must be one value per sample")
    owned: FloatArray = np.array(array, dtype=np.float64)
    owned.setflags(write=False)
    return owned


def _check_name(name: object, source: str) -> None:
    if not isinstance(name, str) or not name or not name.isprintable() or name != name.strip():
        raise RecordingError(f"{source}: {name!r} is no column name; it must be printable, without outer blanks")
    if name == TIME:
        raise RecordingError(f"{source}: 'time' is given twice, as the time and among the columns")


def _check_finite(values: FloatArray, name: str, source: str, time: FloatArray | None) -> None:
    bad = np.flatnonzero(~np.isfinite(values))
    if bad.size:
        k = int(bad[0])
        at = "" if time is None else f" (time {time[k]:g} s)"
        raise RecordingError(
            f"{source}: column {name} is {values[k]} at sample {k}{at}; {bad.size} of {values.size} samples "
            "are not finite. Nothing is filled in: cut the recording, or repair it where it was made"
        )


def _check_time(time: FloatArray, source: str) -> None:
    if time.size < 2:
        raise RecordingError(f"{source}: {time.size} samples; a recording has at least 2")
    _check_finite(time, TIME, source, None)
    if np.max(np.abs(time)) > LARGEST_VALUE:
        k = int(np.argmax(np.abs(time)))
        raise RecordingError(
            f"{source}: time is {time[k]:g} s at sample {k}, with a median interval of "
            f"{float(np.median(np.diff(time))):g} s; {_clock(float(np.median(np.diff(time))))}"
        )
    falls = np.flatnonzero(np.diff(time) <= 0.0)
    if falls.size:
        k = int(falls[0])
        what = "repeats" if time[k + 1] == time[k] else "falls"
        equal = int(np.count_nonzero(np.diff(time) == 0.0))
        why = "Put rows in order, or split a log that was restarted"
        if equal == falls.size:
            why = (
                "Remove repeated rows, or write time with more digits; of samples that were taken evenly and stamped "
                "coarsely say the interval (ColumnSource('time', interval=0.001), on the command line --column "
                "'time=time,interval=0.001')"
            )
        raise RecordingError(
            f"{source}: time {what} at sample {k + 1}: {float(time[k])!r} s, then {float(time[k + 1])!r} s. "
            f"It must rise strictly; {falls.size} of {time.size - 1} steps do not ({equal} repeat a time). "
            f"{why}"
        )
    interval = float(np.median(np.diff(time)))
    if interval < SHORTEST_INTERVAL:
        raise RecordingError(f"{source}: the median interval of time is {interval:g} s; is time in seconds?")


def _check_column(values: FloatArray, name: str, time: FloatArray, source: str) -> None:
    if values.size != time.size:
        raise RecordingError(f"{source}: column {name} has {values.size} samples, but time has {time.size}")
    _check_finite(values, name, source, time)
    if dimension_of(name) is not None and np.max(np.abs(values)) > LARGEST_VALUE:
        k = int(np.argmax(np.abs(values)))
        unit = SI_UNITS[dimension_of(name) or TIME]
        raise RecordingError(
            f"{source}: column {name} is {values[k]:g} {unit} at sample {k} (time {time[k]:g} s), which no "
            "robot does: the file is damaged, or the column is in another unit (see ColumnSource)"
        )


def _warnings(time: FloatArray, columns: Mapping[str, FloatArray], source: str) -> list[str]:
    found = []
    for name, values in columns.items():
        parts = split_name(name)
        if parts is not None and parts[0] in ("q", "theta"):
            steps = np.abs(np.diff(values))
            jumps = np.flatnonzero(np.abs(steps - 2.0 * np.pi) < WRAP_TOLERANCE)
            if jumps.size and float(np.median(steps)) < WRAP_TOLERANCE:
                k = int(jumps[0])
                found.append(
                    f"{source}: column {name} jumps by a whole turn after sample {k} (time {time[k]:g} s), and "
                    f"{jumps.size} times in all; if the sensor wraps around, say where, in the unit of the file: "
                    f"ColumnSource({name!r}, wraps_at=6.283185307), on the command line --column "
                    f"'{name}={name},wraps_at=6.283185307'"
                )
    unknown = [name for name in columns if split_name(name) is None]
    if unknown:
        found.append(
            f"{source}: column names not known, kept as they are: {', '.join(unknown)}; "
            f"known are <kind>_<joint> with the kinds {', '.join(DIMENSIONS)}"
        )
    steps = np.diff(time)
    median = float(np.median(steps))
    gaps = np.flatnonzero(steps > GAP_FACTOR * median)
    if gaps.size:
        k = int(np.argmax(steps))
        found.append(
            f"{source}: {gaps.size} gaps in time, the longest of {steps[k]:g} s after sample {k} "
            f"(time {time[k]:g} s), where the median interval is {median:g} s"
        )
    slow = slower_than_any(time, columns)
    if median >= SLOWEST_CLOCK:
        found.append(f"{source}: the median interval is {median:g} s; {_clock(median)}")
    elif slow is not None:
        found.append(f"{source}: {slow}")
    return found


def slower_than_any(time: FloatArray, columns: Mapping[str, FloatArray]) -> str | None:
    """What time is written in where positions move as slowly as no robot that is to be identified does.

    Args:
        time: (N,) [s].
        columns: samples (N,) by name; links count.

    Returns:
        How fast they move and what to say of time; None where time may be in seconds.
    """
    interval = float(np.median(np.diff(time)))
    links = [values for name, values in columns.items() if (split_name(name) or ("", ""))[0] == "q"]
    if interval < FASTEST_LOG or time[-1] - time[0] < LONG or not links:
        return None
    span = time[SPEED_SAMPLES:] - time[:-SPEED_SAMPLES]
    fastest = max(
        float(np.max(np.abs(values[SPEED_SAMPLES:] - values[:-SPEED_SAMPLES]) / span, initial=0.0)) for values in links
    )
    if not 0.0 < fastest < SLOW:
        return None
    return f"no position moves faster than {fastest:.2g} rad/s or m/s: {_clock(interval)}"


def _clock(interval: float) -> str:
    """What to say of time with a median interval [s] that is too long."""
    unit, name = ("ms", "milliseconds") if interval < 100.0 else ("us", "microseconds")
    unit, name = (unit, name) if interval < 1e5 else ("ns", "nanoseconds")
    return (
        f"if time is in {name}, say columns={{'time': ColumnSource('time', unit='{unit}')}}, on the command line "
        f"--column time=time,unit={unit}"
    )
