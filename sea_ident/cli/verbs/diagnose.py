"""`sea-ident diagnose`: where model and data disagree, and which effect is missing."""

from pathlib import Path
from typing import Annotated

import typer

from sea_ident.cli.inputs import read_columns
from sea_ident.cli.options import AsJson, ForeignColumns, ModelFile, Period, RecordingFile, ReportFile
from sea_ident.cli.output import SHARES, by_share, check_targets, emit, note, progress


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
            read_recording(recording, columns=columns),
            holdout=None if holdout is None else read_recording(holdout, columns=columns),
            reference=earlier,
            period=period,
            progress=by_share(tell),
        )
    found.save(out)
    files = [str(out)]
    if model_out is not None:
        if found.model is None:
            note(f"warning: {model_out} is not written: there is no repaired model with the verdict {found.verdict}")
        else:
            found.model.save(model_out)
            files.append(str(model_out))
    if next_out is not None:
        if found.next_experiment is None:
            note(f"warning: {next_out} is not written: the verdict {found.verdict} comes without a next experiment")
        else:
            found.next_experiment.save(next_out)
            files.append(str(next_out))
    if report is not None:
        from sea_ident.report import write_report

        with progress("writing the report"):
            write_report(found, report)
        files.append(str(report))
    emit({**found.to_dict(), "files": files}, f"{found.summary()}\nwritten: {', '.join(files)}", as_json=as_json)
