"""`sea-ident simulate`: a recording as the robot's sensors would make it."""

from pathlib import Path
from typing import Annotated

import typer

from sea_ident.cli.inputs import read_robot
from sea_ident.cli.options import AnnotationFile, AsJson, Gravity, JointNames, RobotSource, Seed
from sea_ident.cli.output import check_targets, emit, progress


def simulate(
    robot: RobotSource,
    excitation: Annotated[
        Path, typer.Option("--excitation", metavar="EXC.json", help="What `excite` wrote.", show_default=False)
    ],
    out: Annotated[Path, typer.Option("--out", metavar="REC.csv", help="Recording to write.", show_default=False)],
    periods: Annotated[int, typer.Option("--periods", min=1, help="Periods to record.")] = 20,
    rate: Annotated[
        float, typer.Option("--rate", metavar="HZ", help="Samples per second [Hz]; a whole number per period is taken.")
    ] = 200.0,
    seed: Seed = 0,
    annotation: AnnotationFile = None,
    joints: JointNames = None,
    gravity: Gravity = None,
    as_json: AsJson = False,
) -> None:
    """Record a simulated robot that follows an excitation.

    Sensors have noise, and friction varies from pass to pass.
    """
    from sea_ident.excitation import read_excitation
    from sea_ident.recordings import write_recording
    from sea_ident.recordings.files import check_suffix
    from sea_ident.simulation import simulate as run

    check_targets(out, inputs=(robot, annotation, excitation))
    check_suffix(out)
    loaded = read_robot(robot, annotation, joints, gravity)
    reference = read_excitation(excitation)
    with progress("waiting for the motion to be periodic", periods) as tell:

        def count(done: int) -> None:
            tell(done, f"period {min(done + 1, periods)} of {periods}")

        result = run(loaded, reference, periods=periods, rate=rate, seed=seed, progress=count)
    write_recording(result.recording, out)
    record = {
        "robot": loaded.name,
        "period": result.period,
        "periods": result.periods,
        "samples": result.recording.samples,
        "sample_rate": result.recording.sample_rate,
        "settling_periods": result.settling_periods,
        "columns": ["time", *result.recording.columns],
        "warnings": list(result.warnings),
        "files": [str(out)],
    }
    emit(record, f"{result.summary()}\nwritten: {out}", as_json=as_json)
