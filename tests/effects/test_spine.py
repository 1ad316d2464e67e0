"""The effects that every model starts from: their columns, priors, and how they act in a simulation."""

import numpy as np
import pytest

from sea_ident.base_parameters import random_motion
from sea_ident.effects import (
    SimulationState,
    base_effects,
    effect_classes,
    effect_from_dict,
    make_effect,
    spring_effects,
)
from sea_ident.effects.rotor_inertia import RotorInertia
from sea_ident.exceptions import EffectError, SeaIdentWarning
from sea_ident.motion import Motion
from sea_ident.regressor import build_regressor, model_columns, prior_parameters
from sea_ident.robot import Robot, load_robot


@pytest.fixture(scope="module")
def leg() -> Robot:
    return load_robot("exo_leg")


def test_leg_starts_from_bodies_one_rotor_inertia_and_motor_friction(leg: Robot) -> None:
    names = [column.name for column in model_columns(leg, base_effects(leg))]
    assert names[:10] == [f"thigh.{x}" for x in ("m", "mx", "my", "mz", "Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz")]
    assert names[30:] == [
        "motor.rotor_inertia",
        *(f"{joint}.viscous_friction" for joint in ("hip", "knee", "ankle")),
        *(f"{joint}.coulomb_friction" for joint in ("hip", "knee", "ankle")),
    ]


def test_priors_are_those_of_the_files(leg: Robot) -> None:
    effects = (*base_effects(leg), *spring_effects(leg))
    prior = dict(zip((c.name for c in model_columns(leg, effects)), prior_parameters(leg, effects), strict=True))
    assert prior["shank.m"] == pytest.approx(3.6)
    assert prior["shank.mx"] == pytest.approx(3.6 * -0.016555556)
    assert prior["motor.rotor_inertia"] == 2.2e-5
    assert prior["knee.viscous_friction"] == 0.9
    assert prior["ankle.coulomb_friction"] == 0.8
    assert prior["hip.spring_stiffness"] == 600.0
    assert prior["hip.spring_stiffening"] == 15000.0
    assert prior["ankle.spring_damping"] == 0.25


@pytest.fixture(scope="module")
def slider() -> Robot:
    with pytest.warns(SeaIdentWarning, match="rigid robot"):
        return load_robot("emps")


def test_units_follow_the_kind_of_joint(slider: Robot) -> None:
    units = {c.name: c.unit for c in model_columns(slider, base_effects(slider))}
    assert units["slider.viscous_friction"] == "N s/m"
    assert units["slider.coulomb_friction"] == "N"


def test_rotor_column_of_a_group_is_the_sum_of_its_rotors(leg: Robot) -> None:
    motion = random_motion(leg, 5, seed=1)
    column = build_regressor(leg, RotorInertia.instances(leg), motion)
    ratios = leg.gear_ratios
    # planar, axes parallel: rotor i turns at N_i theta_i' + the speed of the link that carries it
    carrier = np.cumsum(np.hstack([np.zeros((5, 1)), motion.ddq[:, :-1]]), axis=1)
    np.testing.assert_allclose(column.motor[:, :, 0], ratios * (ratios * motion.ddtheta + carrier), rtol=1e-10)
    moment = ratios * motion.ddtheta + carrier
    on_links = np.array([moment[:, i + 1 :].sum(axis=1) for i in range(3)]).T
    np.testing.assert_allclose(column.link[:, :, 0], on_links, rtol=1e-10, atol=1e-9)


@pytest.mark.parametrize("name", ["viscous_friction", "coulomb_friction", "torque_offset", "link_friction"])
def test_torque_in_a_simulation_is_the_columns_times_the_values(leg: Robot, name: str) -> None:
    check_simulated(leg, name)


@pytest.mark.parametrize("name", ["spring_stiffness", "spring_stiffening", "spring_damping"])
def test_springs_pull_both_ways(leg: Robot, name: str) -> None:
    link, motor = check_simulated(leg, name)
    np.testing.assert_allclose(link, -motor)


def check_simulated(leg: Robot, name: str) -> tuple[np.ndarray, np.ndarray]:
    effect, motion = make_effect(name, "knee"), random_motion(leg, 1, seed=2)
    regressor = build_regressor(leg, (effect,), motion)
    values = np.arange(1.0, 1.0 + len(regressor.columns))
    link, motor = np.zeros(3), np.zeros(3)
    state = SimulationState(0.0, motion.q[0], motion.dq[0], motion.theta[0], motion.dtheta[0], np.zeros(3), np.zeros(3))
    effect.torque(leg, values)(state, link, motor)
    np.testing.assert_allclose(link, regressor.link[0] @ values)
    np.testing.assert_allclose(motor, regressor.motor[0] @ values)
    assert np.abs(np.concatenate([link, motor])).max() > 0.0
    return link, motor


def test_friction_takes_power_out(leg: Robot) -> None:
    for name in ("viscous_friction", "coulomb_friction", "link_friction"):
        effect = make_effect(name, "hip")
        motion = random_motion(leg, 50, seed=3)
        regressor = build_regressor(leg, (effect,), motion)
        torque = regressor.motor.sum(axis=2) * motion.dtheta + regressor.link.sum(axis=2) * motion.dq
        assert np.all(torque.sum(axis=1) >= 0.0)


def test_rigid_joints_have_neither_springs_nor_link_friction_of_their_own(slider: Robot) -> None:
    assert spring_effects(slider) == ()
    assert effect_classes()["link_friction"].instances(slider) == ()
    assert len(effect_classes()["viscous_friction"].instances(slider)) == 1


def test_effects_survive_being_written_down(leg: Robot) -> None:
    for effect in (*base_effects(leg), *spring_effects(leg), make_effect("coulomb_friction", "hip", smoothing=0.05)):
        assert effect_from_dict(effect.to_dict()) == effect


@pytest.mark.parametrize(
    ("record", "message"),
    [
        ({"effect": "magic", "joint": "hip"}, "no effect is named 'magic'; known effects: .*coulomb_friction"),
        ({"joint": "hip"}, "not the record of an effect"),
        ([], "not the record of an effect"),
        ({"effect": "coulomb_friction", "joint": "hip", "shape": {"colour": 1.0}}, "colour"),
        ({"effect": "coulomb_friction", "joint": "hip", "shape": [1]}, "shape is not a mapping"),
    ],
)
def test_record_of_no_effect(record: object, message: str) -> None:
    with pytest.raises(EffectError, match=message):
        effect_from_dict(record)


def test_effect_without_its_joint(leg: Robot) -> None:
    motion = Motion.rigid(np.zeros(1), *np.zeros((3, 1, 3)))
    with pytest.raises(EffectError, match="'viscous_friction' acts at a joint; give joint="):
        build_regressor(leg, (make_effect("viscous_friction"),), motion)
