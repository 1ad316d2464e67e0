"""Limits that a simulated motion breaks are said, each with its value; what keeps them is not."""

from dataclasses import replace

import numpy as np
import pytest
from plants import modest_series

from sea_ident.motion import FourierSeries, Motion
from sea_ident.simulation import SensorNoise, simulate
from sea_ident.simulation.excess import broken_limits


def resting(robot, **changes):
    """Ten samples well inside, some signals changed at one instant."""
    middle = np.tile([0.5, -0.25, 0.6], (10, 1))
    signals = {"q": middle.copy(), "dq": np.zeros_like(middle), "ddq": np.zeros_like(middle)}
    for name, (joint, value) in changes.items():
        signals[name][4, joint] = value
    return Motion(np.arange(10.0), *signals.values(), middle, np.zeros_like(middle), np.zeros_like(middle))


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"q": (0, 0.8)}, "joint 'hip': the link reaches 0.8 rad, its upper limit is 0.6981"),
        ({"q": (1, 0.1)}, "joint 'knee': the link reaches 0.1 rad, its upper limit is 0"),
        ({"q": (0, 0.2)}, "hip_knee_sum reaches -0.05 rad, its lower limit is 0.1"),
        ({"dq": (0, -4.0)}, "joint 'hip': the link reaches 4 rad/s, its limit is 3.142"),
        ({"ddq": (2, 13.9)}, "joint 'ankle': the link reaches 13.9 rad/s2, its limit is 6.283"),
    ],
)
def test_every_quantity_is_said(leg, changes, says):
    assert broken_limits(leg, resting(leg, **changes), np.zeros((10, 3)), settled=True) == [says]


def test_torque_and_deflection(leg):
    soft = replace(leg, limits=leg.limits.replace(deflection=np.array([np.inf, 0.01, np.inf])))
    told = broken_limits(soft, resting(soft, q=(1, -0.2)), np.zeros((10, 3)), settled=True)
    assert told == ["joint 'knee': the deflection reaches 0.05 rad, its limit is 0.01"]
    torque = np.zeros((10, 3))
    torque[3, 1] = -61.0
    told = broken_limits(leg, resting(leg), torque, settled=True)
    assert told == ["joint 'knee': the motor reaches 61 N m, its limit is 60"]


def test_what_a_controller_misses_and_how_a_motion_starts_are_no_alarms(leg):
    slightly = resting(leg, q=(1, 0.004))
    assert broken_limits(leg, slightly, np.zeros((10, 3)), settled=True) == []
    jerk = resting(leg, ddq=(2, 13.9))
    assert broken_limits(leg, jerk, np.zeros((10, 3)), settled=False) == []


def test_noise_breaks_no_limit(leg):
    """Small motions stay inside however noisy the encoders are."""
    small = modest_series(leg, base_frequency=0.2, share=0.1)
    series = FourierSeries(0.2, small.offset + np.array([0.1, 0.0, 0.0]), small.a, small.b)
    run = simulate(leg, series, periods=1, sensors=SensorNoise(link_position=0.5, motor_position=0.5))
    assert not any("limit is" in text for text in run.warnings)


def test_a_simulation_says_that_springs_take_links_beyond(leg):
    fast = modest_series(leg, base_frequency=2.5, share=0.9)
    run = simulate(leg, fast, periods=1, sensors=SensorNoise.none())
    assert any("joint 'hip': the link reaches" in text and "rad/s2" in text for text in run.warnings)
    assert any("joint 'ankle': the link reaches" in text and "rad/s, its limit" in text for text in run.warnings)
