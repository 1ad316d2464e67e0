"""A torque constant that is another one scales all that the motor gives, the torque of its own rotor too."""

import numpy as np
import pytest
from chains import rigid_chain

import sea_ident
from sea_ident import build_regressor
from sea_ident.effects import Anchor, State, base_effects, make_effect, spring_effects
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


def simulated(robot, joint, series, error):
    """Torque of the columns in the rows of the links and of the motors, and what was simulated, beside a spring."""
    effects = make_effect("torque_constant", joint), make_effect("parallel_spring", joint)
    values = np.array([error]), np.array([8.0, 1.0])
    planted = [PlantedEffect(effect, value) for effect, value in zip(effects, values, strict=True)]
    quiet = {"sensors": SensorNoise.none(), "jitter": FrictionJitter.none(), "friction": SmoothCoulomb(0.01)}
    run = simulate(robot, series, periods=1, effects=planted, start=series.motion(np.zeros(1)), **quiet)
    own = (*base_effects(robot), *spring_effects(robot), effects[1])
    psi = np.append(np.nan_to_num(plant_from_robot(robot).values_of(own[:-1])), values[1])
    columns = [column.name for effect in own for column in effect.columns(robot)]
    anchored = effects[0].anchored(Anchor(robot, own, dict(zip(columns, psi, strict=True))))
    regressor = build_regressor(robot, (*own, anchored), run.motion)
    psi = np.append(psi, error)
    return regressor.link @ psi, regressor.motor @ psi, run


@pytest.mark.parametrize("error", [ERROR, -0.4])
def test_a_simulation_is_that_of_the_columns(leg, error):
    """The carrier of the rotor feels it as it is, and not by the error."""
    series = FourierSeries(0.5, np.array([0.1, -0.3, 0.1]), 0.1 * np.eye(3), 0.1 * np.eye(3)[::-1])
    link, motor, run = simulated(leg, "knee", series, error)
    np.testing.assert_allclose(motor, run.tau_motor, atol=1e-10)
    np.testing.assert_allclose(link, 0.0, atol=1e-10)


@pytest.mark.parametrize("error", [ERROR, -0.4])
def test_a_simulation_of_a_rigid_joint_is_that_of_the_columns(error):
    robot = rigid_chain(
        ["0 0 1", "0 -1 0"],
        ["0.02 0.01 -0.14", "0.02 0.01 -0.12"],
        [2.0, 1.3],
        'ixx="0.02" iyy="0.021" izz="0.004"',
        ["0 0 1", "0 0 -0.3"],
        "<mechanicalReduction>50</mechanicalReduction><rotorInertia>8e-5</rotorInertia>"
        "<viscousFriction>0.4</viscousFriction><coulombFriction>0.4</coulombFriction>",
    )
    series = FourierSeries(0.5, np.array([0.1, 0.4]), 0.2 * np.eye(2), 0.1 * np.eye(2)[::-1])
    link, motor, run = simulated(robot, "j1", series, error)
    np.testing.assert_allclose(link + motor, run.tau_motor, atol=1e-9)


def test_a_motor_does_not_turn_the_other_way(leg):
    with pytest.raises(EffectError, match=r"-1\.5 at 'knee'"):
        make_effect("torque_constant", "knee").demand(leg, np.array([-1.5]))
