"""A case on disk: what the diagnosis may see in one folder, the truth in another."""

import json
from pathlib import Path

import numpy as np

from sea_ident.motion import FourierSeries
from sea_ident.recordings import Recording, write_recording
from tests.benchmarks.hidden_effects.case import Case, Planted
from tests.benchmarks.hidden_effects.draw import row_generator, settling, trajectories_of, truth_of
from tests.benchmarks.hidden_effects.engine import friction_of, simulate_mujoco
from tests.benchmarks.hidden_effects.gap import TREND_EFFECTS
from tests.benchmarks.hidden_effects.plants import Truth, nominal_robot, source_of
from tests.benchmarks.hidden_effects.project_engine import record_project
from tests.benchmarks.hidden_effects.sensors import record


def case_folder(root: Path, label: str) -> Path:
    """What the diagnosis sees."""
    return root / "cases" / label


def truth_file(root: Path, label: str) -> Path:
    """What it does not see."""
    return root / "truth" / f"{label}.json"


def generate(case: Case, root: Path) -> None:
    """Simulate a case and write its files.

    Args:
        case: the case.
        root: folder of the run.
    """
    folder = case_folder(root, case.label)
    folder.mkdir(parents=True, exist_ok=True)
    truth, series = truth_of(case), trajectories_of(case)
    robot, how = nominal_robot(case.robot), source_of(case.robot)
    (folder / "robot.urdf").write_text(robot.urdf, encoding="utf-8")
    if how.annotation is not None and robot.annotation is not None:
        (folder / "annotation.urdf").write_text(robot.annotation, encoding="utf-8")
    (folder / "joints.json").write_text(json.dumps({"joints": list(robot.joint_names), "period": case.period}))
    runs: list[tuple[str, FourierSeries, int, tuple[Planted, ...]]] = [
        ("train", series[0], case.periods, case.planted),
        ("holdout", series[1], case.holdout_periods, case.planted),
    ]
    if case.reference:
        runs.append(("reference", series[0], case.periods, ()))
    for number, (name, trajectory, periods, planted) in enumerate(runs):
        recording = _recording(case, truth, trajectory, periods, planted, number, name)
        write_recording(recording, folder / f"{name}.npz")
    if case.forbidden:
        (folder / "forbidden.json").write_text(json.dumps(list(case.forbidden)))
    target = truth_file(root, case.label)
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_text(json.dumps(case.to_dict(), indent=1))


def _recording(
    case: Case,
    truth: Truth,
    series: FourierSeries,
    periods: int,
    planted: tuple[Planted, ...],
    number: int,
    name: str,
) -> Recording:
    rng = row_generator(case.seed, case.row, case.index, 10 + number)
    seed = int(rng.integers(2**31))
    if case.engine == "project":
        return record_project(case, truth, series, periods, planted, seed, name)
    rms = _torque_rms(truth, series, planted)
    exact = simulate_mujoco(
        truth,
        series,
        periods,
        planted=planted,
        friction=friction_of(case.noise, case.friction_form, case.friction_smoothing),
        actuator_noise=case.noise.actuator * rms,
        settle=settling(case.robot),
        seed=seed,
        course=case.periods * case.period,
    )
    return record(exact, truth, planted, case.noise, case.channel, rng, name)


def _torque_rms(truth: Truth, series: FourierSeries, planted: tuple[Planted, ...]) -> np.ndarray:
    steady = tuple(p for p in planted if p.effect not in TREND_EFFECTS)
    exact = simulate_mujoco(truth, series, 1, planted=steady, settle=0, rate=50.0)
    return np.sqrt(np.mean(exact.tau_motor**2, axis=0))
