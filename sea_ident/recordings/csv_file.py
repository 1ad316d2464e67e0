"""CSV: one header row with the column names, then one row of numbers per sample, separated by commas."""

import csv
import gzip
import io
import re
import zlib
from collections.abc import Callable, Collection
from contextlib import AbstractContextManager, suppress
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.exceptions import RecordingError
from sea_ident.recordings.naming import TIME, dimension_of
from sea_ident.recordings.recording import Recording
from sea_ident.recordings.table import MOST_COLUMNS, RawTable, check_size, is_wanted

LONGEST_HEADER = 1_000_000
"""Characters in the header row."""

MISSING = frozenset(["na", "n/a", "null", "none", "nil", "missing", "-", "--", "?"])
"""What programs write for a number that they do not have."""

_DATE = re.compile(r"\d{4}[-/.]\d{1,2}[-/.]\d{1,2}|\d{1,2}[-/.]\d{1,2}[-/.]\d{4}|\d{1,2}:\d{2}")
_ROWS_AT_ONCE = 8192
_COPIES = 3


def read_csv(path: Path, names: Collection[str] | None, memory_limit: int) -> RawTable:
    """Read the columns of a CSV file.

    A byte-order mark, CRLF line ends, blank lines, quotes and lines that start with # before the header are
    fine. Columns of text or with empty cells that bear no name of the project are left out.

    Args:
        path: The file.
        names: Columns wanted besides those that bear a name of the project; all if None.
        memory_limit: Bytes that the file may take, counting the copies made on the way.

    Returns:
        The table.

    Raises:
        RecordingError: not a CSV file with a header of names and rows of numbers; says the line and column.
    """
    check_size(_COPIES * path.stat().st_size, memory_limit, path)
    return _table(path.read_bytes(), partial(open, path, encoding="utf-8-sig"), names, path)


def read_packed_csv(path: Path, names: Collection[str] | None, memory_limit: int) -> RawTable:
    """Read the columns of a CSV file that gzip packed; as `read_csv`.

    Raises:
        RecordingError: also if it cannot be unpacked, or takes more than the limit then.
    """
    most = memory_limit // _COPIES
    try:
        with gzip.open(path) as file:
            data = file.read(most + 1)
    except (OSError, EOFError, zlib.error) as error:
        raise RecordingError(f"{path}: cannot be unpacked, it is damaged or no gzip file: {error}") from error
    check_size(_COPIES * len(data), memory_limit, path)
    return _table(data, partial(gzip.open, path, "rt", encoding="utf-8-sig"), names, path)


def _table(
    data: bytes, opened: Callable[[], AbstractContextManager[Any]], names: Collection[str] | None, path: Path
) -> RawTable:
    text = _decode(data, path)
    header, start, first_line = _header(text, path)
    wanted = [i for i, name in enumerate(header) if is_wanted(name, names)]
    if not wanted:
        raise RecordingError(
            f"{path}: none of the columns asked for ({', '.join(sorted(names or ()))}). There are: {', '.join(header)}"
        )
    body = text[start:].rstrip()
    if not body:
        raise RecordingError(f"{path}: a header, but no rows of numbers")
    table = None
    left_out = {i: name for i, name in enumerate(header) if i not in wanted}
    optional = {i for i in wanted if names is None and dimension_of(header[i]) is None}
    first = [cell.strip() for cell in body[: body.find("\n") if "\n" in body else None].split(",")]
    for i in sorted(optional):
        if len(first) == len(header) and not _is_number(first[i]):
            left_out[i] = _no_numbers(header[i], first[i], first_line)
            wanted.remove(i)
    if '"' not in body and _rectangular(body, len(header)):
        with suppress(ValueError), opened() as file:
            table = np.loadtxt(
                file,
                delimiter=",",
                skiprows=first_line - 1,
                comments=None,
                ndmin=2,
                usecols=None if len(wanted) == len(header) else wanted,
            )
    if table is None:
        table, texts = _parse_slowly(body, header, wanted, optional, first_line, path)
        left_out |= texts
    columns = {header[i]: table[:, k] for k, i in enumerate(wanted) if i not in left_out}
    return RawTable(columns, left_out=tuple(left_out[i] for i in sorted(left_out)))


