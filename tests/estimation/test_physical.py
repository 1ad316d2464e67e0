from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from estimation.synthetic import record
from sea_ident.effects import base_effects
from sea_ident.estimation import Box, JointWLS, Pull, identify, physical_parameters
from sea_ident.estimation.physical import _Problem
from sea_ident.estimation.pseudo_inertia import inertial_parameters, pseudo_inertia
from sea_ident.exceptions import IdentificationError
from sea_ident.motion import FourierSeries, Motion
from sea_ident.processing import from_states
from sea_ident.regressor import build_total, inverse_dynamics, prior_parameters
from sea_ident.robot import load_robot


@pytest.fixture(scope="module")
def model(leg, truth):
    return identify(leg, record(leg, truth, 8, torque_noise=0.2, encoder_noise=1e-6), period=10.0)


def test_pseudo_inertia_is_that_of_pinocchio():
    inertia = pin.Inertia.Random()
    parameters = inertia.toDynamicParameters()
    expected = pin.PseudoInertia.FromInertia(inertia).toMatrix()
    np.testing.assert_allclose(pseudo_inertia(parameters), expected, atol=1e-14)
    np.testing.assert_allclose(inertial_parameters(expected), parameters, atol=1e-14)


@pytest.mark.parametrize("pull", Pull)
def test_consistent_data_are_kept_to_the_last_digit(model, pull):
    found = physical_parameters(model, pull=pull)
    assert found.consistent
    np.testing.assert_allclose(found.base_values, model.values, rtol=1e-12)
    for k in range(3):
        assert np.linalg.eigvalsh(pseudo_inertia(found.values[10 * k : 10 * k + 10]))[0] > 0.0


def test_free_directions_are_those_of_the_description(model, leg, truth):
    # with the true base parameters and the true description, nothing is left to move
    exact = replace(model, values=model.base.project(truth.parameters))
    for pull in Pull:
        found = physical_parameters(exact, pull=pull)
        np.testing.assert_allclose(found.values, truth.parameters, rtol=1e-5, atol=1e-7)


def test_robot_with_these_parameters_has_the_torque_of_the_model(model, leg, truth):
    found = physical_parameters(model)
    motion = truth.motion[::100]
    inert = [column.effect in ("rigid_bodies", "rotor_inertia") for column in found.columns]
    still = replace(model, values=model.base.project(np.where(inert, found.values, 0.0)))
    link, motor = inverse_dynamics(found.robot(), motion)
    np.testing.assert_allclose(link + motor, still.predict(motion), rtol=1e-9, atol=1e-9)


def test_impossible_values_move_to_the_nearest_possible(model):
    values = model.values.copy()
    row = model.names.index("foot.Iyy")
    values[row] = -0.02
    found = physical_parameters(replace(model, values=values))
    assert not found.consistent
    assert found.bodies[0] == "foot"
    assert found.base_values[row] > 0.0
    assert found.chi_square > 0.0
    assert "foot" in found.summary()
    # no possible parameters are nearer: any pull back toward the identified values is toward the outside
    gradient = model.information @ found.shift
    assert gradient @ (values - found.base_values) < 0.0


@pytest.mark.parametrize("value", [-1e-3, -1e-7, -1e-12])
def test_no_friction_stays_below_zero_by_however_little(model, value):
    values = model.values.copy()
    values[model.names.index("ankle.coulomb_friction")] = value
    found = physical_parameters(replace(model, values=values))
    assert 0.0 <= found.named()["ankle.coulomb_friction"] < 1e-3


