"""What verbs share when they speak: JSON on standard output, everything else on standard error."""

import json
import math
import signal
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any, Protocol

from sea_ident.exceptions import SeaIdentError


class Interrupted(BaseException):
    """Ctrl-C or a polite kill; unlike KeyboardInterrupt it passes through the parser of the command line untouched."""


@contextmanager
def best_so_far() -> Iterator[None]:
    """Work that ends early with its best result on Ctrl-C, rather than with nothing.

    Raises:
        Interrupted: where there was no result yet.
    """
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        yield
    except KeyboardInterrupt:
        raise Interrupted from None
    finally:
        signal.signal(signal.SIGINT, before)


def plain(value: Any) -> Any:
    """The same in types that JSON holds; what is not finite becomes null."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple, set, frozenset)):
        return [plain(item) for item in value]
    if isinstance(value, Path):
        return str(value)
    if hasattr(value, "tolist"):
        return plain(value.tolist())
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value


def emit(record: Mapping[str, Any], text: str, *, as_json: bool) -> None:
    """Print the result of a verb: as one JSON object, or as text for people."""
    if as_json:
        print(json.dumps(plain(record), indent=1, allow_nan=False))
    else:
        print(text)
        _held[:] = [warning for warning in _held if warning not in text]


def note(text: str) -> None:
    """A line for people, on standard error."""
    print(text, file=sys.stderr, flush=True)


_held: list[str] = []


def hold(warning: str) -> None:
    """Keep a warning for the end: the result that is printed tells most of them itself."""
    if warning not in _held:
        _held.append(warning)


def tell_held() -> None:
    """Tell the warnings that no result has told."""
    for warning in _held:
        note(f"warning: {warning}")
    _held.clear()


def check_targets(*targets: Path | None, inputs: Iterable[Path | str | None] = ()) -> None:
    """Refuse before the work starts what could not be written after it.

    Args:
        targets: files to be written.
        inputs: files to be read, which no output may replace.

    Raises:
        SeaIdentError: a folder does not exist or cannot be written to, or an output is another one or an input.
    """
    seen: set[Path] = set()
    read = {Path(name).resolve() for name in inputs if name is not None}
    for target in targets:
        if target is None:
            continue
        folder = target.parent
        if target.is_dir():
            raise SeaIdentError(f"{target}: is a folder; give the name of a file")
        if not folder.is_dir():
            raise SeaIdentError(f"{target}: the folder {folder} does not exist; make it first")
        try:
            # permissions do not tell: a superuser has them in a folder of the system that takes no file
            with TemporaryFile(dir=folder):
                pass
        except OSError as error:
            raise SeaIdentError(f"{target}: the folder {folder} cannot be written to ({error.strerror})") from None
        if target.resolve() in read:
            raise SeaIdentError(f"{target}: is read by this command and would be lost; name another file to write")
        if target.resolve() in seen:
            raise SeaIdentError(f"{target}: is named for two outputs; give each a file of its own")
        seen.add(target.resolve())


class Tell(Protocol):
    """How a verb says how far it is."""

    def __call__(self, done: int, what: str | None = None, total: int | None = None) -> None:
        """So many steps are done; what is being done now; of how many, where that has changed."""


SHARES = 1000
"""Steps of a bar for work that tells its share."""


def by_share(tell: Tell) -> Callable[[str, float], None]:
    """What functions call that tell what they do and the share that is done."""
    return lambda what, share: tell(round(SHARES * share), what)


def _silent(done: int, what: str | None = None, total: int | None = None) -> None:
    """Progress where nobody watches."""


@contextmanager
def progress(description: str, total: int | None = None) -> Iterator[Tell]:
    """A progress bar with the time left, on standard error where that is a terminal.

    Args:
        description: what is being done.
        total: number of steps; None where it is not known, which shows the time passed only.

    Yields:
        Function to call with the number of steps done so far.
    """
    if not sys.stderr.isatty():
        yield _silent
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn

    columns = (
        SpinnerColumn(),
        TextColumn("{task.description}"),
        *(() if total is None else (BarColumn(), TimeRemainingColumn())),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(description, total=total)

        def update(done: int, what: str | None = None, total: int | None = None) -> None:
            bar.update(task, completed=done, description=what or description, total=total)

        yield update
