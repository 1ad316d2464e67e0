"""The contents of a file before translation: named columns, and which clock each belongs to."""

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sea_ident._typing import FloatArray
from sea_ident.exceptions import RecordingError
from sea_ident.recordings.naming import dimension_of

MOST_COLUMNS = 10_000
"""Columns in a file."""

MOST_COLUMNS_OF_AN_ARRAY = 1000
"""A two-dimensional array with more columns than this is no table of signals."""


@dataclass(frozen=True, eq=False)
class RawTable:
    """The columns of a file as they stand there, in the order of the file.

    Attributes:
        columns: Name to samples; columns with clocks of their own may differ in length.
        clocks: Column -> name of its time column [s], for formats that know (bags); others belong to `time`.
        left_out: What else is in the file (texts, single numbers, other topics), for the notes.
        notes: What the reader did.
    """

    columns: Mapping[str, FloatArray]
    clocks: Mapping[str, str] = field(default_factory=dict)
    left_out: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


def table_of_arrays(
    arrays: Iterable[tuple[str, NDArray[np.generic]]], source: str, left_out: Iterable[str] = ()
) -> RawTable:
    """Name the columns of arrays.

    One row or column of N samples keeps the name of the array; N samples of k signals become `name[0]`,
    `name[1]`, ..., the longer side being time. Texts, single numbers and arrays of more dimensions are left
    out.

    Args:
        arrays: Name and array.
        source: File name for messages.
        left_out: What the reader of the format left out already.

    Returns:
        The table.

    Raises:
        RecordingError: a name of the project that holds no real numbers, or a name that appears twice.
    """
    columns: dict[str, FloatArray] = {}
    others = list(left_out)
    for name, array in arrays:
        problem = _problem(array)
        if problem:
            others.append(refuse_or_leave_out(name, problem, source))
            continue
        for part, values in _split(name, np.asarray(array, dtype=np.float64)):
            if part in columns:
                raise RecordingError(f"{source}: array {part!r} appears twice")
            columns[part] = values
        if len(columns) > MOST_COLUMNS:
            raise RecordingError(f"{source}: more than {MOST_COLUMNS} columns; is it a recording?")
    return RawTable(columns, left_out=tuple(others))


def is_wanted(name: str, names: Collection[str] | None) -> bool:
    """Whether a column of a file is to be read.

    Args:
        name: The column.
        names: Columns asked for, in which one `*` may stand for any text; all if None.

    Returns:
        True as well for every column that bears a name of the project.
    """
    if names is None or name in names or dimension_of(name) is not None:
        return True
    parts = [pattern.split("*", 1) for pattern in names if "*" in pattern]
    return any(name.startswith(before) and name.endswith(after) for before, after in parts)


def check_size(size: int, memory_limit: int, path: Path) -> None:
    """Refuse what would not fit into memory, before anything is allocated.

    Args:
        size: Bytes that the contents take, as far as the file says.
        memory_limit: Bytes that they may take.
        path: The file, for messages.

    Raises:
        RecordingError: it is too large.
    """
    if size > memory_limit:
        raise RecordingError(
            f"{path}: holds {size} bytes, over the limit of {memory_limit}; if that is right, raise memory_limit"
        )


def refuse_or_leave_out(name: str, problem: str, source: str) -> str:
    """What to note about an array that is no column.

    Args:
        name: Name of the array.
        problem: Why it is none, such as `holds text`.
        source: File name for messages.

    Returns:
        The note.

    Raises:
        RecordingError: the name is one of the project, so that it should have been a column.
    """
    if dimension_of(name) is not None:
        raise RecordingError(f"{source}: array {name!r} {problem} instead of one number per sample")
    return f"{name} ({problem})"


def _problem(array: NDArray[np.generic]) -> str:
    if array.dtype.kind not in "biuf":
        return "holds text" if array.dtype.kind in "US" else f"holds {array.dtype.name}"
    if array.ndim == 0 or (array.ndim == 2 and array.size == 1):
        return "is a single number"
    if array.ndim > 2 or (array.ndim == 2 and min(array.shape) > MOST_COLUMNS_OF_AN_ARRAY):
        return f"has shape {array.shape}"
    return ""


def _split(name: str, values: FloatArray) -> Iterator[tuple[str, FloatArray]]:
    if values.ndim == 2 and 1 in values.shape:
        values = values.reshape(-1)
    if values.ndim == 1:
        yield name, values
        return
    table = values if values.shape[0] >= values.shape[1] else values.T
    for k in range(table.shape[1]):
        yield f"{name}[{k}]", table[:, k]
