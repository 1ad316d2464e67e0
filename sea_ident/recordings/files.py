"""One entry point for reading and one for writing; the suffix decides the format."""

import warnings
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from sea_ident.exceptions import RecordingError, SeaIdentError, SeaIdentWarning
from sea_ident.recordings import csv_file, npz_file
from sea_ident.recordings.arrays import RawTable
from sea_ident.recordings.assemble import assemble
from sea_ident.recordings.atomic import atomic_file
from sea_ident.recordings.columns import ColumnSource, as_source
from sea_ident.recordings.recording import Recording

DEFAULT_MEMORY_LIMIT = 2**31
"""Bytes that the contents of one file may take up."""

SUFFIXES = (".csv", ".npz")


def read_recording(
    path: str | Path,
    *,
    columns: Mapping[str, str | ColumnSource] | None = None,
    memory_limit: int = DEFAULT_MEMORY_LIMIT,
) -> Recording:
    """Read a recording; the suffix decides the format.

    Args:
        path: The file.
        columns: Column of the recording -> name in the file, or `ColumnSource` with its unit, gear and so on.
            Columns of the file that bear a name of the project already need no entry.
        memory_limit: Refuse files whose contents take more than this [bytes].

    Returns:
        The recording, checked, in SI units. What a user should know is in its `warnings` (also raised as
        SeaIdentWarning), what was done on reading in its `notes`.

    Raises:
        RecordingError: the file cannot be read, or its contents are no recording; says where and what to do.
        MissingExtraError: the format needs a package that is not installed.
    """
    path = Path(path)
    sources = None if columns is None else {target: as_source(value) for target, value in columns.items()}
    with _errors_of_libraries(path) as found:
        table = _read(path, sources, memory_limit)
    recording = assemble(table, sources, str(path))
    if found:
        recording = replace(recording, warnings=(*recording.warnings, *found))
    for text in recording.warnings:
        warnings.warn(text, SeaIdentWarning, stacklevel=2)
    return recording


def write_recording(recording: Recording, path: str | Path) -> None:
    """Write a recording; the suffix decides the format. The file is complete or does not appear.

    Args:
        recording: What to write.
        path: File to be written; one that exists is replaced.

    Raises:
        RecordingError: the suffix is not known, or the file cannot be written.
        MissingExtraError: the format needs a package that is not installed.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    with atomic_file(path) as temporary:
        if suffix == ".csv":
            csv_file.write_csv(recording, temporary)
        elif suffix == ".npz":
            npz_file.write_npz(recording, temporary)
        else:
            raise RecordingError(_unknown_suffix(path))


def _read(path: Path, sources: Mapping[str, ColumnSource] | None, memory_limit: int) -> RawTable:
    names: Collection[str] | None = None if sources is None else {how.name for how in sources.values()}
    suffix = path.suffix.lower()
    if path.is_dir():
        raise RecordingError(f"{path} is a folder")
    if not path.is_file():
        near = sorted(other.name for other in path.parent.glob("*") if other.suffix in SUFFIXES)[:10]
        hint = f"; that folder has {', '.join(near)}" if near else ""
        raise RecordingError(f"{path}: no such file{hint}")
    size = path.stat().st_size
    if size > memory_limit:
        raise RecordingError(f"{path}: {size} bytes, over the limit of {memory_limit}; see memory_limit")
    if suffix == ".csv":
        return csv_file.read_csv(path, names)
    if suffix == ".npz":
        return npz_file.read_npz(path, memory_limit)
    raise RecordingError(_unknown_suffix(path))


def _unknown_suffix(path: Path) -> str:
    return f"{path}: the suffix {path.suffix!r} is not known; there are {', '.join(SUFFIXES)}"


@contextmanager
def _errors_of_libraries(path: Path) -> Iterator[list[str]]:
    """Turn whatever a library makes of a damaged file into a RecordingError, and collect its warnings.

    The border is the one place where every exception is caught: the libraries behind the formats promise
    nothing about which ones a damaged file leads to.
    """
    found: list[str] = []
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            yield found
        except SeaIdentError:
            raise
        except Exception as error:
            what = " ".join(str(error).split())[:300] or "no further explanation"
            raise RecordingError(
                f"{path}: cannot be read as {path.suffix.lower() or 'a recording'}: "
                f"{type(error).__name__}: {what}. "
                "The file is damaged, cut off, or of another format than its name says"
            ) from error
    found += [f"{path}: {' '.join(str(item.message).split())[:300]}" for item in caught]
