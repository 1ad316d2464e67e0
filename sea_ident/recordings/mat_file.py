"""MAT: one variable per column. Version 5 to 7 by scipy, version 7.3 (HDF5 inside) by h5py."""

import re
import zlib
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from sea_ident.exceptions import RecordingError
from sea_ident.recordings.hdf5_file import open_hdf5, read_datasets, require_h5py
from sea_ident.recordings.isolated import read_isolated
from sea_ident.recordings.naming import TIME
from sea_ident.recordings.recording import Recording
from sea_ident.recordings.table import RawTable, check_size, refuse_or_leave_out, table_of_arrays

_NUMERIC = frozenset(
    ["double", "single", "logical", "int8", "int16", "int32", "int64", "uint8", "uint16", "uint32", "uint64"]
)
_COMPRESSED = 15
_HEADER_BYTES = 128
_LONGEST_NAME = 63
_DEEPEST_STRUCT = 5


def read_mat(path: Path, names: Collection[str] | None, memory_limit: int) -> RawTable:
    """Read the numeric variables of a MAT file, in a process of its own; fields of a structure become `struct.field`.

    Cells, objects and function handles are never interpreted.

    Args:
        path: The file.
        names: Not needed: variables are read anyway.
        memory_limit: Largest size of all variables together [bytes].

    Returns:
        The table.

    Raises:
        RecordingError: not a MAT file of numeric variables, or too large.
        MissingExtraError: a version 7.3 file, and h5py is not installed.
    """
    if _is_hdf5(_start(path)):
        require_h5py("reading MAT version 7.3")
    return read_isolated("mat_file:parse_mat", path, memory_limit)


def parse_mat(path: Path, memory_limit: int) -> RawTable:
    """As `read_mat`, in this process."""
    start = _start(path)
    if _is_hdf5(start):
        with open_hdf5(path) as root:
            return read_datasets(root, path, memory_limit, separator=".", matlab=True)
    import scipy.io

    _check_unpacked_size(path, start, memory_limit)
    left_out = []
    wanted = []
    size = 0
    for name, shape, kind in scipy.io.whosmat(path):
        if kind in _NUMERIC or kind == "struct":
            wanted.append(name)
            extent = 8
            for side in shape:
                extent *= int(side)
            size += extent
            if extent < 0:
                raise RecordingError(f"{path}: variable {name!r} has shape {shape}: the file is damaged")
        else:
            left_out.append(refuse_or_leave_out(name, f"is a {kind}", str(path)))
    check_size(size, memory_limit, path)
    variables = scipy.io.loadmat(path, variable_names=wanted) if wanted else {}
    arrays = [
        found
        for name, value in variables.items()
        if not name.startswith("__")
        for found in _flatten(name, value, path, left_out, _DEEPEST_STRUCT)
    ]
    return table_of_arrays(arrays, str(path), left_out)


def write_mat(recording: Recording, path: Path) -> None:
    """Write a recording as a version 7 MAT file, one column vector per column.

    Args:
        recording: What to write.
        path: File to be created.

    Raises:
        RecordingError: a column name is no name for a MATLAB variable.
    """
    import scipy.io

    for name in recording.columns:
        if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name) or len(name) > _LONGEST_NAME:
            raise RecordingError(
                f"column {name!r} is no name for a MATLAB variable (a letter, then up to 62 letters, "
                "digits or _); choose another format"
            )
    variables = {TIME: recording.time, **recording.columns}
    with open(path, "wb") as file:
        scipy.io.savemat(file, variables, do_compression=True, oned_as="column")


def _start(path: Path) -> bytes:
    with open(path, "rb") as file:
        return file.read(_HEADER_BYTES)


def _is_hdf5(start: bytes) -> bool:
    return start.startswith((b"MATLAB 7.3", b"\x89HDF"))


def _flatten(
    name: str, value: NDArray[np.generic], path: Path, left_out: list[str], depth: int
) -> Iterator[tuple[str, NDArray[np.generic]]]:
    """Arrays of numbers in a variable, structures followed."""
    if not isinstance(value, np.ndarray) or value.dtype == object:
        left_out.append(refuse_or_leave_out(name, "is a cell or object", str(path)))
    elif value.dtype.names is None:
        yield name, value
    elif value.size != 1 or depth == 0:
        left_out.append(f"{name} (array of structures)")
    else:
        for part in value.dtype.names:
            yield from _flatten(f"{name}.{part}", value.reshape(-1)[0][part], path, left_out, depth - 1)


def _check_unpacked_size(path: Path, start: bytes, memory_limit: int) -> None:
    """Unpack the compressed variables of a version 7 file once, piece by piece, to know their size."""
    order: Literal["little", "big"]
    if start[126:128] == b"IM":
        order = "little"
    elif start[126:128] == b"MI":
        order = "big"
    else:
        return
    budget = memory_limit
    with open(path, "rb") as file:
        file.seek(_HEADER_BYTES)
        while len(tag := file.read(8)) == 8:
            kind = int.from_bytes(tag[:4], order)
            size = int.from_bytes(tag[4:], order)
            if kind != _COMPRESSED:
                file.seek(size, 1)
                continue
            unpacker = zlib.decompressobj()
            while size > 0 and (piece := file.read(min(size, 1 << 16))):
                size -= len(piece)
                while piece and not unpacker.eof:
                    budget -= len(unpacker.decompress(piece, 1 << 20))
                    check_size(memory_limit - budget, memory_limit, path)
                    piece = unpacker.unconsumed_tail
