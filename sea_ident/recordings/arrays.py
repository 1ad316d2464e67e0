"""Arrays of the formats that hold more than columns (NPZ, MAT, HDF5) as named columns."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sea_ident._typing import FloatArray
from sea_ident.exceptions import RecordingError
from sea_ident.recordings.naming import dimension_of

MOST_COLUMNS_OF_AN_ARRAY = 1000
"""A two-dimensional array with more columns than this is no table of signals."""


@dataclass(frozen=True, eq=False)
class RawTable:
    """The columns of a file as they stand there, `time` among them, in the order of the file.

    Attributes:
        columns: Name to samples; columns with clocks of their own may differ in length.
        left_out: What else is in the file (texts, single numbers), for the notes.
    """

    columns: Mapping[str, FloatArray]
    left_out: tuple[str, ...] = ()


def table_of_arrays(arrays: Iterable[tuple[str, NDArray[np.generic]]], source: str) -> RawTable:
    """Name the columns of arrays.

    One row or column of N samples keeps the name of the array; N samples of k signals become `name[0]`,
    `name[1]`, ..., the longer side being time. Texts, single numbers and arrays of more dimensions are left
    out.

    Args:
        arrays: Name and array.
        source: File name for messages.

    Returns:
        The table.

    Raises:
        RecordingError: an array of Python objects, a name of the project that holds no real numbers, or a
            name that appears twice.
    """
    columns: dict[str, FloatArray] = {}
    left_out: list[str] = []
    for name, array in arrays:
        if array.dtype.hasobject:
            raise RecordingError(f"{source}: array {name!r} holds objects, never unpickled; save arrays of numbers")
        problem = _problem(array)
        if problem:
            if dimension_of(name) is not None:
                raise RecordingError(f"{source}: array {name!r} {problem} instead of one real number per sample")
            left_out.append(f"{name} ({problem})")
            continue
        for part, values in _split(name, np.asarray(array, dtype=np.float64)):
            if part in columns:
                raise RecordingError(f"{source}: array {part!r} appears twice")
            columns[part] = values
    return RawTable(columns, tuple(left_out))


def _problem(array: NDArray[np.generic]) -> str:
    if array.dtype.kind not in "biuf":
        return f"holds {array.dtype.name if array.dtype.kind not in 'US' else 'text'}"
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
