"""`sea-ident report`: a model or a diagnosis as one HTML file."""

from pathlib import Path
from typing import Annotated

import typer

from sea_ident.cli.inputs import read_result
from sea_ident.cli.options import AsJson
from sea_ident.cli.output import check_targets, emit, progress


def report(
    result: Annotated[
        Path,
        typer.Argument(
            metavar="MODEL.json|DIAGNOSIS.json", help="What `identify` or `diagnose` wrote.", show_default=False
        ),
    ],
    out: Annotated[Path, typer.Option("--out", metavar="R.html", help="Report to write.", show_default=False)],
    model: Annotated[
        Path | None, typer.Option("--model", metavar="MODEL2.json", help="The repaired model of a diagnosis.")
    ] = None,
    excitation: Annotated[
        Path | None, typer.Option("--excitation", metavar="EXC.json", help="Show this excitation in its limits.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Write a model or a diagnosis as one HTML file.

    It needs no network, and no other file.
    """
    from sea_ident.excitation import read_excitation
    from sea_ident.report import write_report

    check_targets(out, inputs=(result, model, excitation))
    loaded = read_result(result, model)
    series = None if excitation is None else read_excitation(excitation)
    with progress("writing the report"):
        write_report(loaded, out, excitation=series)
    emit({"files": [str(out)]}, f"written: {out}", as_json=as_json)
