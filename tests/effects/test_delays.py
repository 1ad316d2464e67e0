"""Signals of all joints that are late by the same time: as if each were."""

import re
import warnings

import numpy as np
import pytest

import sea_ident
from sea_ident.effects import Contribution, corrected_motion, effect_from_dict, make_effect, measured_signals
from sea_ident.exceptions import SeaIdentWarning
from sea_ident.motion import FourierSeries, Motion
from sea_ident.robot import robot_from_text

RIGID = "transmission_interface/SimpleTransmission"

SHAPES = {"torque_delay": {"delay": 0.012}, "position_delay": {"delay": 0.01, "lag": 0.004}}


@pytest.fixture(scope="module")
def arm():
    """The leg with a rigid ankle."""
    before, ankle = sea_ident.load_robot("exo_leg").urdf.split('<transmission name="ankle', 1)
    rigid = re.sub(r"<seriesElastic[^>]*/>", "", ankle.replace("sea_ident/SeriesElastic", RIGID, 1), count=1)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        return robot_from_text(f'{before}<transmission name="ankle{rigid}', "leg.urdf")


@pytest.mark.parametrize("name", SHAPES)
def test_one_delay_of_all_joints_is_that_of_each(arm, name):
    """In a model and in a record, of elastic and rigid joints, and of rows that are one joint's."""
    assert [joint.elastic for joint in arm.joints] == [True, True, False]
    whole = make_effect(name, **SHAPES[name])
    each = [make_effect(name, joint, **SHAPES[name]) for joint in arm.joint_names]
    rng = np.random.default_rng(3)
    q, theta = (
        FourierSeries(0.2, np.zeros(arm.n), *rng.standard_normal((2, arm.n, 3))).sample(samples=1000) for _ in range(2)
    )
    turned = [np.where([j.elastic for j in arm.joints], t, s) for t, s in zip(_parts(theta), _parts(q), strict=True)]
    motion = Motion(q.time, *_parts(q), *turned)
    one, many = (corrected_motion(arm, effects, motion) for effects in ([whole], each))
    for key in ("q", "dq", "ddq", "theta", "dtheta", "ddtheta"):
        np.testing.assert_array_equal(getattr(one, key), getattr(many, key))
    signals = {"q": motion.q, "theta": motion.theta, "tau_motor": q.ddq, "tau_spring": theta.ddq}
    one, many = (measured_signals(arm, effects, motion.time, signals) for effects in ([whole], each))
    for key, values in signals.items():
        np.testing.assert_array_equal(one[key], many[key])
        moves = key == "tau_motor" if name == "torque_delay" else key == "q"
        assert np.all(np.any(one[key] != values, axis=0)) == moves
    for joint in (None, 1, 2):
        rows = many = Contribution(rng.standard_normal((1000, 3, 2)), rng.standard_normal((1000, 3, 2)), joint)
        one = whole.shifted(arm, motion.time, rows)
        for effect in each:
            many = effect.shifted(arm, motion.time, many)
        np.testing.assert_array_equal(one.link, many.link)
        np.testing.assert_array_equal(one.motor, many.motor)
        if joint is not None:  # the others are nothing but zeros that nobody looks at
            others = [k for k in range(arm.n) if k != joint]
            np.testing.assert_array_equal(one.motor[:, others], rows.motor[:, others])
    speeds = whole.turning(motion, arm)
    single = [effect.turning(motion, arm) for effect in each]
    assert list(speeds) == [joint for own in single for joint in own]
    for own in single:
        for joint, speed in own.items():
            np.testing.assert_array_equal(speeds[joint], speed)
    shown = rng.standard_normal((1000, 3))
    late = shown
    for effect in each:
        late = effect.delivered(arm, motion.time, late)
    np.testing.assert_array_equal(whole.delivered(arm, motion.time, shown), late)


@pytest.mark.parametrize("name", SHAPES)
def test_it_is_told_as_one_of_all_joints(name):
    whole = make_effect(name, **SHAPES[name])
    assert whole.title == f"{name} at all joints"
    assert whole.parameter_name("delay") == f"robot.{name}_delay"
    assert effect_from_dict(whole.to_dict()) == whole
    assert make_effect(name, "knee", **SHAPES[name]).title == f"{name} at knee"


@pytest.mark.parametrize(("delay", "torques", "encoders"), [(0.004, "early", "late"), (-0.004, "late", "early")])
def test_what_torques_are_late_by_encoders_are_early_by(delay, torques, encoders):
    """The torque recorded at t acts at t + delay."""
    said = make_effect("torque_delay", delay=delay).reservation
    assert f"torques that are {torques} by 0.004 s, or all encoders that are {encoders}" in said
    assert make_effect("torque_delay", "knee", delay=delay).reservation is None


def _parts(motion):
    return motion.q, motion.dq, motion.ddq
