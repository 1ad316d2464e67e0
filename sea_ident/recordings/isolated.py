"""Readers of which the libraries crash on damaged files run in a process of their own.

Both scipy (MAT version 5) and the HDF5 library were seen to end the process on a file with one changed byte, which
no exception handler stops. A child process reads the file, with bounded memory and time, and hands the columns back
through a pipe: a JSON header, then the samples as 64-bit floats.
"""

import json
import subprocess
import sys
import warnings
from importlib import import_module
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from sea_ident.exceptions import RecordingError
from sea_ident.recordings.border import errors_of_libraries
from sea_ident.recordings.table import RawTable

_SECONDS = 60.0
_SLOWEST_BYTES_PER_SECOND = 1e6
_LIBRARIES_BYTES = 4 * 2**30
_START = (
    "import json, sys; sys.path[:] = json.loads(sys.argv[1]); "
    "from sea_ident.recordings.isolated import serve; serve(json.loads(sys.argv[2]), sys.stdout.buffer)"
)


def read_isolated(reader: str, path: Path, memory_limit: int) -> RawTable:
    """Read a file in a child process.

    Args:
        reader: `module:function` of this package, called with the path and the memory limit.
        path: The file.
        memory_limit: Bytes that its contents may take.

    Returns:
        The table.

    Raises:
        RecordingError: as the reader, or the child crashed or took too long.
    """
    request = {"reader": reader, "path": str(path.absolute()), "name": str(path), "memory_limit": memory_limit}
    seconds = _SECONDS + path.stat().st_size / _SLOWEST_BYTES_PER_SECOND
    command = [sys.executable, "-c", _START, json.dumps(sys.path), json.dumps(request)]
    try:
        done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, timeout=seconds, check=False)
    except subprocess.TimeoutExpired as error:
        raise RecordingError(f"{path}: reading took longer than {seconds:.0f} s; the file is damaged") from error
    end = done.stdout.find(b"\n")
    if done.returncode != 0 or end < 0:
        why = done.stderr.decode(errors="replace").strip().splitlines()
        raise RecordingError(
            f"{path}: the library that reads {path.suffix.lower()} files ended with status {done.returncode}"
            f"{': ' + why[-1][:200] if why else ''}. The file is damaged"
        )
    answer = json.loads(done.stdout[:end])
    if "error" in answer:
        raise RecordingError(answer["error"])
    for text in answer["warnings"]:
        warnings.warn(text, stacklevel=2)
    values = np.frombuffer(done.stdout, dtype=np.float64, offset=end + 1)
    stops = np.cumsum(answer["sizes"], dtype=np.int64)
    columns = dict(zip(answer["names"], np.split(values, stops[:-1]), strict=True)) if answer["names"] else {}
    return RawTable(columns, left_out=tuple(answer["left_out"]))


def serve(request: dict[str, Any], out: BinaryIO) -> None:
    """Read a file and write the answer; the other end of `read_isolated`.

    Args:
        request: Reader, path and memory limit.
        out: Where the answer goes.
    """
    _bound_memory(_LIBRARIES_BYTES + 4 * int(request["memory_limit"]))
    module, function = request["reader"].split(":")
    path = Path(request["path"])
    answer: dict[str, Any]
    table = RawTable({})
    try:
        with errors_of_libraries(path) as found:
            reader = getattr(import_module(f"sea_ident.recordings.{module}"), function)
            table = reader(path, request["memory_limit"])
        answer = {
            "names": list(table.columns),
            "sizes": [values.size for values in table.columns.values()],
            "left_out": table.left_out,
            "warnings": found,
        }
    except RecordingError as error:
        answer = {"error": str(error).replace(request["path"], request["name"])}
    out.write(json.dumps(answer).encode() + b"\n")
    for values in table.columns.values():
        out.write(np.ascontiguousarray(values, dtype=np.float64).data)
    out.flush()


def _bound_memory(size: int) -> None:
    try:
        import resource
    except ImportError:  # Windows has no such limit.
        return
    _, hard = resource.getrlimit(resource.RLIMIT_AS)
    if hard == resource.RLIM_INFINITY or hard > size:
        resource.setrlimit(resource.RLIMIT_AS, (size, hard))
