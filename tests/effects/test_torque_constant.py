"""A torque constant that is another one scales all that the motor gives, the torque of its own rotor too."""

import numpy as np
import pytest

import sea_ident
from sea_ident import build_regressor
from sea_ident.effects import State, base_effects, make_effect, spring_effects
from sea_ident.exceptions import EffectError
from sea_ident.motion import FourierSeries, Motion
from sea_ident.simulation import FrictionJitter, PlantedEffect, SensorNoise, SmoothCoulomb, plant_from_robot, simulate

ERROR = 0.25


@pytest.fixture(scope="module")
def leg():
    return sea_ident.load_robot("exo_leg")


def test_what_is_left_of_the_column_is_friction(leg):
    """The motor row of the whole model times the error, less the friction, which has parameters of its own."""
    rng = np.random.default_rng(4)
    motion = Motion(np.arange(20) * 0.01, *rng.standard_normal((6, 20, leg.n)))
    own = (*base_effects(leg), *spring_effects(leg))
    regressor, psi = build_regressor(leg, own, motion), plant_from_robot(leg).values_of(own)
    friction = np.array([c.effect in ("viscous_friction", "coulomb_friction") for c in regressor.columns])
    knee = leg.index("knee")
    without = regressor.motor[:, knee] @ np.where(friction, 0.0, psi)
    column = make_effect("torque_constant", "knee").evaluate(State(leg, motion)).motor[:, knee, 0]
    np.testing.assert_allclose(column, without, rtol=1e-10, atol=1e-10)
    assert np.linalg.norm(without - motion.deflection[:, knee] * leg.spring("knee").stiffness) > 0.1


def test_a_simulation_is_that_of_the_columns(leg):
    series = FourierSeries(0.5, np.array([0.1, -0.3, 0.1]), 0.1 * np.eye(3), 0.1 * np.eye(3)[::-1])
    effect = make_effect("torque_constant", "knee")
    planted = [PlantedEffect(effect, np.array([ERROR]))]
    quiet = {"sensors": SensorNoise.none(), "jitter": FrictionJitter.none(), "friction": SmoothCoulomb(0.01)}
    run = simulate(leg, series, periods=1, effects=planted, **quiet)
    own = (*base_effects(leg), *spring_effects(leg))
    regressor = build_regressor(leg, (*own, effect), run.motion)
    psi = np.append(plant_from_robot(leg).values_of(own), ERROR)
    np.testing.assert_allclose(regressor.motor @ psi, run.tau_motor, atol=1e-9)
    # that its carrier feels the rotor as it is, and not by the error, is left out: it is less by the gear ratio
    rotor = make_effect("torque_constant", "knee").rotor_torque(State(leg, run.motion))
    assert np.abs(regressor.link @ psi).max() < 0.1 * ERROR * np.abs(rotor).max()


def test_a_motor_does_not_turn_the_other_way(leg):
    with pytest.raises(EffectError, match=r"-1\.5 at 'knee'"):
        make_effect("torque_constant", "knee").modified(leg, np.array([-1.5]))