def _no_numbers(name: str, cell: str, line: int) -> str:
    """What to note of a column that is left out."""
    return f"{name} ({'is empty' if not cell else f'holds {cell[:30]!r}'} in line {line})"


def write_csv(recording: Recording, path: Path) -> None:
    """Write a recording; every number is the shortest text that reads back as the same number.

    Args:
        recording: What to write.
        path: File to be created.
    """
    with open(path, "w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerow([TIME, *recording.columns])
        table = np.column_stack([recording.time, *recording.columns.values()])
        for start in range(0, len(table), _ROWS_AT_ONCE):
            rows = table[start : start + _ROWS_AT_ONCE].tolist()
            file.write("\n".join([",".join(map(repr, row)) for row in rows]) + "\n")


def _decode(data: bytes, path: Path) -> str:
    if not data:
        raise RecordingError(f"{path}: the file is empty")
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        raise RecordingError(f"{path}: the text is UTF-16; save it as UTF-8")
    if b"\0" in data:
        raise RecordingError(f"{path}: holds binary data (a zero byte at {data.index(0)}); is it a CSV file?")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise RecordingError(
            f"{path}, line {line}: byte 0x{data[error.start]:02x} at {error.start} is not UTF-8 text; "
            "is it a CSV file? If so, save it as UTF-8"
        ) from error
    return text.replace("\r\n", "\n").replace("\r", "\n") if "\r" in text else text


def _header(text: str, path: Path) -> tuple[list[str], int, int]:
    """Column names, where the rows start, and the number of the line after the header."""
    start, line, above = 0, 1, ""
    while True:
        end = text.find("\n", start)
        end = len(text) if end < 0 else end
        row = text[start:end].strip()
        if row and not row.startswith("#"):
            break
        if end == len(text):
            raise RecordingError(f"{path}: no header row with column names")
        start, line, above = end + 1, line + 1, row or above
    if len(row) > LONGEST_HEADER:
        raise RecordingError(f"{path}, line {line}: a header row of {len(row)} characters; is it a CSV file?")
    try:
        header = [name.strip() for name in next(csv.reader([row], strict=True))]
    except csv.Error as error:
        raise RecordingError(f"{path}, line {line}: the header row cannot be read: {error}") from error
    _check_header(header, row, above, line, path)
    return header, min(end + 1, len(text)), line + 1


def _check_header(header: list[str], row: str, above: str, line: int, path: Path) -> None:
    where = f"{path}, line {line}"
    if len(header) == 1:
        for delimiter, name in ((";", "semicolons"), ("\t", "tabs"), ("|", "bars")):
            if delimiter in row:
                raise RecordingError(
                    f"{where}: the columns are separated by {name}; commas are needed, and decimal points. "
                    f"Export again, or replace decimal commas by '.' where there are any, then {delimiter!r} by ','"
                )
    if len(header) > MOST_COLUMNS:
        raise RecordingError(f"{where}: {len(header)} columns; at most {MOST_COLUMNS} are read")
    if all(_is_number(name) for name in header):
        if above.count(",") == len(header) - 1:
            raise RecordingError(
                f"{where}: numbers instead of column names; the line above it looks like the header, but starts with "
                "#, as comments do: take the # away"
            )
        raise RecordingError(f"{where}: numbers instead of column names; add a header row such as time,q_hip")
    if len(header) == 1:
        why = "time and at least one are needed"
        if len(row.split()) > 1:
            why += ", separated by commas. Are they separated by blanks, or is this a title? Start titles with #"
        raise RecordingError(f"{where}: only one column, {header[0][:60]!r}; {why}")
    seen: dict[str, int] = {}
    for i, name in enumerate(header):
        if not name:
            why = "an index that a program wrote before the columns? (pandas: to_csv(..., index=False))"
            if i == len(header) - 1:
                why = "is there a comma at the end of every line?"
            raise RecordingError(
                f"{where}: column {i + 1} of {len(header)} has no name; {why} Name it, or take it out of the file"
            )
        if name in seen:
            raise RecordingError(f"{where}: column {name!r} twice, as number {seen[name] + 1} and {i + 1}")
        seen[name] = i


def _rectangular(body: str, width: int) -> bool:
    """Whether every row has as many cells as there are columns; numpy does not look where it reads some only."""
    data = np.frombuffer(body.encode(), dtype=np.uint8)
    marks = data[(data == ord(",")) | (data == ord("\n"))]
    if (marks.size + 1) % width:
        return False
    rows = np.append(marks, np.uint8(ord("\n"))).reshape(-1, width)
    return bool(np.all(rows[:, -1] == ord("\n")) and np.all(rows[:, :-1] == ord(",")))


def _parse_slowly(
    body: str, header: list[str], wanted: list[int], optional: Collection[int], line: int, path: Path
) -> tuple[FloatArray, dict[int, str]]:
    """Parse cell by cell, to handle quotes and to say exactly what is wrong where.

    Returns:
        The table, and what to note of optional columns that do not hold numbers alone, by their number.
    """
    texts: dict[int, str] = {}
    blocks: list[FloatArray] = []
    rows: list[list[float]] = []
    reader = csv.reader(io.StringIO(body), strict=True, skipinitialspace=True)
    try:
        for cells in reader:
            if not cells or (len(cells) == 1 and not cells[0].strip()):
                continue
            where = f"{path}, line {line + reader.line_num - 1}"
            if len(cells) != len(header):
                raise RecordingError(_ragged(cells, header, where))
            for i in optional:
                if i not in texts and not _is_number(cells[i].strip()):
                    texts[i] = _no_numbers(header[i], cells[i].strip(), line + reader.line_num - 1)
            rows.append([np.nan if i in texts else _number(cells[i], header[i], where) for i in wanted])
            if len(rows) == _ROWS_AT_ONCE:
                blocks.append(np.array(rows, dtype=np.float64))
                rows.clear()
    except csv.Error as error:
        raise RecordingError(f"{path}, line {line + reader.line_num - 1}: cannot be read: {error}") from error
    if rows:
        blocks.append(np.array(rows, dtype=np.float64))
    return np.concatenate(blocks), texts


def _ragged(cells: list[str], header: list[str], where: str) -> str:
    message = f"{where}: {len(cells)} cells, but the header names {len(header)} columns"
    if cells[0].lstrip().startswith("#"):
        return message + "; a comment stands above the header only: remove this one"
    if len(cells) == len(header) + 1 and not cells[-1].strip():
        return message + "; there is a comma at the end of the row: remove it, or add one to the header"
    if len(cells) > len(header):
        return message + "; are there decimal commas? Numbers need a decimal point"
    return message + "; is the file cut off here?"


def _number(cell: str, name: str, where: str) -> float:
    text = cell.strip()
    if not text or text.lower() in MISSING:
        what = f"holds {text!r}" if text else "is empty"
        raise RecordingError(
            f"{where}: column {name} {what}. Nothing is filled in: cut the recording, or, if columns have clocks of "
            "their own, write them to a format with columns of different length (NPZ, MAT, HDF5)"
        )
    if not _is_number(text):
        why = "remove rows that hold none, as one of units"
        if _DATE.search(text):
            why = "dates and times of day are not read: write seconds"
        elif text == name:
            why = "the header stands here again: are these several recordings? Split the file"
        raise RecordingError(f"{where}: column {name} holds {text[:60]!r} instead of a number; {why}")
    return float(text)


def _is_number(text: str) -> bool:
    # float() also takes 1_000 and digits of other scripts, which no other reader of CSV does.
    if "_" in text or not text.isascii():
        return False
    try:
        float(text)
    except ValueError:
        return False
    return True
