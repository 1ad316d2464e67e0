"""`sea-ident export`: an identified model for other tools."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sea_ident.cli.options import AsJson, ModelFile
from sea_ident.cli.output import check_targets, emit, progress
from sea_ident.exceptions import SeaIdentError

if TYPE_CHECKING:
    from sea_ident.export import Export


def export(
    model: ModelFile,
    urdf: Annotated[Path | None, typer.Option("--urdf", metavar="OUT.urdf", help="URDF to write.")] = None,
    mjcf: Annotated[Path | None, typer.Option("--mjcf", metavar="OUT.xml", help="MuJoCo model to write.")] = None,
    as_json: AsJson = False,
) -> None:
    """Write an identified model as URDF, as MuJoCo's MJCF, or both."""
    from sea_ident.estimation import read_model
    from sea_ident.export import export_mjcf, export_urdf

    if urdf is None and mjcf is None:
        raise SeaIdentError("nothing to write: give --urdf OUT.urdf, --mjcf OUT.xml, or both")
    check_targets(urdf, mjcf, inputs=(model,))
    loaded = read_model(model)
    done = []
    with progress("exporting"):
        if urdf is not None:
            done.append(export_urdf(loaded, urdf))
        if mjcf is not None:
            done.append(export_mjcf(loaded, mjcf))
    files = [str(path) for path in (urdf, mjcf) if path is not None]
    text = "\n".join([*_remarks(done), f"written: {', '.join(files)}"])
    warnings = list(dict.fromkeys(text for result in done for text in result.warnings))
    emit({"files": files, "warnings": warnings}, text, as_json=as_json)


def _remarks(done: "list[Export]") -> list[str]:
    """Notes and warnings, each once; what holds for one format only says for which."""
    places: dict[str, list[str]] = {}
    for result in done:
        for text in (*result.notes, *(f"warning: {text}" for text in result.warnings)):
            places.setdefault(text, []).append(result.format)
    return [text if len(found) == len(done) else f"{found[0]}: {text}" for text, found in places.items()]
