"""A torque channel that was computed from the deflection is told from one that was measured."""

import numpy as np
import pytest

from sea_ident.discrepancy.measured.circular import circular_springs
from sea_ident.recordings import Recording
from sea_ident.simulation import SensorNoise


@pytest.fixture(scope="module")
def recording(laboratory):
    return laboratory.record(periods=1)


def with_torque(recording, torque):
    return Recording(recording.time, {**recording.columns, "tau_spring_knee": torque}, "r")


def deflection(recording):
    return recording.columns["theta_knee"] - recording.columns["q_knee"]


def test_a_multiple_of_the_deflection_is_circular_and_the_factor_said(laboratory, recording):
    (text,) = circular_springs(laboratory.leg, with_torque(recording, 187.5 * deflection(recording) + 0.3))
    assert text.startswith("tau_spring_knee is 187.5 times the recorded deflection")


def test_a_measured_torque_is_not_circular_but_not_used(laboratory, recording):
    """Of a spring that stiffens, with noise: a line through the deflection leaves what the cubic term is."""
    noise = 0.5 * np.random.default_rng(0).standard_normal(len(recording.time))
    own = deflection(recording)
    torque = 200.0 * own + 8000.0 * own**3 + noise
    (text,) = circular_springs(laboratory.leg, with_torque(recording, torque))
    columns = np.column_stack([own, np.ones(len(own))])
    left = torque - columns @ np.linalg.lstsq(columns, torque, rcond=None)[0]
    assert "circular and proves nothing" in text
    assert f"leaves {100 * np.var(left) / np.var(torque):.0f} % of its variance" in text


def test_nothing_is_said_of_what_is_not_there(laboratory, recording):
    assert circular_springs(laboratory.leg, recording) == ()
    assert circular_springs(laboratory.leg, object()) == ()


def test_a_torque_sensor_of_the_simulator_is_not_circular(laboratory):
    measured = laboratory.record(periods=1, sensors=SensorNoise(spring_torque=0.3))
    found = circular_springs(laboratory.leg, measured)
    assert len(found) == 3
    assert all("was not used" in text for text in found)
