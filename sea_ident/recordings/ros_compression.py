"""Unpacking what bags compress, within bounds: rosbags itself unpacks whatever a file claims or hides."""

import bz2
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, BinaryIO

from sea_ident.exceptions import RecordingError

_ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
_LZ4_LARGEST_RATIO = 255
_MCAP_MAGIC_BYTES = 8
_MCAP_CHUNK = 6
_PIECE = 1 << 20


def _zstd() -> Any:
    if sys.version_info >= (3, 14):
        from compression import zstd  # type: ignore[import-not-found,unused-ignore]
    else:
        from backports import zstd  # type: ignore[import-untyped,unused-ignore]
    return zstd


def unpack(data: bytes, compression: str, limit: int, path: Path) -> bytes:
    """Unpack one block.

    Args:
        data: The block.
        compression: `zstd`, `lz4`, `bz2`, `none` or empty.
        limit: Bytes that it may unpack to.
        path: The file, for messages.

    Returns:
        The contents.

    Raises:
        RecordingError: it unpacks to more, is cut off, or the compression is not known.
    """
    if compression in ("", "none"):
        return data
    if compression == "zstd":
        unpacker = _zstd().ZstdDecompressor()
    elif compression == "bz2":
        unpacker = bz2.BZ2Decompressor()
    elif compression == "lz4":
        import lz4.frame  # type: ignore[import-untyped,unused-ignore]

        unpacker = lz4.frame.LZ4FrameDecompressor()
        limit = min(limit, _LZ4_LARGEST_RATIO * len(data) + _PIECE)
    else:
        raise RecordingError(f"{path}: the compression {compression!r} is not known")
    contents: bytes = unpacker.decompress(data, limit + 1)
    if len(contents) > limit:
        raise RecordingError(f"{path}: a block unpacks to more than {limit} bytes, over the limit")
    if not unpacker.eof:
        raise RecordingError(f"{path}: a compressed block is cut off")
    return contents


def unpack_message(data: bytes, limit: int, path: Path) -> bytes:
    """A message of a ROS 2 bag, unpacked where messages were compressed one by one."""
    return unpack(data, "zstd", limit, path) if data.startswith(_ZSTD_MAGIC) else data


def unpack_file(path: Path, target: Path, limit: int) -> None:
    """Unpack a storage file that was compressed as a whole.

    Args:
        path: The compressed file.
        target: File to be created.
        limit: Bytes that it may unpack to.

    Raises:
        RecordingError: it unpacks to more.
    """
    written = 0
    with _zstd().open(path, "rb") as packed, open(target, "wb") as file:
        while piece := packed.read(_PIECE):
            written += len(piece)
            if written > limit:
                raise RecordingError(f"{path}: unpacks to more than {limit} bytes, over the limit; see memory_limit")
            file.write(piece)


def bound_ros1_chunks(reader: Any, limit: int, path: Path) -> None:
    """Make an open rosbags reader of a ROS 1 bag unpack its chunks by `unpack`.

    Args:
        reader: `rosbags.rosbag1.Reader`, open.
        limit: Bytes that a chunk may unpack to.
        path: The file, for messages.

    Raises:
        RecordingError: a chunk claims more bytes than the file has.
    """
    from rosbags.rosbag1.reader import decompressors

    names = {function: name for name, function in decompressors.items()}
    size = path.stat().st_size
    for position, chunk in reader.chunks.items():
        if chunk.datasize > size:
            raise RecordingError(f"{path}: a chunk claims {chunk.datasize} bytes, but the file has {size}")
        name = names[chunk.decompressor]
        reader.chunks[position] = chunk._replace(decompressor=lambda data, name=name: unpack(data, name, limit, path))


def check_mcap_chunks(path: Path, limit: int) -> dict[int, int]:
    """Unpack every chunk of an MCAP file once, within its own claim and the limit.

    Args:
        path: The file.
        limit: Bytes that a chunk may unpack to.

    Returns:
        Offset of every chunk record in the file, and its compressed size [bytes].

    Raises:
        RecordingError: a chunk unpacks to more than it claims or than the limit.
    """
    found = {}
    with open(path, "rb") as file:
        file.seek(_MCAP_MAGIC_BYTES)
        for offset, kind, length in _records(file, path.stat().st_size):
            if kind != _MCAP_CHUNK:
                continue
            head = file.read(32)
            claimed = int.from_bytes(head[16:24], "little")
            name = file.read(min(int.from_bytes(head[28:32], "little"), length)).decode("utf-8", "replace")
            size = int.from_bytes(file.read(8), "little")
            if size > length:
                raise RecordingError(f"{path}: a chunk at {offset} claims {size} bytes of its {length}: damaged")
            if claimed > limit:
                raise RecordingError(f"{path}: a chunk at {offset} unpacks to {claimed} bytes, over the limit")
            unpack(file.read(size), name, claimed, path)
            found[offset] = size
    return found


def _records(file: BinaryIO, size: int) -> Iterator[tuple[int, int, int]]:
    """Offset, kind and length of the records of an MCAP file, the file standing at the contents."""
    while True:
        offset = file.tell()
        head = file.read(9)
        if len(head) < 9:
            return
        length = int.from_bytes(head[1:], "little")
        if offset + 9 + length > size:
            return
        yield offset, head[0], length
        file.seek(offset + 9 + length)
