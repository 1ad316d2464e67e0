"""`sea-ident identify`: from a recording to a model."""

from pathlib import Path
from typing import Annotated

import typer

from sea_ident.cli.inputs import read_columns, read_effects, read_part, read_robot, split_names
from sea_ident.cli.options import (
    AddedEffects,
    AnnotationFile,
    AsJson,
    Between,
    ForeignColumns,
    Gravity,
    JointNames,
    Period,
    RecordingFile,
    ReportFile,
    RobotSource,
    UnknownZeros,
)
from sea_ident.cli.output import SHARES, by_share, check_targets, emit, progress


def identify(
    robot: RobotSource,
    recording: RecordingFile,
    out: Annotated[Path, typer.Option("--out", metavar="MODEL.json", help="Model to write.", show_default=False)],
    period: Period = None,
    report: ReportFile = None,
    add: AddedEffects = None,
    unknown_zero: UnknownZeros = None,
    column: ForeignColumns = None,
    between: Between = None,
    annotation: AnnotationFile = None,
    joints: JointNames = None,
    gravity: Gravity = None,
    as_json: AsJson = False,
) -> None:
    """Identify the model of a robot and its springs from a recording."""
    from sea_ident.estimation import identify as run

    check_targets(out, report, inputs=(robot, annotation, recording))
    loaded = read_robot(robot, annotation, joints, gravity)
    effects = read_effects(loaded, add)
    columns = read_columns(column)
    with progress(f"reading {recording.name}", SHARES) as tell:
        model = run(
            loaded,
            read_part(recording, columns, between),
            effects=effects,
            period=period,
            unknown_zero=split_names(unknown_zero),
            progress=by_share(tell),
        )
    model.save(out)
    files = [str(out)]
    if report is not None:
        from sea_ident.report import write_report

        with progress("writing the report"):
            write_report(model, report)
        files.append(str(report))
    emit({**model.to_dict(), "files": files}, f"{model.summary()}\nwritten: {', '.join(files)}", as_json=as_json)
