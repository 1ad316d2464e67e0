"""`run_demo`: the whole experiment, from the limits of the leg to tables, pictures and a report."""

import json
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from sea_ident.arguments import as_path
from sea_ident.atomic import atomic_file
from sea_ident.demo import pictures
from sea_ident.demo.gait import gait
from sea_ident.demo.tables import ParameterRow, PerformanceRow, parameter_table, performance_table, table_text
from sea_ident.estimation import JointWLS, Model, PerSampleWLS, identify
from sea_ident.exceptions import SeaIdentError
from sea_ident.excitation import Excitation, Progress, design_excitation
from sea_ident.processing import process
from sea_ident.recordings import write_recording
from sea_ident.report import write_report
from sea_ident.robot import load_robot
from sea_ident.simulation import ComputedTorque, simulate
from sea_ident.validation import Validation, validate

ROBOT = "exo_leg"
STARTS = 3
PERIODS = 20
STEPS = 100
"""What `progress` counts up to."""


@dataclass(frozen=True, eq=False)
class Demo:
    """Result of the demo.

    Attributes:
        excitation: the trajectory that was designed.
        model: the model, with one torque variance per sample.
        joint_model: the same with one torque variance per joint.
        gait: prediction of the gait by `model`.
        joint_gait: prediction of the gait by `joint_model`.
        parameters: table I.
        performance: table II.
        files: what was written.
    """

    excitation: Excitation
    model: Model
    joint_model: Model
    gait: Validation
    joint_gait: Validation
    parameters: tuple[ParameterRow, ...]
    performance: tuple[PerformanceRow, ...]
    files: tuple[Path, ...]

    def summary(self) -> str:
        """Both tables and the files."""
        return (
            "Table I: parameters of the description, which the simulated leg is built from, and as identified\n"
            f"{table_text(self.parameters)}\n\n"
            "Table II: excitation as planned and as measured; one torque variance per joint or per sample\n"
            f"{table_text(self.performance)}\n\n"
            "written:\n" + "\n".join(f"  {path}" for path in self.files)
        )

    def to_dict(self) -> dict[str, Any]:
        """Tables as numbers, and the files."""
        return {
            "tables": {
                "parameters": [asdict(row) for row in self.parameters],
                "performance": [asdict(row) for row in self.performance],
            },
            "files": [str(path) for path in self.files],
            "warnings": list(self.model.warnings),
        }


def run_demo(
    out: str | Path,
    *,
    seed: int = 0,
    starts: int = STARTS,
    periods: int = PERIODS,
    jobs: int = -1,
    progress: Callable[[int, str], None] | None = None,
) -> Demo:
    """Run the experiment of the paper on the simulated exoskeleton leg.

    Args:
        out: folder for all files; made where it does not exist, files of the same names are replaced.
        seed: of everything random.
        starts: random starts of the excitation.
        periods: periods that are recorded.
        jobs: starts at a time; -1 is one per core.
        progress: called with how far it is, of `STEPS`, and what is being done.

    Returns:
        Models, validations, tables and the files written. Every file is complete or does not appear.

    Raises:
        SeaIdentError: the folder cannot be written to.
    """
    folder = _folder(out)
    tell = progress or (lambda done, what: None)
    files: list[Path] = []

    def target(name: str) -> Path:
        files.append(folder / name)
        return folder / name

    robot = load_robot(ROBOT)
    tell(1, "designing the excitation")
    begun: set[int] = set()

    def designing(state: Progress) -> None:
        begun.add(state.start)
        tell(1 + 39 * (len(begun) - 1) // starts, f"designing the excitation, start {len(begun)} of {starts}")

    excitation = design_excitation(robot, starts=starts, seed=seed, jobs=jobs, progress=designing)
    excitation.save(target("excitation.json"))

    tell(40, f"simulating {periods} periods of the excitation")
    simulation = simulate(robot, excitation, periods=periods, seed=seed)
    recording = replace(simulation.recording, source="recording.csv")
    write_recording(recording, target("recording.csv"))
    tell(60, f"simulating {periods} strides of a gait")
    walk = gait()
    walking = simulate(robot, walk, periods=periods, seed=seed + 1, controller=ComputedTorque())
    stride = replace(walking.recording, source="gait.csv")
    write_recording(stride, target("gait.csv"))

    tell(70, "identifying with one variance per joint")
    processed = process(recording, robot, period=excitation.period)
    joint_model = identify(robot, processed, estimator=JointWLS())
    tell(75, "identifying with one variance per sample")
    model = identify(robot, processed, estimator=PerSampleWLS())
    model.save(target("MODEL.json"))
    tell(80, "predicting the gait")
    walked = process(stride, robot, period=walk.period)
    joint_gait, sample_gait = validate(joint_model, walked), validate(model, walked)

    parameters = parameter_table(model)
    exact = walking.tau_motor.reshape(periods, -1, robot.n).mean(axis=0)
    performance = performance_table(excitation, joint_model, model, joint_gait, sample_gait, processed.motion, exact)
    _write_tables(parameters, performance, target("tables.md"), target("tables.json"))
    tell(85, "drawing")
    pictures.torque_of_periods(processed, "hip", target("figure_1a_torque.png"))
    pictures.variance_and_velocity(processed, "hip", target("figure_1b_variance.png"))
    pictures.angles(processed, excitation.series, target("figure_3_angles.png"))
    pictures.side_view(robot, processed.motion, target("leg.png"))
    tell(95, "writing the report")
    write_report(model, target("report.html"), excitation=excitation, validations=(sample_gait,))
    tell(STEPS, "done")
    return Demo(
        excitation, model, joint_model, sample_gait, joint_gait, parameters, performance, tuple(files)
    )  # fmt: skip


def _folder(out: str | Path) -> Path:
    folder = as_path(out, "run_demo: out")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise SeaIdentError(f"{folder}: cannot be made: {error.strerror or error}") from None
    return folder


def _write_tables(
    parameters: tuple[ParameterRow, ...], performance: tuple[PerformanceRow, ...], text: Path, numbers: Path
) -> None:
    record = {
        "parameters": [asdict(row) for row in parameters],
        "performance": [asdict(row) for row in performance],
    }
    with atomic_file(text) as temporary:
        temporary.write_text(
            f"Table I\n\n{table_text(parameters)}\n\nTable II\n\n{table_text(performance)}\n", encoding="utf-8"
        )
    with atomic_file(numbers) as temporary:
        temporary.write_text(json.dumps(record, indent=1, allow_nan=False) + "\n", encoding="utf-8")
