"""A torque in another unit, or before the gear, is told by the factor between it and that of the model."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

import sea_ident
from sea_ident.discrepancy import Verdict
from sea_ident.estimation.torque_units import other_torque_units
from sea_ident.exceptions import SeaIdentWarning
from sea_ident.simulation import simulate

PERIOD = 5.0


@pytest.fixture(scope="module")
def recorded():
    """A leg, its model, and another recording of the same motion."""
    leg = sea_ident.load_robot("exo_leg")
    series = sea_ident.design_excitation(leg, base_frequency=1.0 / PERIOD, harmonics=5, starts=1, seed=0).series
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        first, second = (simulate(leg, series, periods=4, seed=seed).recording for seed in (1, 2))
        return leg, sea_ident.identify(leg, first, period=PERIOD), second


def scaled(recording, joint, factor):
    column = f"current_{joint}"
    columns = {**recording.columns, column: factor * recording.columns[column]}
    return replace(recording, columns=columns)


def found(recorded, joint, factor):
    leg, model, recording = recorded
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        return other_torque_units(model, sea_ident.process(scaled(recording, joint, factor), leg, period=PERIOD))


@pytest.mark.scenario
@pytest.mark.parametrize("factor", [1.0, -1.0, 1.3, 2.0, 30.0])
def test_what_is_no_unit_is_not_called_one(recorded, factor):
    assert found(recorded, "knee", factor) == ()


@pytest.mark.scenario
def test_a_torque_of_another_course_is_no_unit(recorded):
    """A thousand times that of the model, and far more that has nothing to do with it."""
    leg, model, recording = recorded
    other = scaled(recording, "knee", 1000.0).columns["current_knee"]
    beside = 5.0 * np.std(other) * np.sin(2.0 * np.pi * 35.0 / PERIOD * recording.time)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        disturbed = replace(recording, columns={**recording.columns, "current_knee": other + beside})
        assert other_torque_units(model, sea_ident.process(disturbed, leg, period=PERIOD)) == ()


@pytest.mark.scenario
def test_thousandths_and_a_torque_before_the_gear_are_recognised(recorded):
    (text,) = found(recorded, "knee", 1000.0)
    assert "'knee'" in text
    assert "unit='mN m'" in text
    assert "current_knee,unit=mA" in text
    ratio = recorded[0].joints[1].actuator.gear_ratio
    (text,) = found(recorded, "knee", 1.0 / ratio)
    assert f"gear_ratio={ratio:g}" in text


@pytest.mark.scenario
def test_nothing_is_concluded_from_such_a_recording(recorded):
    _, model, recording = recorded
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        said = sea_ident.diagnose(model, scaled(recording, "hip", 1000.0), period=PERIOD)
    assert said.verdict is Verdict.CANNOT_TELL
    assert any("times that of the model" in text for text in said.warnings)
