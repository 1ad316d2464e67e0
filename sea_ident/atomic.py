"""Writing that is complete or has not happened: a temporary sibling, then one rename."""

import hashlib
import os
import platform
import re
import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path

from sea_ident.arguments import as_path
from sea_ident.exceptions import OutputError

LONGEST = 100
"""Characters of a name that its temporary sibling keeps."""


@contextmanager
def atomic_file(path: str | Path) -> Iterator[Path]:
    """Give a temporary path beside `path`; on leaving without an error it takes the place of `path`.

    The temporary file keeps the suffix of `path`. Whatever happens in between, `path` holds either what it
    held before or the whole of what was written.

    Args:
        path: File to be written; its folder must exist.

    Yields:
        Path of the temporary file, which does not exist yet.

    Raises:
        OutputError: the folder does not exist or cannot be written to, or the disk is full.
    """
    target = as_path(path, "the file to write")
    temporary = _sibling(target)
    try:
        yield temporary
        with open(temporary, "rb+") as written:
            os.fsync(written.fileno())
        os.replace(temporary, target)
    except OSError as error:
        raise OutputError(f"{target}: cannot be written: {error.strerror or error}") from error
    finally:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)


@contextmanager
def atomic_directory(path: str | Path) -> Iterator[Path]:
    """As `atomic_file` for a new folder; a folder or file that stands at `path` already is never replaced.

    Args:
        path: Folder to be written; its parent must exist.

    Yields:
        Path of the temporary folder, which does not exist yet and has the name of `path`.

    Raises:
        OutputError: something stands at `path`, or it cannot be written.
    """
    target = Path(path)
    if target.exists():
        raise OutputError(f"{target}: exists already; remove it or choose another name")
    temporary = _sibling(target)
    try:
        temporary.mkdir()
        yield temporary / target.name
        os.rename(temporary / target.name, target)
    except OSError as error:
        raise OutputError(f"{target}: cannot be written: {error.strerror or error}") from error
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


@contextmanager
def scratch_folder(target: str | Path) -> Iterator[Path]:
    """A temporary folder on the disk of `target`, gone afterwards.

    Args:
        target: what it is needed for; it stands beside this.

    Yields:
        The folder.

    Raises:
        OutputError: the folder of `target` does not exist.
    """
    folder = _sibling(Path(target).with_suffix(""))
    try:
        folder.mkdir()
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


_OWN = re.compile(r"\..+\.sea-ident-([0-9a-f]{8})-(\d+)-[0-9a-f]{12}(\.\w+)?")


def _sibling(target: Path) -> Path:
    if not target.parent.is_dir():
        raise OutputError(f"{target}: the folder {target.parent} does not exist; make it first")
    _remove_stale(target.parent.resolve())
    own = f"sea-ident-{_machine()}-{os.getpid()}-{secrets.token_hex(6)}"
    return target.with_name(f".{target.stem.lstrip('.')[:LONGEST]}.{own}{target.suffix}")


@cache
def _remove_stale(folder: Path) -> None:
    """Remove, once for a folder, what processes of this machine that were killed have left there half-written."""
    if os.name != "posix":
        return
    with suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            found = _OWN.fullmatch(entry.name)
            if found is None or found[1] != _machine() or _alive(int(found[2])):
                continue
            if entry.is_dir(follow_symlinks=False):
                shutil.rmtree(entry.path, ignore_errors=True)
            else:
                with suppress(OSError):
                    os.unlink(entry.path)


@cache
def _machine() -> str:
    """Stands for this machine and, inside a container, its process numbers: folders can be shared."""
    numbers = ""
    with suppress(OSError):
        numbers = str(os.stat("/proc/self/ns/pid").st_ino)
    return hashlib.sha256(f"{platform.node()} {numbers}".encode()).hexdigest()[:8]


def _alive(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):
        return True  # somebody else's
    return True