def test_a_solver_that_ends_outside_by_its_accuracy_leaves_a_robot_that_can_be_built(model, monkeypatch):
    solved = _Problem.drawn_or_nearest

    def beside(problem, target, nearest, pull):
        values, drawn_by = solved(problem, target, nearest, pull)
        values[problem.signed] = -1e-9 * problem.scale[problem.signed]
        return values, drawn_by

    monkeypatch.setattr(_Problem, "drawn_or_nearest", beside)
    found = physical_parameters(model)
    signed = [k for k, c in enumerate(found.columns) if c.effect in ("rotor_inertia", "coulomb_friction")]
    assert signed
    assert np.all(found.values[signed] == 0.0)
    assert np.all(found.robot().rotor_inertias() == 0.0)
    np.testing.assert_allclose(found.base_values, found.model.base.project(found.values))


def test_negative_friction_becomes_zero(model):
    values = model.values.copy()
    row = model.names.index("ankle.coulomb_friction")
    values[row] = -0.5
    found = physical_parameters(replace(model, values=values))
    assert "ankle.coulomb_friction" in found.limited
    assert 0.0 <= found.named()["ankle.coulomb_friction"] < 1e-3


def test_mass_lies_inside_its_box(model):
    box = Box(np.array([-0.1, -0.05, -0.5]), np.array([0.1, 0.15, 0.05]))
    found = physical_parameters(model, boxes={"thigh": box})
    values = found.named()
    mass = values["thigh.m"]
    centre = np.array([values[f"thigh.m{a}"] for a in "xyz"]) / mass
    assert np.all(centre > box.lower)
    assert np.all(centre < box.upper)
    second = np.diag(pseudo_inertia(found.values[:10])[:3, :3])
    # no mass between the planes has a larger second moment than if all of it sat on them
    assert np.all(second <= mass * ((box.lower + box.upper) * centre - box.lower * box.upper) + 1e-6)
    with pytest.raises(IdentificationError, match="no moving link arm"):
        physical_parameters(model, boxes={"arm": box})


@pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")
def test_seven_joints_predict_another_motion_no_worse_than_the_free_fit():
    arm = load_robot(
        "example:baxter_description/urdf/baxter.urdf",
        "baxter_sea",
        ("left_s0", "left_s1", "left_e0", "left_e1", "left_w0", "left_w1", "left_w2"),
    )
    effects = base_effects(arm)
    parameters = np.nan_to_num(prior_parameters(arm, effects))
    rng = np.random.default_rng(0)

    def motion(samples):
        links, springs = (FourierSeries(0.1, np.zeros(7), *(s * rng.normal(size=(2, 7, 5)))) for s in (0.3, 0.01))
        link, spring = links.sample(samples=samples), springs.sample(samples=samples)
        motors = (link.q + spring.q, link.dq + spring.dq, link.ddq + spring.ddq)
        return Motion(link.time, link.q, link.dq, link.ddq, *motors)

    seen, other = motion(600), motion(200)
    torque = build_total(arm, effects, seen) @ parameters
    torque = torque + rng.standard_normal(torque.shape)
    model = identify(arm, from_states(arm, seen, torque), effects=effects, estimator=JointWLS())
    found = physical_parameters(model)
    assert not found.consistent
    assert found.bodies
    inertias = [place for place, column in enumerate(found.columns) if column.name.endswith(".m")]
    for first in inertias:
        assert np.linalg.eigvalsh(pseudo_inertia(found.values[first : first + 10]))[0] > 0.0
    exact = build_total(arm, effects, other) @ parameters
    free, possible = (np.sqrt(np.mean((m.predict(other) - exact) ** 2)) for m in (model, found.model))
    assert possible < 1.02 * free


def test_a_move_within_the_uncertainty_is_no_alarm(model):
    row = model.names.index("foot.Iyy")
    values = model.values.copy()
    values[row] = -1e-5
    loose = replace(model, values=values, uncertainty=replace(model.uncertainty, covariance=4e4 * model.covariance))
    near = physical_parameters(loose)
    assert not near.consistent
    assert near.within_uncertainty
    assert "within their uncertainty" in near.verdict()
    values[row] = -0.02
    far = physical_parameters(replace(model, values=values))
    assert not far.within_uncertainty
    assert far.verdict().startswith("no real bodies")
    assert "standard deviations" in far.verdict()
