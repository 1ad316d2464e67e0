"""Parquet: one column of the table per column of the recording."""

from collections.abc import Collection
from pathlib import Path
from typing import Any

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.exceptions import MissingExtraError, RecordingError
from sea_ident.recordings.naming import TIME
from sea_ident.recordings.recording import Recording
from sea_ident.recordings.table import MOST_COLUMNS, RawTable, check_size, refuse_or_leave_out

_TICKS = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}


def read_parquet(path: Path, names: Collection[str] | None, memory_limit: int) -> RawTable:
    """Read the numeric columns of a Parquet file; times and durations become seconds.

    Args:
        path: The file.
        names: Not needed: columns are read anyway.
        memory_limit: Largest size of all columns together [bytes].

    Returns:
        The table.

    Raises:
        RecordingError: not a Parquet file of numeric columns, with missing values, or too large.
        MissingExtraError: pyarrow is not installed.
    """
    try:
        import pyarrow.parquet as parquet
    except ImportError as error:
        raise MissingExtraError("pyarrow", "parquet", f"{path}: reading Parquet") from error
    left_out: list[str] = []
    columns: dict[str, FloatArray] = {}
    with parquet.ParquetFile(path, page_checksum_verification=True) as file:
        schema = file.schema_arrow
        if len(schema) > MOST_COLUMNS:
            raise RecordingError(f"{path}: {len(schema)} columns; at most {MOST_COLUMNS} are read")
        groups = [file.metadata.row_group(i) for i in range(file.metadata.num_row_groups)]
        claimed = sum(max(group.total_byte_size, 8 * group.num_rows * len(schema)) for group in groups)
        check_size(max(claimed, 8 * file.metadata.num_rows * len(schema)), memory_limit, path)
        wanted = []
        for field in schema:
            if _seconds(field.type) is None:
                left_out.append(refuse_or_leave_out(field.name, f"holds {field.type}", str(path)))
            else:
                wanted.append(field.name)
        if len(set(schema.names)) != len(schema):
            raise RecordingError(f"{path}: two columns have the same name: {', '.join(schema.names)}")
        table = file.read(columns=wanted, use_threads=False)
    for name in wanted:
        columns[name] = _numbers(table.column(name), name, path)
    return RawTable(columns, left_out=tuple(left_out))


def write_parquet(recording: Recording, path: Path) -> None:
    """Write a recording.

    Args:
        recording: What to write.
        path: File to be created.

    Raises:
        MissingExtraError: pyarrow is not installed.
    """
    try:
        import pyarrow
        import pyarrow.parquet as parquet
    except ImportError as error:
        raise MissingExtraError("pyarrow", "parquet", "writing Parquet") from error
    table = pyarrow.table({TIME: recording.time, **recording.columns})
    parquet.write_table(table, path, write_page_checksum=True)


def _seconds(kind: Any) -> float | None:
    """Ticks per second of a time type, 1 for plain numbers, None for what is no number."""
    from pyarrow import types

    if types.is_timestamp(kind) or types.is_duration(kind):
        return _TICKS[kind.unit]
    return 1.0 if types.is_integer(kind) or types.is_floating(kind) or types.is_boolean(kind) else None


def _numbers(column: Any, name: str, path: Path) -> FloatArray:
    import pyarrow

    if column.null_count:
        row = next(k for k, empty in enumerate(column.is_null().to_pylist()) if empty)
        raise RecordingError(
            f"{path}: column {name} is empty at sample {row}; {column.null_count} of {len(column)} are. "
            "Nothing is filled in: cut the recording"
        )
    ticks = _seconds(column.type) or 1.0
    if pyarrow.types.is_temporal(column.type):
        column = column.cast(pyarrow.int64())
    values = np.asarray(column.to_numpy(), dtype=np.float64)
    return values if ticks == 1.0 else values / ticks
