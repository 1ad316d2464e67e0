"""From the raw columns of a file to a Recording, by the user's translation."""

import re
from collections.abc import Mapping
from dataclasses import replace
from difflib import get_close_matches

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.exceptions import RecordingError
from sea_ident.recordings.alignment import ClockAlignment, Stream, align_streams
from sea_ident.recordings.columns import ColumnSource, as_source, check_unit_in_name, convert, describe
from sea_ident.recordings.naming import TIME, dimension_of
from sea_ident.recordings.recording import Recording
from sea_ident.recordings.table import RawTable

_TIME_ELSEWHERE = re.compile(r"(t|time|timestamp|stamp|secs|seconds)\b|time_|t_")


def assemble(
    table: RawTable,
    columns: Mapping[str, ColumnSource] | None,
    clocks: ClockAlignment | None,
    source: str,
) -> Recording:
    """Build a recording from the columns of a file.

    Without a translation every column is taken as it is, but for those that bear no name of the project and hold NaN
    or another number of samples than time, which are left out and noted. With one, the translated columns come first,
    then those of the file that bear a name of the project already and are not used by the translation; the others
    are left out and noted.

    Args:
        table: Columns of the file.
        columns: Column of the recording -> where it comes from; one `*` on both sides stands for the same text.
        clocks: How columns of different clocks are brought together.
        source: File name for messages.

    Returns:
        The recording.

    Raises:
        RecordingError: a column is absent or malformed, or the clocks cannot be aligned.
    """
    raw = table.columns
    notes = list(table.notes)
    left_out = list(table.left_out)
    sources: dict[str, ColumnSource] = {}
    if columns is None:
        useless = _useless(table)
        left_out += useless.values()
        unused = {*table.clocks.values(), *useless}
        sources = {name: ColumnSource(name) for name in raw if name not in unused}
    else:
        sources = _expand(columns, table, source)
        notes += [describe(target, how) for target, how in sources.items()]
        for target, how in sources.items():
            check_unit_in_name(target, how, source)
        used = {how.name for how in sources.values()} | _time_names(sources, table)
        for name in raw:
            if name not in used and name not in sources:
                if dimension_of(name) is None:
                    left_out.append(name)
                else:
                    sources[name] = ColumnSource(name)
    if left_out:
        notes.append(f"left out of the file: {', '.join(left_out)}")
    streams = _streams(sources, table, source, translated=columns is not None)
    first = streams[0]
    if (clocks is None or clocks == ClockAlignment()) and all(
        np.array_equal(stream.time, first.time) for stream in streams
    ):
        together = {name: values for stream in streams for name, values in stream.columns.items()}
        return Recording(first.time, together, source, notes=tuple(notes))
    aligned = align_streams(streams, clocks, source=source).recording
    return replace(aligned, notes=(*notes, *aligned.notes))


def _useless(table: RawTable) -> dict[str, str]:
    """Columns that bear no name of the project and cannot be columns of a recording, with what to note of them."""
    found = {}
    for name, values in table.columns.items():
        if dimension_of(name) is not None or name in table.clocks.values():
            continue
        clock = table.columns.get(table.clocks.get(name, TIME))
        bad = np.flatnonzero(~np.isfinite(values))
        if bad.size:
            found[name] = f"{name} ({values[bad[0]]} at sample {bad[0]}, and {bad.size} times in all)"
        elif clock is not None and len(clock) != len(values):
            found[name] = f"{name} ({len(values)} values, where time has {len(clock)})"
    return found


