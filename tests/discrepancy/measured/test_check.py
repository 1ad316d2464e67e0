"""Checks at the border of the diagnosis."""

import warnings

import numpy as np
import pytest

from sea_ident import FourierSeries, simulate
from sea_ident.discrepancy.measured.check import (
    as_identified,
    channels_move,
    clock_in_seconds,
    wrong_columns,
)
from sea_ident.discrepancy.measured.data import wide_processing
from sea_ident.effects import base_effects
from sea_ident.exceptions import DiagnosisError, SeaIdentWarning
from sea_ident.recordings import Recording
from sea_ident.robot import load_robot


@pytest.mark.parametrize(
    ("column", "why"),
    [
        ("q_hip", "the sensor is dead, or the joint does not move"),
        ("theta_knee", "the sensor is dead, or the joint does not move"),
        ("tau_motor_ankle", "no torque is measured"),
    ],
)
def test_a_joint_that_does_not_move_or_has_no_torque_is_refused(column, why):
    leg, time = load_robot("exo_leg"), 0.01 * np.arange(200)
    columns = {f"{kind}_{name}": np.sin(time) for kind in ("q", "theta", "tau_motor") for name in leg.joint_names}
    columns |= {"current_ankle": np.zeros(200)}
    channels_move(leg, Recording(time=time, columns=columns, source="a.csv"))
    dead = Recording(time=time, columns={**columns, column: np.full(200, 0.25)}, source="a.csv")
    with pytest.raises(DiagnosisError, match=rf"a.csv: column {column} is constant, 0.25: {why}, .*--joints"):
        channels_move(leg, dead)


@pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")
def test_only_what_is_used_has_to_move():
    """A current where no torque was measured; no motor's encoder at a joint without a spring."""
    slide, time = load_robot("emps"), 0.01 * np.arange(200)
    (name,) = slide.joint_names
    columns = {f"q_{name}": np.sin(time), f"theta_{name}": np.zeros(200), f"current_{name}": np.cos(time)}
    channels_move(slide, Recording(time=time, columns=columns, source="a.csv"))
    columns[f"current_{name}"] = np.zeros(200)
    with pytest.raises(DiagnosisError, match=f"column current_{name} is constant, 0: no torque is measured"):
        channels_move(slide, Recording(time=time, columns=columns, source="a.csv"))


@pytest.mark.parametrize("rate", [200, 5000])
def test_time_that_is_not_in_seconds_is_refused(rate):
    """A search in it takes minutes and finds nothing."""
    time = np.arange(20 * rate) / rate
    columns = {"q_hip": 0.8 * np.sin(time)}
    clock_in_seconds(Recording(time, columns, "a.csv"))
    with pytest.raises(
        DiagnosisError, match=r"a.csv: no position moves faster.*--column time=time,unit=ms. If it is in"
    ):
        clock_in_seconds(Recording(1e3 * time, columns, "a.csv"))


@pytest.mark.scenario
@pytest.mark.parametrize("seed", [3, 4, 6, 7])
def test_no_torque_of_an_arm_without_friction_has_the_wrong_sign(seed):
    """Its motors take up work that others do, and noise of accelerations makes an inertia of any sign."""
    rng = np.random.default_rng(seed)
    a, b = 0.25 * rng.standard_normal((2, 6, 3))
    series = FourierSeries(0.2, np.array([0.0, -1.2, 0.8, 0.2, 0.3, 0.0]), a, b)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        robot = load_robot("example:ur_description/urdf/ur5_robot.urdf")
        recording = simulate(robot, series, periods=6, seed=seed).recording
        processed = as_identified(recording, wide_processing(recording, robot, 5.0), robot)
        assert wrong_columns(robot, base_effects(robot), processed) == ()
