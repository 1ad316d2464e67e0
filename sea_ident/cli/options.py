"""Arguments and options that several verbs share."""

from pathlib import Path
from typing import Annotated, TypeAlias

import typer

RobotSource: TypeAlias = Annotated[
    str,
    typer.Argument(
        metavar="ROBOT",
        help="URDF file, name of a shipped robot (exo_leg), or example:<path inside example-robot-data>.",
        show_default=False,
    ),
]
AnnotationFile: TypeAlias = Annotated[
    str | None,
    typer.Option("--annotation", metavar="FRAGMENT.urdf", help="URDF fragment with nothing but transmissions."),
]
JointNames: TypeAlias = Annotated[
    str | None,
    typer.Option("--joints", metavar="a,b,c", help="Joints that move; all others are locked. Default: all."),
]
Gravity: TypeAlias = Annotated[
    str | None,
    typer.Option(
        "--gravity",
        metavar="X,Y,Z",
        help="Gravity in the root link of the URDF, where the robot hangs or is mounted on a wall [m/s2]. "
        "Default: 0,0,-9.81.",
    ),
]
AsJson: TypeAlias = Annotated[
    bool, typer.Option("--json", help="Print one JSON object on standard output and nothing else there.")
]
Seed: TypeAlias = Annotated[int, typer.Option("--seed", min=0, help="Seed of everything random.")]
Period: TypeAlias = Annotated[
    float | None,
    typer.Option(
        "--period",
        metavar="S",
        help="Period of the motion [s]. Default: found from the data, if they repeat themselves.",
    ),
]
AddedEffects: TypeAlias = Annotated[
    list[str] | None,
    typer.Option(
        "--add",
        metavar="EFFECT[:JOINT][,SHAPE=VALUE]",
        help="Effect to add to bodies, rotors and friction, at one joint or all it fits, or to take the place of its "
        "like there; may be repeated.",
    ),
]
UnknownZeros: TypeAlias = Annotated[
    str | None,
    typer.Option("--unknown-zero", metavar="a,b,c", help="Joints whose encoders of link and motor differ in zero."),
]
ReportFile: TypeAlias = Annotated[
    Path | None, typer.Option("--report", metavar="R.html", help="Also write a report, one HTML file.")
]
ModelFile: TypeAlias = Annotated[
    Path, typer.Argument(metavar="MODEL.json", help="A model that `identify` wrote.", show_default=False)
]
RecordingFile: TypeAlias = Annotated[
    Path,
    typer.Argument(
        metavar="REC",
        help="A recording: .csv, .npz, .mat, .parquet, .h5, .bag, .mcap, .db3, or the folder of a ROS 2 bag.",
        show_default=False,
    ),
]
ForeignColumns: TypeAlias = Annotated[
    list[str] | None,
    typer.Option(
        "--column",
        metavar="NAME=SOURCE[,KEY=VALUE]",
        help="Read column NAME (q_knee, ...) from SOURCE in the file; keys: unit, zero, scale, sign, gear_ratio, "
        "counts_per_rev, wraps_at, interval, time. One * on both sides stands for the same text. May be repeated.",
    ),
]

Between: TypeAlias = Annotated[
    str | None,
    typer.Option(
        "--between",
        metavar="START,STOP",
        help="Use the recording between these times alone [s, as in the file]; either may be left out: 5, or ,65.",
    ),
]


def _at_least_one_job(jobs: int) -> int:
    if jobs == -1 or jobs >= 1:
        return jobs
    raise typer.BadParameter(f"{jobs} is neither -1 (one per core) nor at least 1")


Jobs: TypeAlias = Annotated[
    int,
    typer.Option("--jobs", help="How many to work on at a time; -1: one per core.", callback=_at_least_one_job),
]
