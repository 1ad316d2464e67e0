"""`sea-ident diagnose`: where model and data disagree, and which effect is missing."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Protocol

import typer

from sea_ident.cli.inputs import read_columns, read_part
from sea_ident.cli.options import AsJson, Between, ForeignColumns, ModelFile, Period, RecordingFile, ReportFile
from sea_ident.cli.output import SHARES, by_share, check_targets, emit, note, progress

if TYPE_CHECKING:
    from sea_ident.discrepancy import Diagnosis


def diagnose(
    model: ModelFile,
    recording: RecordingFile,
    out: Annotated[Path, typer.Option("--out", metavar="DIAGNOSIS.json", help="File to write.", show_default=False)],
    holdout: Annotated[
        Path | None, typer.Option("--holdout", metavar="REC2", help="Another motion, on which the finding must hold.")
    ] = None,
    reference: Annotated[
        Path | None,
        typer.Option("--reference", metavar="MODEL0.json", help="Earlier model; shows what a refit absorbs."),
    ] = None,
    model_out: Annotated[
        Path | None, typer.Option("--model-out", metavar="MODEL2.json", help="Write the repaired model.")
    ] = None,
    next_out: Annotated[
        Path | None,
        typer.Option(
            "--next", metavar="EXC.json", help="Write the motion that tells an ambiguous pair, as excite does."
        ),
    ] = None,
    period: Period = None,
    column: ForeignColumns = None,
    between: Between = None,
    report: ReportFile = None,
    as_json: AsJson = False,
) -> None:
    """Find where a model is wrong, name what is missing, repair it.

    The model is compared with a recording, and the finding with another motion where there is one.
    """
    from sea_ident.discrepancy import diagnose as run
    from sea_ident.estimation import read_model
    from sea_ident.recordings import read_recording

    check_targets(out, model_out, next_out, report, inputs=(model, recording, holdout, reference))
    loaded, earlier = read_model(model), None if reference is None else read_model(reference)
    columns = read_columns(column)
    with progress(f"reading {recording.name}", SHARES) as tell:
        found = run(
            loaded,
            read_part(recording, columns, between),
            holdout=None if holdout is None else read_recording(holdout, columns=columns),
            reference=earlier,
            period=period,
            progress=by_share(tell),
        )
    found.save(out)
    files = [
        str(out),
        *_saved(model_out, found.model, f"there is no repaired model, and the verdict is {found.verdict}"),
        *_saved(next_out, found.next_experiment, _no_next(found)),
    ]
    if report is not None:
        from sea_ident.report import write_report

        with progress("writing the report"):
            write_report(found, report)
        files.append(str(report))
    emit({**found.to_dict(), "files": files}, f"{found.summary()}\nwritten: {', '.join(files)}", as_json=as_json)


class _Part(Protocol):
    """What can be saved of a diagnosis."""

    def save(self, path: Path) -> None:
        """Write it."""


def _saved(target: Path | None, part: _Part | None, why_not: str) -> list[str]:
    """Names of what was written; what was asked for and does not exist is told, and that an older file is not it."""
    if target is None:
        return []
    if part is None:
        older = "; the file of that name is an older one" if target.exists() else ""
        note(f"warning: {target} is not written: {why_not}{older}")
        return []
    part.save(target)
    return [str(target)]


def _no_next(found: "Diagnosis") -> str:
    """Why there is no next experiment."""
    if found.verdict != "ambiguous":
        return f"it is for an ambiguous pair, and the verdict is {found.verdict}"
    if found.model is None:
        return "no motion was tried, for there is no repaired model (the diagnosis says why)"
    return "there is no motion that tells the effects apart better (the diagnosis says why)"