def _expand(columns: Mapping[str, ColumnSource], table: RawTable, source: str) -> dict[str, ColumnSource]:
    """Replace entries with `*` by one entry per column that fits."""
    raw = table.columns
    found: dict[str, ColumnSource] = {}
    for target, how in columns.items():
        if "*" not in target:
            every = target == how.name == TIME and table.clocks  # of the clocks of a bag, none has that name
            if how.name not in raw and not every:
                raise RecordingError(_absent(how.name, target, table, source))
            found[target] = how
            continue
        if target.count("*") != 1 or how.name.count("*") != 1:
            raise RecordingError(f"columns: {target!r} from {how.name!r}: one * is needed on both sides")
        before, after = map(re.escape, how.name.split("*"))
        matches = [(name, re.fullmatch(f"{before}(.+){after}", name)) for name in raw]
        names = {target.replace("*", match[1]): name for name, match in matches if match is not None}
        known = {to: name for to, name in names.items() if dimension_of(to) is not None}
        if not known:
            raise RecordingError(_absent(how.name, target, table, source))
        for to, name in known.items():
            found.setdefault(to, replace(how, name=name))
    return found


def _time_names(sources: Mapping[str, ColumnSource], table: RawTable) -> set[str]:
    own = {as_source(how.time).name for how in sources.values() if how.time is not None}
    return own | set(table.clocks.values())


def _streams(sources: Mapping[str, ColumnSource], table: RawTable, source: str, *, translated: bool) -> list[Stream]:
    """Columns grouped by clock, converted."""
    raw = table.columns
    time = sources.get(TIME)
    if time is not None and table.clocks and time != ColumnSource(TIME, interval=time.interval):
        raise RecordingError(
            f"{source}: the messages of a bag have stamps of their own: of 'time' say no more than the interval that "
            "samples were taken at, if they were stamped late, and choose the clock that counts by "
            "clocks=ClockAlignment(reference=...)"
        )
    groups: dict[ColumnSource, dict[str, FloatArray]] = {}
    if time is not None and not table.clocks:
        groups[time] = {}
    for target, how in sources.items():
        if target == TIME:
            continue
        if how.time is not None:
            clock = as_source(how.time)
        elif how.name in table.clocks:
            clock = ColumnSource(table.clocks[how.name], interval=None if time is None else time.interval)
        elif time is not None:
            clock = time
        else:
            raise RecordingError(_no_time(table, source))
        if clock.name not in raw:
            raise RecordingError(_absent(clock.name, f"the time of {target}", table, source))
        values = convert(raw[how.name], target, how) if translated else raw[how.name]
        groups.setdefault(clock, {})[target] = values
    if not groups:
        raise RecordingError(_no_time(table, source))
    return [
        Stream(clock.name.removesuffix(":time"), convert(raw[clock.name], TIME, clock), values)
        for clock, values in groups.items()
        if values or len(groups) == 1
    ]


def _absent(name: str, target: str, table: RawTable, source: str) -> str:
    near = get_close_matches(name, table.columns, n=1, cutoff=0.6)
    hint = f" Did you mean {near[0]!r}?" if near else ""
    return f"{source}: no column {name!r} (wanted for {target}).{hint} There are: {_all(table)}"


def _no_time(table: RawTable, source: str) -> str:
    near = [name for name in (*table.columns, *table.left_out) if _TIME_ELSEWHERE.match(_last(name).strip().lower())]
    example = near[0] if near else "<name in the file>"
    inside = {_prefix(name) for name in table.columns}
    group = inside.pop() if len(inside) == 1 else ""
    more = f", and likewise --column 'q_*={group}q_*' and so on" if group else ""
    return (
        f"{source}: no column 'time'. If it has another name, say columns={{'time': {example!r}}}, on the command line "
        f"--column 'time={example}' (its unit too, if it is not s: ,unit=ms){more}. There are: {_all(table)}"
    )


def _prefix(name: str) -> str:
    """The groups or structures that a column is in."""
    return name[: len(name) - len(_last(name))]


def _last(name: str) -> str:
    """The name of a column without the groups or structures that it is in."""
    return re.split(r"[./]", name)[-1]


def _all(table: RawTable) -> str:
    return ", ".join((*table.columns, *table.left_out)) or "none"
