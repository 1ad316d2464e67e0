"""The application: verbs, exit codes, and what happens on errors and Ctrl-C."""

import io
import os
import signal
import sys
import traceback
import warnings
from typing import Annotated, NoReturn

import typer

from sea_ident import __version__
from sea_ident.cli.output import Interrupted, hold, note, tell_held
from sea_ident.cli.verbs import VERBS
from sea_ident.exceptions import SeaIdentError, SeaIdentWarning

BAD_INPUT = 2
DEFECT = 1
INTERRUPTED = 130

app = typer.Typer(
    name="sea-ident",
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
for _verb in VERBS:
    app.command(_verb.__name__)(_verb)


def _print_version(wanted: bool) -> None:
    if wanted:
        print(f"sea-ident {__version__}")
        raise typer.Exit


@app.callback()
def _describe(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Dynamic-model identification for robots with series-elastic joints.

    Exit codes: 0 done, 2 bad input (message on standard error), 1 defect.
    """


def _interrupt(*_: object) -> NoReturn:
    raise Interrupted


def _show_warning(message: Warning | str, category: type[Warning], *_: object) -> None:
    if issubclass(category, SeaIdentWarning):
        hold(str(message))


def main() -> None:
    """Run the command line and leave with its exit code."""
    # The matrices are small: threads inside the linear algebra would wait for each other, not work.
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    if isinstance(sys.stdout, io.TextIOWrapper):
        # names of files need not be text in the encoding of the terminal
        sys.stdout.reconfigure(errors="backslashreplace")
    warnings.simplefilter("once", SeaIdentWarning)
    warnings.showwarning = _show_warning  # type: ignore[assignment]
    # A polite kill unwinds like Ctrl-C, so that temporary files are removed.
    before = {number: signal.signal(number, _interrupt) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        _run()
    finally:
        for number, handler in before.items():
            signal.signal(number, handler or signal.SIG_DFL)


def _run() -> None:
    try:
        try:
            app(prog_name="sea-ident")
        finally:
            tell_held()
    except SeaIdentError as error:
        note(f"error: {error}")
        sys.exit(BAD_INPUT)
    except Interrupted:
        note("interrupted; nothing half-written is left")
        sys.exit(INTERRUPTED)
    except BrokenPipeError:
        # The reader of our output has gone (`| head`); keep the interpreter from complaining at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(0)
    except Exception:
        traceback.print_exc()
        note("error: this is a defect of sea-ident, not of your input; please report it with the lines above")
        sys.exit(DEFECT)
