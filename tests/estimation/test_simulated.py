"""The whole chain on simulated experiments, whose truth is the robot's own description."""

import numpy as np
import pytest

from sea_ident.effects import base_effects
from sea_ident.effects.link_friction import LinkFriction
from sea_ident.estimation import LeastSquares, Observations, identify
from sea_ident.estimation.springs import springs_from
from sea_ident.motion import FourierSeries
from sea_ident.processing import from_states, process
from sea_ident.regressor import prior_parameters
from sea_ident.robot import load_robot
from sea_ident.simulation import FrictionJitter, SensorNoise, SmoothCoulomb, simulate

pytestmark = pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")


def series():
    """Inside the limits of the leg; hip and knee swing against each other."""
    rng = np.random.default_rng(2)
    a, b = rng.normal(0.0, 1.0, (2, 3, 5)) * np.array([0.12, 0.12, 0.5])[:, None]
    return FourierSeries(0.2, np.array([0.35, -0.25, 0.5]), a, b)


@pytest.fixture(scope="module")
def experiment(leg):
    return simulate(
        leg,
        series(),
        periods=2,
        sensors=SensorNoise.none(),
        jitter=FrictionJitter.none(),
        friction=SmoothCoulomb(0.01),  # as the effect has it
    )


def test_exact_states_give_sixteen_parameters_and_nine_of_the_springs(leg, experiment):
    model = identify(leg, from_states(leg, experiment.motion, experiment.tau_motor), estimator=LeastSquares())
    exact = model.base.project(prior_parameters(leg, base_effects(leg)))
    assert len(exact) == 16
    np.testing.assert_allclose(model.values, exact, rtol=1e-8)
    found = [(s.stiffness, s.cubic_stiffness, s.damping) for s in model.springs]
    planted = [(s.stiffness, s.cubic_stiffness, s.damping) for s in map(leg.spring, leg.joint_names)]
    np.testing.assert_allclose(found, planted, rtol=1e-8)


def test_error_of_the_whole_chain_falls_as_harmonics_are_added(leg, experiment):
    error = []
    for harmonics in (15, 45, 135, 400):
        processed = process(experiment.recording, leg, period=5.0, link_harmonics=harmonics, motor_harmonics=harmonics)
        model = identify(leg, processed, estimator=LeastSquares())
        exact = model.base.project(prior_parameters(leg, base_effects(leg)))
        error.append(np.sqrt(np.mean((model.values / exact - 1.0) ** 2)))
    assert np.all(np.diff(error) < 0.0), error
    assert error[-1] < 0.02 * error[0]
    assert error[-1] < 1e-3


def test_springs_do_not_depend_on_harmonics_of_theta_that_q_lacks(leg, experiment):
    """Those would be deflections that no torque of the link answers."""
    exact = None
    found = []
    for harmonics in (60, 240):
        processed = process(experiment.recording, leg, period=5.0, link_harmonics=60, motor_harmonics=harmonics)
        model = identify(leg, processed, estimator=LeastSquares())
        exact = model.base.project(prior_parameters(leg, base_effects(leg)))
        laws = springs_from(Observations(leg, model.effects, model.base, processed), exact, model.uncertainty)
        found.append([(s.stiffness, s.cubic_stiffness, s.damping) for s in laws])
    np.testing.assert_allclose(found[1], found[0], rtol=1e-3)


def test_friction_of_links_and_motors_is_told_apart(experiment):
    """22 columns: the deflection makes link and motor move differently, though only a little."""
    robot = load_robot("exo_leg_link_friction")
    both = simulate(
        robot,
        series(),
        periods=1,
        sensors=SensorNoise.none(),
        jitter=FrictionJitter.none(),
        friction=SmoothCoulomb(0.01),
    )
    effects = (*base_effects(robot), *LinkFriction.instances(robot))
    states = from_states(robot, both.motion, both.tau_motor)
    whole = identify(robot, states, effects=effects, estimator=LeastSquares())
    exact = whole.base.project(prior_parameters(robot, effects))
    assert len(exact) == 22
    np.testing.assert_allclose(whole.values, exact, rtol=1e-6)
    # lumping all friction at the motor is another model: it absorbs the sum, and shifts what it must not
    lumped = identify(robot, states, estimator=LeastSquares())
    named = dict(zip(whole.names, exact, strict=True))
    motor = dict(zip(lumped.names, lumped.values, strict=True))
    for i, joint in enumerate(robot.joint_names):
        speed = float(np.sqrt(np.mean(both.motion.dq[:, i] ** 2)))
        total = named[f"{joint}.coulomb_friction"] + named[f"{joint}.link_friction_coulomb"]
        total += speed * (named[f"{joint}.viscous_friction"] + named[f"{joint}.link_friction_viscous"])
        found = motor[f"{joint}.coulomb_friction"] + speed * motor[f"{joint}.viscous_friction"]
        assert found == pytest.approx(total, rel=0.1)
    assert lumped.fit.rms_residual.max() > 1e4 * whole.fit.rms_residual.max()
    # separating costs information: the columns of both sides are nearly the same
    assert whole.fit.condition_number > 3.0 * lumped.fit.condition_number
