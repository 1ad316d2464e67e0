"""One entry point for reading and one for writing; the suffix decides the format."""

import warnings
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import Any

from sea_ident.arguments import as_path, expect, expect_optional, expect_whole
from sea_ident.atomic import atomic_directory, atomic_file
from sea_ident.exceptions import RecordingError, SeaIdentWarning
from sea_ident.recordings.alignment import ClockAlignment
from sea_ident.recordings.assemble import assemble
from sea_ident.recordings.border import errors_of_libraries
from sea_ident.recordings.columns import ColumnSource, as_source
from sea_ident.recordings.recording import Recording
from sea_ident.recordings.table import RawTable

DEFAULT_MEMORY_LIMIT = 2**31
"""Bytes that the contents of one file may take up."""


@dataclass(frozen=True)
class _Format:
    """`module:function` of the reader and the writer; imported when first used."""

    reader: str
    writer: str

    def read(self, path: Path, names: Collection[str] | None, memory_limit: int) -> RawTable:
        table: RawTable = _load(self.reader)(path, names, memory_limit)
        return table

    def write(self, recording: Recording, path: Path) -> None:
        _load(self.writer)(recording, path)


_HDF5 = _Format("hdf5_file:read_hdf5", "hdf5_file:write_hdf5")
_ROS2_BAG = _Format("ros_reader:read_ros2_bag", "ros_writer:write_ros2_bag")
_FORMATS = {
    ".csv": _Format("csv_file:read_csv", "csv_file:write_csv"),
    ".npz": _Format("npz_file:read_npz", "npz_file:write_npz"),
    ".mat": _Format("mat_file:read_mat", "mat_file:write_mat"),
    ".parquet": _Format("parquet_file:read_parquet", "parquet_file:write_parquet"),
    ".h5": _HDF5,
    ".hdf5": _HDF5,
    ".bag": _Format("ros_reader:read_ros1_bag", "ros_writer:write_ros1_bag"),
    ".mcap": _Format("ros_reader:read_ros2_bag", "ros_writer:write_mcap_file"),
    ".db3": _Format("ros_reader:read_ros2_bag", "ros_writer:write_sqlite_file"),
}

_PACKED_CSV = _Format("csv_file:read_packed_csv", "csv_file:write_csv")

SUFFIXES = tuple(_FORMATS)
"""Suffixes that are read and written; a ROS 2 bag is a folder."""


def read_recording(
    path: str | Path,
    *,
    columns: Mapping[str, str | ColumnSource] | None = None,
    clocks: ClockAlignment | None = None,
    memory_limit: int = DEFAULT_MEMORY_LIMIT,
) -> Recording:
    """Read a recording; the suffix decides the format, and a folder is a ROS 2 bag.

    Args:
        path: The file: `.csv`, also packed as `.csv.gz`, `.npz`, `.mat`, `.parquet`, `.h5`, `.hdf5`, `.bag`, `.mcap`,
            `.db3`, or a folder.
        columns: Column of the recording -> name in the file, or `ColumnSource` with its unit, gear and so on.
            One `*` on both sides stands for the same text: `{"q_*": ColumnSource("pos_*", unit="deg")}`. Columns
            of the file that bear a name of the project already need no entry.
        clocks: How columns of different clocks or rates are brought together; by default by
            interpolation at the sample times of the first clock, where all of them have data.
        memory_limit: Refuse files whose contents take more than this [bytes].

    Returns:
        The recording, checked, in SI units. What a user should know is in its `warnings` (also raised as
        SeaIdentWarning), what was done on reading in its `notes`.

    Raises:
        RecordingError: the file cannot be read, or its contents are no recording; says where and what to do.
        MissingExtraError: the format needs a package that is not installed.
    """
    path = as_path(path, "read_recording: path")
    expect_optional(clocks, "read_recording: clocks", ClockAlignment)
    expect_whole(memory_limit, "read_recording: memory_limit", least=1)
    sources = None if columns is None else _sources(columns)
    names = None if sources is None else _names(sources)
    with errors_of_libraries(path) as found:
        table = _format(path).read(path, names, memory_limit)
    # a name that is no text in the file system's encoding would stop every report that quotes it
    source = str(path).encode("utf-8", "backslashreplace").decode("utf-8")
    recording = assemble(table, sources, clocks, source)
    if found:
        recording = replace(recording, warnings=(*recording.warnings, *found))
    for text in recording.warnings:
        warnings.warn(text, SeaIdentWarning, stacklevel=2)
    return recording


