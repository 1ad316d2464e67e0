"""The information matrix and its gradient: against `build_regressor`, differences, and Pinocchio's derivatives."""

import numpy as np
import pinocchio as pin
import pytest

from sea_ident.effects import base_effects, make_effect, spring_effects
from sea_ident.effects.rigid_bodies import RigidBodies
from sea_ident.excitation import (
    AOptimality,
    ConditionNumber,
    Discrimination,
    DOptimality,
    EOptimality,
    PredictedMotors,
    Scaling,
    reduced_effects,
)
from sea_ident.excitation.design_model import design_model
from sea_ident.excitation.information import Information
from sea_ident.excitation.states import Sampling
from sea_ident.regressor import build_regressor

CRITERIA = [
    DOptimality(),
    AOptimality(),
    EOptimality(),
    ConditionNumber(),
    ConditionNumber(columns=Scaling.UNIT_COLUMNS),
]


def problem(robot, effects, criterion=None, motors=None, harmonics=4, samples=80):
    model, bound = design_model(robot, tuple(effects), criterion or DOptimality(), motors)
    p = len(model.names)
    weights = np.linspace(0.5, 1.5, model.columns.rows)
    sampling = Sampling(0.1, harmonics, samples)
    return Information(model.columns, sampling, 2.0, weights, np.zeros((p, p)), model.springs), bound


def random_coefficients(robot, harmonics=4, size=0.4, seed=0):
    return size * np.random.default_rng(seed).normal(size=(robot.n, 2 * harmonics + 1))


def smooth_friction(robot):
    """Friction that turns over within what the samples show, so that differences can judge."""
    return (
        *RigidBodies.instances(robot),
        *(make_effect("viscous_friction", name) for name in robot.joint_names),
        *(make_effect("coulomb_friction", name, smoothing=0.3) for name in robot.joint_names),
    )


def directional(function, point, direction, step=1e-4):
    def f(steps):
        return function(point + steps * step * direction)

    return (8.0 * (f(1) - f(-1)) - (f(2) - f(-2))) / (12.0 * step)


