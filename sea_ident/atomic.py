"""Writing that is complete or has not happened: a temporary sibling, then one rename."""

import os
import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from sea_ident.exceptions import OutputError


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
    target = Path(path)
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


def _sibling(target: Path) -> Path:
    if not target.parent.is_dir():
        raise OutputError(f"{target}: the folder {target.parent} does not exist; make it first")
    return target.with_name(f".{target.stem}.{secrets.token_hex(6)}{target.suffix}")
