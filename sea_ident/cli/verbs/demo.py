"""`sea-ident demo`: the paper's whole experiment."""

from pathlib import Path
from typing import Annotated

import typer

from sea_ident.cli.options import AsJson, Seed
from sea_ident.cli.output import emit, progress


def demo(
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for all files.")] = Path("sea_ident_demo"),
    seed: Seed = 0,
    as_json: AsJson = False,
) -> None:
    """Run the paper's whole experiment on a simulated leg."""
    from sea_ident.demo import STEPS, run_demo

    with progress("starting", STEPS) as tell:
        result = run_demo(out, seed=seed, progress=tell)
    emit(result.to_dict(), result.summary(), as_json=as_json)
