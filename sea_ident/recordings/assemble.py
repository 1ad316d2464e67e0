"""From the raw columns of a file to a Recording, by the user's translation."""

from collections.abc import Mapping
from difflib import get_close_matches

from sea_ident._typing import FloatArray
from sea_ident.exceptions import RecordingError
from sea_ident.recordings.arrays import RawTable
from sea_ident.recordings.columns import ColumnSource, convert, describe
from sea_ident.recordings.naming import TIME, dimension_of
from sea_ident.recordings.recording import Recording

_TIME_ELSEWHERE = ("t", "time", "time_s", "timestamp", "stamp", "secs", "seconds")


def assemble(table: RawTable, columns: Mapping[str, ColumnSource] | None, source: str) -> Recording:
    """Build a recording from the columns of a file.

    Without a translation every column is taken as it is. With one, the translated columns come first, then
    those of the file that bear a name of the project already and are not used by the translation; the others
    are left out and noted.

    Args:
        table: Columns of the file.
        columns: Column of the recording -> where it comes from.
        source: File name for messages.

    Returns:
        The recording.

    Raises:
        RecordingError: a column is absent or malformed.
    """
    raw = table.columns
    left_out = list(table.left_out)
    if columns is None:
        if TIME not in raw:
            raise RecordingError(_no_time(raw, source))
        rest = {name: values for name, values in raw.items() if name != TIME}
        return Recording(raw[TIME], rest, source, notes=_left_out(left_out))
    converted: dict[str, FloatArray] = {}
    notes = []
    for target, how in columns.items():
        if how.name not in raw:
            raise RecordingError(absent(how.name, target, raw, source))
        converted[target] = convert(raw[how.name], target, how)
        notes.append(describe(target, how))
    used = {how.name for how in columns.values()}
    for name, values in raw.items():
        if name in used or name in converted:
            continue
        if dimension_of(name) is None:
            left_out.append(name)
        else:
            converted[name] = values
    if TIME not in converted:
        raise RecordingError(_no_time(raw, source))
    return Recording(converted.pop(TIME), converted, source, notes=(*notes, *_left_out(left_out)))


def absent(name: str, target: str, raw: Mapping[str, FloatArray], source: str) -> str:
    """Message for a column of the translation that the file does not have."""
    near = get_close_matches(name, raw, n=1, cutoff=0.6)
    hint = f" Did you mean {near[0]!r}?" if near else ""
    return f"{source}: no column {name!r} (wanted for {target}).{hint} There are: {', '.join(raw) or 'none'}"


def _no_time(raw: Mapping[str, FloatArray], source: str) -> str:
    near = [name for name in raw if name.strip().lower() in _TIME_ELSEWHERE]
    example = near[0] if near else "<name in the file>"
    return (
        f"{source}: no column 'time'; there are: {', '.join(raw) or 'none'}. If it has another name, say "
        f"columns={{'time': {example!r}}}"
    )


def _left_out(names: list[str]) -> tuple[str, ...]:
    return (f"left out of the file: {', '.join(names)}",) if names else ()
