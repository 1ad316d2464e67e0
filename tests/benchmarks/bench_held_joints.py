"""Joints that friction holds while others are excited: what is said of the rest, and how sure the parameters are.

    python tests/benchmarks/bench_held_joints.py [--rate HZ]

For every choice of joints of the leg and of a rigid arm that stand: the verdict, with a motion of all joints held out,
where nothing is missing and where something is at a joint that moves; and the errors of the base parameters of the leg
in their own standard deviations. With `--rate` the leg is recorded at so many samples a second, and no joint stands.
"""

import argparse
import json
import warnings
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from sea_ident import FourierSeries, Recording, Robot, design_excitation, diagnose, identify, load_robot, simulate
from sea_ident.effects import make_effect
from sea_ident.regressor import prior_parameters
from sea_ident.simulation import PlantedEffect

MOTIONS = Path(__file__).parents[1] / "discrepancy" / "motions.json"
OF_THE_LEG = ((0,), (1,), (2,), (0, 1), (0, 2), (1, 2))
OF_THE_ARM = ((0,), (5,), (1, 3), (0, 1, 2), (3, 4, 5))


def holding(series: FourierSeries, joints: Sequence[int]) -> FourierSeries:
    """A motion in which some joints are to stay where they are."""
    moves = np.ones((series.n, 1))
    moves[list(joints)] = 0.0
    return FourierSeries(series.base_frequency, series.offset, series.a * moves, series.b * moves)


def told(
    robot: Robot, series: FourierSeries, other: FourierSeries, planted: Sequence[PlantedEffect], rate: float
) -> tuple[str, Recording]:
    """The verdict and the names, and the recording."""
    recording = simulate(robot, series, periods=10, seed=3, effects=planted, rate=rate).recording
    held_out = simulate(robot, other, periods=8, seed=4, effects=planted, rate=rate).recording
    model = identify(robot, recording, period=series.period)
    found = diagnose(model, recording, holdout=held_out, period=series.period)
    names = [
        f"{m.effect} {m.joint} " + " ".join(f"{p.value:.4g} +- {p.std:.2g}" for p in m.parameters)
        for m in found.missing
    ]
    return f"{found.verdict} {'; '.join(names)}".strip(), recording


def errors(robot: Robot, recording: Recording, full: Recording, period: float) -> str:
    """Of the base parameters that a recording tells of those that another tells with every joint in motion."""
    model, whole = (identify(robot, each, period=period) for each in (recording, full))
    truth = dict(
        zip(whole.names, whole.base.project(np.nan_to_num(prior_parameters(robot, whole.effects))), strict=True)
    )
    each = zip(model.names, model.values, model.std, strict=True)
    z = np.array([(value - truth[name]) / std for name, value, std in each if name in truth])
    return f"errors over their standard deviations: rms {np.sqrt(np.mean(z**2)):.2f}, largest {np.max(np.abs(z)):.1f}"


def main(given: Sequence[str] | None = None) -> None:
    """Print a line for every choice of joints."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--rate", type=float)
    rate = parser.parse_args(given).rate
    warnings.simplefilter("ignore")
    leg = load_robot("exo_leg")
    known = json.loads(MOTIONS.read_text())
    first, second = (FourierSeries(m["base_frequency"], *(np.array(m[k]) for k in ("offset", "a", "b"))) for m in known)
    offset = [PlantedEffect(make_effect("torque_offset", "knee"), np.array([1.5]))]
    if rate is not None:
        for planted in ([], offset):
            print(f"leg at {rate:g} Hz: {told(leg, first, second, planted, rate)[0]}", flush=True)
        return
    full = simulate(leg, first, periods=10, seed=3).recording
    for joints in OF_THE_LEG:
        name = ", ".join(leg.joint_names[k] for k in joints)
        said, recording = told(leg, holding(first, joints), second, [], 200.0)
        print(f"leg, {name}: {said}; {errors(leg, recording, full, first.period)}", flush=True)
        if 1 not in joints:
            print(f"leg, {name}, offset: {told(leg, holding(first, joints), second, offset, 200.0)[0]}", flush=True)
    arm = load_robot("example:ur_description/urdf/ur5_robot.urdf")
    wide, other = (design_excitation(arm, starts=1, seed=seed).series for seed in (1, 2))
    constant = [PlantedEffect(make_effect("torque_constant", "elbow_joint"), np.array([0.2]))]
    for joints in OF_THE_ARM:
        name = ", ".join(arm.joint_names[k] for k in joints)
        print(f"arm, {name}: {told(arm, holding(wide, joints), other, [], 200.0)[0]}", flush=True)
        if 2 not in joints:
            said, _ = told(arm, holding(wide, joints), other, constant, 200.0)
            print(f"arm, {name}, torque constant: {said}", flush=True)


if __name__ == "__main__":
    main()