@pytest.mark.parametrize("name", ["exo_leg", "ur10", "panda", "baxter arm"])
def test_matrix_is_that_of_the_regressor(robot_of, name):
    robot = robot_of(name)
    information, _ = problem(robot, reduced_effects(robot))
    point = random_coefficients(robot)
    motion = information.sampling.rigid(point).motion
    rows = build_regressor(robot, reduced_effects(robot), motion).sum[:, :, information.columns.chosen]
    rows = rows * information.weights[:, None]
    expected = 2.0 * np.einsum("nrp,nrs->ps", rows, rows)
    np.testing.assert_allclose(information.matrix(point), expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("name", ["exo_leg", "ur10", "panda", "baxter arm"])
def test_gradient_of_log_det_matches_central_differences(robot_of, name):
    robot = robot_of(name)
    information, criterion = problem(robot, smooth_friction(robot), samples=200)
    point = random_coefficients(robot)
    local = information.model(point)
    gradient = local.gradient(criterion.local(local.matrix).derivative)
    rng = np.random.default_rng(1)
    for _ in range(3):
        direction = rng.normal(size=point.shape)
        expected = directional(lambda x: criterion.value(information.matrix(x)), point, direction)
        assert gradient @ direction.ravel() == pytest.approx(expected, rel=1e-6, abs=1e-6 * np.linalg.norm(gradient))


@pytest.mark.parametrize("criterion", CRITERIA, ids=lambda c: f"{c.name} {getattr(c, 'columns', '')}")
def test_gradient_of_every_criterion(robot_of, criterion):
    robot = robot_of("exo_leg")
    information, _ = problem(robot, smooth_friction(robot), criterion)
    point, direction = random_coefficients(robot), random_coefficients(robot, seed=5)
    local = information.model(point)
    gradient = local.gradient(criterion.local(local.matrix).derivative)
    expected = directional(lambda x: criterion.value(information.matrix(x)), point, direction, step=1e-5)
    assert gradient @ direction.ravel() == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("effect", [make_effect("base_tilt"), make_effect("external_force", "knee", stop=5.0)])
def test_gradient_with_an_effect_that_the_position_alone_matters_to(robot_of, effect):
    robot = robot_of("exo_leg")
    information, criterion = problem(robot, (*smooth_friction(robot), effect), samples=200)
    point, direction = random_coefficients(robot), random_coefficients(robot, seed=5)
    local = information.model(point)
    gradient = local.gradient(criterion.local(local.matrix).derivative)
    expected = directional(lambda x: criterion.value(information.matrix(x)), point, direction, step=1e-4)
    assert gradient @ direction.ravel() == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("name", ["exo_leg", "ur10", "panda"])
def test_gradient_of_log_det_by_inverse_dynamics(robot_of, name):
    """An independent method: RNEA is linear in the inertial parameters.

    tr(W' dPhi) is the derivative of torques of bodies whose ten parameters are rows of W. An offset of a unit mass
    keeps their centres of mass finite; its own derivative is taken off again.
    """
    robot = robot_of(name)
    information, criterion = problem(robot, RigidBodies.instances(robot), harmonics=2, samples=30)
    point = random_coefficients(robot, harmonics=2)
    local = information.model(point)
    found = local.gradient(criterion.local(local.matrix).derivative)
    model = pin.Model(robot.model)
    data, chosen = model.createData(), information.columns.chosen
    take = np.array([robot.extended_model.joints[int(k)].idx_v for k in robot.body_indices])
    to_coordinates = robot.link_map[take]
    motion = information.sampling.rigid(point).motion
    phi = local.phi  # weighted with weights and the root of the gain
    levers = 2.0 * np.einsum("ps,rsn->rpn", np.linalg.inv(local.matrix), phi) * information.weights[:, None, None]
    levers *= np.sqrt(information.gain)
    unit = np.zeros((model.njoints - 1, 10))
    unit[:, 0], unit[:, [4, 6, 9]] = 1.0, 1.0

    def derivatives(parameters, k):
        for body in range(1, model.njoints):
            model.inertias[body] = pin.Inertia.FromDynamicParameters(parameters[body - 1])
        state = [to_coordinates @ values[k] for values in (motion.q, motion.dq, motion.ddq)]
        state[0] = state[0] + robot.offset[take]
        by_q, by_v, by_a = pin.computeRNEADerivatives(model, data, *state)
        by_a = np.triu(by_a) + np.triu(by_a, 1).T
        return np.stack([to_coordinates.T @ by @ to_coordinates for by in (by_q, by_v, by_a)])

    by_state = np.zeros((3, robot.n, len(motion)))
    for k in range(len(motion)):
        plain = derivatives(unit, k)
        for row in range(robot.n):
            parameters = unit.copy().ravel()
            # of size one beside the unit mass
            size = np.abs(levers[row, :, k]).max()
            parameters[chosen] += levers[row, :, k] / size
            # a mass of zero would lose its centre
            heavy = 2.0 * unit.ravel() + parameters
            change = derivatives(heavy.reshape(-1, 10), k) - 3.0 * plain
            by_state[:, :, k] += size * change[:, row]
    expected = sum(by_state[d] @ information.sampling.bases[d] for d in range(3)).ravel()
    np.testing.assert_allclose(found, expected, atol=1e-8 * np.abs(expected).max())


@pytest.mark.parametrize("name", ["exo_leg", "baxter wrist"])
def test_gradient_through_predicted_motors(robot_of, name):
    robot = robot_of(name)
    effects = (*base_effects(robot), *spring_effects(robot))
    effects = tuple(
        make_effect("coulomb_friction", effect.joint, smoothing=0.3) if effect.name == "coulomb_friction" else effect
        for effect in effects
    )
    motors = PredictedMotors(stiffness=dict.fromkeys(robot.joint_names, 60.0))
    information, criterion = problem(robot, effects, motors=motors, samples=160)
    point, direction = random_coefficients(robot, size=0.2), random_coefficients(robot, seed=5)
    local = information.model(point)
    gradient = local.gradient(criterion.local(local.matrix).derivative)
    expected = directional(lambda x: criterion.value(information.matrix(x)), point, direction)
    assert gradient @ direction.ravel() == pytest.approx(expected, rel=1e-6)


def test_predicted_motors_balance_the_springs(robot_of):
    """At the predicted deflection the spring carries the torque of the links, and theta' is the slope of theta."""
    robot = robot_of("exo_leg")
    springs = PredictedMotors().springs(robot)
    sampling = Sampling(0.1, 4, 400)
    point = random_coefficients(robot, size=0.2)
    motion = sampling.elastic(point, springs).motion
    torque = springs.torque.evaluate(sampling.rigid(point).motion, derivatives=False)[0]
    bent = motion.deflection
    np.testing.assert_allclose(springs.linear * bent + springs.cubic * bent**3, torque, atol=1e-9)
    assert np.abs(bent).max() > 0.01
    ahead = np.roll(motion.theta, -1, axis=0) - np.roll(motion.theta, 1, axis=0)
    # the error of a central difference: step^2 / 6 of the third derivative
    third = np.abs(np.gradient(np.gradient(motion.dtheta, 0.025, axis=0), 0.025, axis=0)).max()
    np.testing.assert_allclose(ahead / 0.05, motion.dtheta, atol=0.3 * 0.025**2 * third)


@pytest.mark.parametrize("criterion", [*CRITERIA, "discrimination"], ids=str)
def test_change_of_the_matrix_with_every_coefficient(robot_of, criterion):
    """The curvature is built from dG; it is single precision and must be right where it comes from all samples."""
    robot = robot_of("exo_leg")
    if criterion == "discrimination":
        criterion = Discrimination(make_effect("torque_offset", "knee"))
    information, bound = problem(robot, smooth_friction(robot), criterion, harmonics=4, samples=60)
    point, direction = random_coefficients(robot), random_coefficients(robot, seed=6)
    local = information.model(point)
    vectors = bound.local(local.matrix).vectors
    changes = np.einsum("v,vij->ij", direction.ravel(), local.changes(vectors))
    expected = vectors.T @ directional(information.matrix, point, direction) @ vectors
    np.testing.assert_allclose(changes, expected, atol=2e-4 * np.abs(expected).max())


@pytest.mark.parametrize("columns", [1, 3])
def test_discrimination_is_what_is_left_of_the_target(columns):
    """Against its definition: residuals of a least-squares fit of the target's columns by all others."""
    rng = np.random.default_rng(7)
    phi = rng.normal(size=(50, 8))
    rest, target = phi[:, : 8 - columns], phi[:, 8 - columns :]
    left = target - rest @ np.linalg.lstsq(rest, target, rcond=None)[0]
    criterion = Discrimination(make_effect("torque_offset", "knee")).bind(columns)
    matrix = phi.T @ phi
    assert criterion.value(matrix) == pytest.approx(np.linalg.slogdet(left.T @ left)[1], rel=1e-10)
    change = rng.normal(size=(8, 8))
    change = change + change.T
    local = criterion.local(matrix)
    step = 1e-3
    values = [criterion.value(matrix + s * step * change) for s in (-2, -1, 0, 1, 2)]
    first = (8.0 * (values[3] - values[1]) - (values[4] - values[0])) / (12.0 * step)
    second = (16.0 * (values[3] + values[1]) - (values[4] + values[0]) - 30.0 * values[2]) / (12.0 * step**2)
    assert np.sum(local.derivative * change) == pytest.approx(first, rel=1e-8)
    bend = (local.weights * (local.vectors.T @ change @ local.vectors) ** 2).sum()
    assert -bend == pytest.approx(second, rel=1e-5)


def test_criteria_are_what_they_say():
    matrix = np.diag([4.0, 1.0, 0.25])
    assert DOptimality().value(matrix) == pytest.approx(0.0, abs=1e-12)
    assert AOptimality().value(matrix) == pytest.approx(-np.log(0.25 + 1.0 + 4.0))
    assert EOptimality().reported(matrix) == pytest.approx(np.log(0.25))
    assert ConditionNumber().reported(matrix) == pytest.approx(-np.log(4.0))
    assert ConditionNumber(columns=Scaling.UNIT_COLUMNS).reported(matrix) == pytest.approx(0.0, abs=1e-12)
    assert DOptimality().value(np.diag([1.0, 0.0])) == -np.inf
    assert ConditionNumber(sharpness=50).value(matrix) == pytest.approx(-np.log(4.0), abs=0.02)
