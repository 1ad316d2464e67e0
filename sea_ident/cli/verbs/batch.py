"""`sea-ident batch`: a folder of recordings."""

from pathlib import Path
from typing import Annotated

import typer

from sea_ident.cli.inputs import read_columns, read_robot
from sea_ident.cli.options import AnnotationFile, AsJson, ForeignColumns, Gravity, Jobs, JointNames, Period
from sea_ident.cli.output import emit, progress


def batch(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of recordings.", show_default=False)],
    robot: Annotated[str, typer.Option("--robot", metavar="ROBOT", help="Robot of all.", show_default=False)],
    out: Annotated[
        Path | None, typer.Option("--out", metavar="OUT", help="Folder for models and table. Default: DIR/identified.")
    ] = None,
    period: Period = None,
    column: ForeignColumns = None,
    jobs: Jobs = -1,
    annotation: AnnotationFile = None,
    joints: JointNames = None,
    gravity: Gravity = None,
    as_json: AsJson = False,
) -> None:
    """Identify every recording of a folder, into one table.

    Bad recordings are rows with the reason; a second run does what is missing, has changed, or failed.
    """
    from sea_ident.batch import identify_batch

    loaded = read_robot(robot, annotation, joints, gravity)
    with progress("identifying", 1) as tell:

        def count(done: int, total: int, name: str) -> None:
            tell(done, f"{done} of {total} {name}", total)

        result = identify_batch(
            loaded, folder, out, period=period, columns=read_columns(column), jobs=jobs, progress=count
        )
    emit(result.to_dict(), result.summary(), as_json=as_json)
