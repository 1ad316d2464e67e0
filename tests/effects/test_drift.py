"""Effects that change in the course of a recording: when they are none, and what they add by then."""

from dataclasses import replace

import numpy as np
import pytest

from sea_ident import load_robot
from sea_ident.base_parameters import random_motion
from sea_ident.effects import State, effect_classes, effect_from_dict, make_effect
from sea_ident.effects.drift import TrendEffect, warming

TIME = np.linspace(0.0, 300.0, 7)
IN_TIME = ("friction_drift", "stiffness_drift", "torque_constant_drift")


def test_warming_begins_with_one_per_minute_and_ends_with_its_time_constant():
    assert warming(np.array(1e-3), 50.0) == pytest.approx(1e-3 / 60.0, rel=1e-4)
    assert warming(np.array(1e6), 50.0) == pytest.approx(50.0 / 60.0)
    np.testing.assert_allclose(warming(TIME, 1e9), TIME / 60.0, rtol=1e-6)


@pytest.mark.parametrize("name", IN_TIME)
@pytest.mark.parametrize("constant", [40.0, 1e4])
def test_a_drift_is_counted_from_the_moment_at_which_it_is_none(name, constant):
    plain = make_effect(name, "knee", time_constant=constant)
    np.testing.assert_array_equal(plain.change(TIME, None), warming(TIME, constant))
    level = float(np.mean(plain.change(TIME, None)))
    about = plain.about(level)
    assert about.change(np.array(about.reference), None) == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_allclose(about.change(TIME, None), plain.change(TIME, None) - level, atol=1e-12)
    # once more, from there
    again = about.about(0.1)
    np.testing.assert_allclose(again.change(TIME, None), plain.change(TIME, None) - level - 0.1, atol=1e-12)
    # and back
    assert again.about(-level - 0.1).reference == pytest.approx(0.0, abs=1e-8)
    assert effect_from_dict(about.to_dict()) == about


def test_a_temperature_is_counted_from_another_one_which_a_simulation_then_has_throughout():
    plain = make_effect("temperature_friction", "knee", reference=20.0, rise=10.0)
    about = plain.about(7.5)
    temperature = np.linspace(15.0, 40.0, 6)
    np.testing.assert_allclose(about.change(TIME[:6], temperature), plain.change(TIME[:6], temperature) - 7.5)
    np.testing.assert_array_equal(about.temperature(TIME), 27.5)
    assert about.moment == "at 27.5 degC"


def test_the_moment_is_said_and_a_time_constant_where_there_is_one():
    drift = make_effect("friction_drift", "knee", time_constant=40.0, reference=12.5)
    assert drift.moment == "12.5 s after a recording begins, with a time constant of 40 s"
    assert replace(drift, time_constant=1e5).moment == "12.5 s after a recording begins, straight on"
    assert TrendEffect.moment.fget(drift) == "in the mean of a recording"


@pytest.mark.parametrize("name", IN_TIME)
def test_its_columns_are_those_of_a_change_of_one_times_the_change(name):
    """For what follows the load of the joint, too, where no torque was measured."""
    leg = load_robot("exo_leg")
    drift = make_effect(name, "knee", time_constant=40.0, reference=12.5)
    state = State(leg, replace(random_motion(leg, 7, 2), time=TIME))
    change = drift.change(TIME, None)[:, None, None]
    whole, one = drift.evaluate(state), drift.steady(state)
    assert np.any(one.motor)
    np.testing.assert_allclose(whole.motor, one.motor * change, rtol=1e-12)
    np.testing.assert_allclose(whole.link, one.link * change, rtol=1e-12)


@pytest.mark.parametrize(
    ("name", "values"),
    [("friction_drift", (0.2, 0.5)), ("stiffness_drift", (30.0,)), ("temperature_friction", (0.02, 0.05))],
)
def test_what_has_changed_throughout_is_more_of_what_was_there(name, values):
    leg = load_robot("exo_leg")
    drift, values = make_effect(name, "knee"), np.array(values)
    state = State(leg, random_motion(leg, 7, 2))
    parts = [(effect.evaluate(state), own) for effect, own in drift.throughout(values, -1.5)]
    whole = drift.steady(state)
    assert np.any(whole.motor)
    for side in ("link", "motor"):
        there = sum(getattr(part, side) @ own for part, own in parts)
        np.testing.assert_allclose(there, -1.5 * getattr(whole, side) @ values, rtol=1e-12)


def test_a_torque_constant_that_has_changed_gives_less_of_what_is_recorded():
    leg = load_robot("exo_leg")
    drift = make_effect("torque_constant_drift", "knee")
    assert drift.throughout(np.array([0.1]), 2.0) == ()
    np.testing.assert_allclose(drift.delivered_share(leg, np.array([0.1]), 2.0), [1.0, 0.8, 1.0])
    np.testing.assert_array_equal(
        make_effect("stiffness_drift", "knee").delivered_share(leg, np.array([9.0]), 2.0), 1.0
    )


def test_every_drift_of_the_library_acts_in_a_simulation_of_one_mean():
    """What acts in the columns alone would be predicted on another motion, and not simulated there."""
    leg = load_robot("exo_leg")
    drifts = [kind("knee") for kind in effect_classes().values() if issubclass(kind, TrendEffect)]
    assert {drift.name for drift in drifts} >= {*IN_TIME, "temperature_friction"}
    for drift in drifts:
        values = np.full(len(drift.columns(leg)), 0.1)
        acts = drift.throughout(values, 2.0) or np.any(drift.delivered_share(leg, values, 2.0) != 1.0)
        assert acts, drift.name
