"""NPZ: one array per column, as numpy.savez writes it. Nothing is ever unpickled."""

import zipfile
from collections.abc import Collection
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sea_ident.exceptions import RecordingError
from sea_ident.recordings.naming import TIME
from sea_ident.recordings.recording import Recording
from sea_ident.recordings.table import RawTable, check_size, table_of_arrays

_LONGEST_ARRAY_HEADER = 10_000


def read_npz(path: Path, names: Collection[str] | None, memory_limit: int) -> RawTable:
    """Read the numeric arrays of an NPZ file.

    Sizes are checked against the archive's directory and each array's header before anything is allocated.

    Args:
        path: The file.
        names: Not needed: arrays are read anyway.
        memory_limit: Largest size of all arrays together [bytes].

    Returns:
        The table; an array of several columns becomes `name[0]`, `name[1]`, ...

    Raises:
        RecordingError: not an NPZ file of numeric arrays, or too large.
    """
    with zipfile.ZipFile(path) as archive:
        members = archive.infolist()
        check_size(sum(member.file_size for member in members), memory_limit, path)
        names = [member.filename.removesuffix(".npy") for member in members]
        arrays = (_read_member(archive, member, path) for member in members)
        return table_of_arrays(zip(names, arrays, strict=True), str(path))


def write_npz(recording: Recording, path: Path) -> None:
    """Write a recording as a compressed NPZ file.

    Args:
        recording: What to write.
        path: File to be created.
    """
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, values in {TIME: recording.time, **recording.columns}.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as file:
                np.lib.format.write_array(file, values, allow_pickle=False)


def _read_member(archive: zipfile.ZipFile, member: zipfile.ZipInfo, path: Path) -> NDArray[np.generic]:
    where = f"{path}: array {member.filename!r}"
    with archive.open(member) as file:
        version = np.lib.format.read_magic(file)
        if version == (1, 0):
            shape, _, dtype = np.lib.format.read_array_header_1_0(file, max_header_size=_LONGEST_ARRAY_HEADER)
        elif version == (2, 0):
            shape, _, dtype = np.lib.format.read_array_header_2_0(file, max_header_size=_LONGEST_ARRAY_HEADER)
        else:
            raise RecordingError(f"{where} has format version {version}; 1.0 and 2.0 are read")
        if dtype.hasobject:
            raise RecordingError(f"{where} holds objects, never unpickled; save arrays of numbers")
        claimed = dtype.itemsize
        for extent in shape:
            claimed *= extent
        if claimed < 0 or claimed > member.file_size:
            raise RecordingError(f"{where} claims {claimed} bytes, but {member.file_size} are stored: damaged")
    with archive.open(member) as file:
        return np.lib.format.read_array(file, allow_pickle=False, max_header_size=_LONGEST_ARRAY_HEADER)
