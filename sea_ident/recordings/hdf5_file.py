"""HDF5: one dataset per column; those in groups are named `group/name`."""

from collections.abc import Collection, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from sea_ident.exceptions import MissingExtraError, RecordingError
from sea_ident.recordings.isolated import read_isolated
from sea_ident.recordings.naming import SI_UNITS, TIME, dimension_of
from sea_ident.recordings.recording import Recording
from sea_ident.recordings.table import MOST_COLUMNS, RawTable, check_size, refuse_or_leave_out, table_of_arrays

_DEEPEST_GROUP = 20


def require_h5py(purpose: str) -> None:
    """Look whether h5py is installed, without importing it.

    Args:
        purpose: What it is needed for.

    Raises:
        MissingExtraError: it is not.
    """
    try:
        found = find_spec("h5py") is not None
    except ValueError:
        found = False
    if not found:
        raise MissingExtraError("h5py", "hdf5", purpose)


@contextmanager
def open_hdf5(path: Path) -> Iterator[Any]:
    """Open a file for reading.

    Args:
        path: The file.

    Yields:
        The root group.
    """
    import h5py

    with h5py.File(path, "r") as root:
        yield root


def read_hdf5(path: Path, names: Collection[str] | None, memory_limit: int) -> RawTable:
    """Read the numeric datasets of an HDF5 file, in a process of its own.

    Links to other files and data stored in other files are not followed.

    Args:
        path: The file.
        names: Not needed: datasets are read anyway.
        memory_limit: Largest size of all datasets together [bytes].

    Returns:
        The table.

    Raises:
        RecordingError: not an HDF5 file of numeric datasets, or too large.
        MissingExtraError: h5py is not installed.
    """
    require_h5py("reading HDF5")
    return read_isolated("hdf5_file:parse_hdf5", path, memory_limit)


def parse_hdf5(path: Path, memory_limit: int) -> RawTable:
    """As `read_hdf5`, in this process."""
    with open_hdf5(path) as root:
        return read_datasets(root, path, memory_limit, separator="/", matlab=False)


def write_hdf5(recording: Recording, path: Path) -> None:
    """Write a recording, one dataset per column at the root, with its unit as the attribute `unit`.

    Args:
        recording: What to write.
        path: File to be created.

    Raises:
        MissingExtraError: h5py is not installed.
        RecordingError: a column name cannot name a dataset.
    """
    require_h5py("writing HDF5")
    import h5py

    for name in recording.columns:
        if "/" in name or name == ".":
            raise RecordingError(f"column {name!r} cannot name an HDF5 dataset; choose another format")
    with h5py.File(path, "w", track_order=True) as root:
        for name, values in {TIME: recording.time, **recording.columns}.items():
            dataset = root.create_dataset(name, data=values, compression="gzip", shuffle=True)
            unit = SI_UNITS.get(dimension_of(name) or "")
            if unit is not None:
                dataset.attrs["unit"] = unit


def read_datasets(root: Any, path: Path, memory_limit: int, *, separator: str, matlab: bool) -> RawTable:
    """Read all numeric datasets below a group.

    Args:
        root: Open h5py group.
        path: The file, for messages.
        memory_limit: Largest size of all datasets together [bytes].
        separator: Between group and dataset in a name.
        matlab: Whether MATLAB wrote the file: characters are stored as numbers there, marked by an attribute.

    Returns:
        The table.

    Raises:
        RecordingError: too large, or a dataset keeps its data elsewhere.
    """
    left_out: list[str] = []
    chosen = []
    size = 0
    for name, dataset in _walk(root, separator, "", _DEEPEST_GROUP):
        problem = _matlab_problem(dataset) if matlab else ""
        if not problem and dataset.dtype.kind not in "biuf":
            problem = "holds no real numbers"
        if not problem and (dataset.shape is None or dataset.shape == ()):
            problem = "is a single number"
        if problem:
            left_out.append(refuse_or_leave_out(name, problem, str(path)))
            continue
        if dataset.external or dataset.is_virtual:
            raise RecordingError(f"{path}: dataset {name!r} keeps its data in another file, which is not followed")
        size += _bytes(dataset)
        check_size(size, memory_limit, path)
        chosen.append((name, dataset))
        if len(chosen) > MOST_COLUMNS:
            raise RecordingError(f"{path}: more than {MOST_COLUMNS} datasets; is it a recording?")
    return table_of_arrays(((name, dataset[()]) for name, dataset in chosen), str(path), left_out)


def _walk(group: Any, separator: str, prefix: str, depth: int) -> Iterator[tuple[str, Any]]:
    import h5py

    for key in group:
        if prefix == "" and key in ("#refs#", "#subsystem#"):
            continue
        if not isinstance(group.get(key, getlink=True), h5py.HardLink):
            continue
        item = group[key]
        if isinstance(item, h5py.Dataset):
            yield prefix + key, item
        elif isinstance(item, h5py.Group) and depth > 0:
            yield from _walk(item, separator, prefix + key + separator, depth - 1)


def _matlab_problem(dataset: Any) -> str:
    kind = dataset.attrs.get("MATLAB_class", b"double")
    kind = kind.decode(errors="replace") if isinstance(kind, bytes) else str(kind)
    if "MATLAB_empty" in dataset.attrs:
        return "is empty"
    if "MATLAB_object_decode" in dataset.attrs or kind in ("char", "cell", "string", "function_handle"):
        return f"is a {kind}"
    return ""


def _bytes(dataset: Any) -> int:
    """Memory that reading takes: the data as float64, and one chunk of it, as the file claims them."""
    size = 8 * int(dataset.size)
    if dataset.chunks is not None:
        chunk = int(dataset.dtype.itemsize)
        for side in dataset.chunks:
            chunk *= int(side)
        size += chunk
    return size