def write_recording(recording: Recording, path: str | Path) -> None:
    """Write a recording; the suffix decides the format. It is complete or does not appear.

    Args:
        recording: What to write.
        path: File to be written, with a suffix as in `read_recording`; one that exists is replaced. Without a
            suffix a ROS 2 bag is written, a folder with an MCAP file, which must not exist yet.

    Raises:
        RecordingError: the suffix is not known, or the format cannot hold the recording.
        OutputError: the file cannot be written.
        MissingExtraError: the format needs a package that is not installed.
    """
    expect(recording, "write_recording: recording", Recording)
    path = as_path(path, "write_recording: path")
    check_suffix(path)
    suffix = path.suffix.lower()
    if suffix == "":
        with atomic_directory(path) as temporary, _named(path):
            _ROS2_BAG.write(recording, temporary)
    else:
        with atomic_file(path) as temporary, _named(path):
            _FORMATS[suffix].write(recording, temporary)


def is_recording(path: Path) -> bool:
    """Whether `read_recording` would try to read what is there, by its name: a file of a known format, or a ROS 2 bag.

    Args:
        path: File or folder; a folder is a bag where it has the description of one.
    """
    if path.is_dir():
        return (path / "metadata.yaml").is_file()
    return path.is_file() and (path.suffix.lower() in _FORMATS or _is_packed_csv(path))


def check_suffix(path: Path) -> None:
    """Refuse, before any work, a name that `write_recording` could not write.

    Raises:
        RecordingError: its suffix is not known.
    """
    suffix = path.suffix.lower()
    if suffix and suffix not in _FORMATS:
        raise RecordingError(_unknown_suffix(path))


def _load(name: str) -> Any:
    module, function = name.split(":")
    return getattr(import_module(f"sea_ident.recordings.{module}"), function)


def _sources(columns: Mapping[str, str | ColumnSource]) -> dict[str, ColumnSource]:
    """The translation, checked: it comes from a user."""
    expect(columns, "read_recording: columns", Mapping)
    for target, source in columns.items():
        expect(target, "read_recording: each key of columns", str)
        expect(source, f"read_recording: columns[{target!r}]", str, ColumnSource)
    return {target: as_source(source) for target, source in columns.items()}


def _names(sources: Mapping[str, ColumnSource]) -> set[str]:
    """Columns of the file that a translation uses, with wildcards."""
    names = {how.name for how in sources.values()}
    names |= {as_source(how.time).name for how in sources.values() if how.time is not None}
    return names


def _format(path: Path) -> _Format:
    if path.is_dir():
        from sea_ident.recordings.ros_reader import storage_files

        if not storage_files(path):
            raise RecordingError(f"{path} is a folder, and no ROS 2 bag: it holds no .mcap or .db3 file")
        return _ROS2_BAG
    if not path.is_file():
        near = sorted(other.name for other in path.parent.glob("*") if other.suffix in SUFFIXES)[:10]
        hint = f"; that folder has {', '.join(near)}" if near else ""
        raise RecordingError(f"{path}: no such file{hint}")
    packed = _is_packed_csv(path)
    if not packed and path.suffix.lower() not in _FORMATS:
        raise RecordingError(_unknown_suffix(path))
    if path.stat().st_size == 0:
        raise RecordingError(f"{path}: the file is empty")
    return _PACKED_CSV if packed else _FORMATS[path.suffix.lower()]


def _is_packed_csv(path: Path) -> bool:
    return path.name.lower().endswith(".csv.gz")


@contextmanager
def _named(path: Path) -> Iterator[None]:
    """Put the name of the file before an error of a writer, which knows the temporary name only."""
    try:
        yield
    except RecordingError as error:
        raise RecordingError(f"{path}: {error}") from error


def _unknown_suffix(path: Path) -> str:
    packed = path.suffix.lower() in (".gz", ".bz2", ".xz", ".zip", ".zst", ".7z")
    what = "is a packed file; unpack it first. Read are" if packed else "is not known; there are"
    return f"{path}: the suffix {path.suffix!r} {what} {', '.join(SUFFIXES)}"
