"""A torque of the wrong sign is told beyond doubt; what a model lacks may make an inertia negative, and is no sign."""

import warnings

import numpy as np
import pytest

from estimation.synthetic import leg_series, record, truth_of
from sea_ident.effects import base_effects
from sea_ident.estimation.identify import visible_parameters
from sea_ident.estimation.observations import Observations
from sea_ident.estimation.signs import check_signs, joint_inertias, turned_torques
from sea_ident.exceptions import SeaIdentWarning
from sea_ident.processing import process
from sea_ident.robot import load_robot


@pytest.fixture(scope="module")
def leg():
    return load_robot("exo_leg")


@pytest.fixture(scope="module")
def recording(leg):
    return record(leg, truth_of(leg, leg_series()), 6, torque_noise=0.1, encoder_noise=1e-6)


def observed(leg, recording):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        processed = process(recording, leg, period=10.0)
    effects = tuple(base_effects(leg))
    return Observations(leg, effects, visible_parameters(leg, effects, processed)[0], processed)


@pytest.mark.parametrize("joint", ["hip", "knee", "ankle"])
def test_a_torque_of_the_wrong_sign_is_told(leg, recording, joint):
    column = f"tau_motor_{joint}"
    (found,) = turned_torques(observed(leg, recording.replace_columns({column: -recording.columns[column]})))
    assert f"the inertia that joint {joint!r} moves comes out negative" in found
    assert f"--column '{column}={column},sign=-1'" in found


def test_nothing_is_told_of_columns_as_they_should_be(leg, recording):
    assert turned_torques(observed(leg, recording)) == ()


def test_a_spring_beside_the_motor_is_no_wrong_sign(leg, recording):
    """The model lacks it and has a negative inertia, of which it is asked, but its motor does work against friction."""
    theta, torque = recording.columns["theta_ankle"], recording.columns["tau_motor_ankle"]
    sprung = recording.replace_columns({"tau_motor_ankle": torque + 20.0 * (theta - theta.mean())})
    observations = observed(leg, sprung)
    assert any("'ankle' moves comes out negative" in text for text in check_signs(observations))
    assert turned_torques(observations) == ()
    both = sprung.replace_columns({"tau_motor_ankle": -np.asarray(sprung.columns["tau_motor_ankle"])})
    # with both the inertia is positive: nothing is claimed of what is not sure
    assert turned_torques(observed(leg, both)) == ()


def test_a_joint_that_is_held_has_no_sign(leg, recording):
    """The torque that holds it is what the other joints ask of it, and no inertia of its own comes out of that."""
    rng = np.random.default_rng(4)
    held = {f"{kind}_hip": 0.1 + rng.normal(0.0, 1e-6, recording.samples) for kind in ("q", "theta")}
    for sign in (-1.0, 1.0):
        torque = {"tau_motor_hip": sign * recording.columns["tau_motor_hip"]}
        observations = observed(leg, recording.replace_columns({**held, **torque}))
        assert turned_torques(observations) == ()
        assert check_signs(observations) == []
        inertia, std = joint_inertias(observations)
        assert np.array_equal(np.isinf(std), [True, False, False])
        assert inertia[1] > 5.0 * std[1]
