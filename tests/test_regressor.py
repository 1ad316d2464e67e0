"""Phi psi is the torque: against Pinocchio's RNEA, against an independent Newton-Euler, and in its parts."""

import warnings

import numpy as np
import pytest
from independent_dynamics import IndependentDynamics

from sea_ident.base_parameters import random_motion
from sea_ident.effects import base_effects, make_effect, spring_effects
from sea_ident.effects.rigid_bodies import RigidBodies
from sea_ident.effects.rotor_inertia import RotorInertia
from sea_ident.exceptions import SeaIdentError, SeaIdentWarning
from sea_ident.motion import Motion
from sea_ident.regressor import build_regressor, build_total, inverse_dynamics, prior_parameters, regressor_chunks
from sea_ident.robot import Robot, load_robot
from sea_ident.robot.rotor_columns import own_rotor_row, rotor_columns

BAXTER = "example:baxter_description/urdf/baxter.urdf"
LEFT_ARM = ("left_s0", "left_s1", "left_e0", "left_e1", "left_w0", "left_w1", "left_w2")
SPECS = {
    "exo_leg": ("exo_leg", None, None),
    "exo_leg_abduction": ("exo_leg_abduction", None, None),
    "quanser_2dof": ("quanser_2dof", None, None),
    "emps": ("emps", None, None),
    "ur5": ("example:ur_description/urdf/ur5_robot.urdf", None, None),
    "panda (mimic finger)": ("example:panda_description/urdf/panda.urdf", None, None),
    "kinova (geared)": ("example:kinova_description/robots/kinova.urdf", None, None),
    "baxter arm": (BAXTER, "baxter_sea", LEFT_ARM),
    "baxter arm, tilted rotors": (BAXTER, "baxter_tilted", LEFT_ARM),
    "talos (mimic gripper)": ("example:talos_data/robots/talos_full_v2.urdf", None, None),
    "tiago (prismatic)": ("example:tiago_description/robots/tiago_no_hand.urdf", None, None),
    "pr2 (continuous, prismatic, mimic)": ("example:pr2_description/urdf/pr2.urdf", None, None),
}


def robot_of(name: str) -> Robot:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        return load_robot(*SPECS[name])


def bodies_and_rotors(robot: Robot) -> tuple:
    return (*RigidBodies.instances(robot), *RotorInertia.instances(robot))


def with_random_inertia(robot: Robot, seed: int) -> tuple[Robot, np.ndarray]:
    """The robot with random parameters, and the parameters; nothing here needs them to be physical."""
    rng = np.random.default_rng(seed)
    inertial = robot.inertial_parameters + rng.uniform(-0.5, 0.5, 10 * len(robot.bodies))
    inertial[::10] = rng.uniform(1.0, 2.0, len(robot.bodies))
    groups = {group: rng.uniform(1e-5, 1e-3) for group in robot.rotor_groups}
    rotors = np.array([groups[f"{rotor.rotor_group}.rotor_inertia"] for rotor in robot.rotors])
    return robot.with_inertial_parameters(inertial, rotors), np.concatenate([inertial, list(groups.values())])


def scale(torque: np.ndarray) -> float:
    return float(np.abs(torque).max())


@pytest.mark.parametrize("name", SPECS)
def test_columns_times_parameters_equal_pinocchios_rnea_in_link_and_motor_rows(name: str) -> None:
    robot, psi = with_random_inertia(robot_of(name), seed=1)
    motion = random_motion(robot, 5, seed=2)
    link, motor = inverse_dynamics(robot, motion)
    regressor = build_regressor(robot, bodies_and_rotors(robot), motion)
    np.testing.assert_allclose(regressor.link @ psi, link, rtol=0.0, atol=1e-10 * scale(link))
    np.testing.assert_allclose(regressor.motor @ psi, motor, rtol=0.0, atol=1e-10 * scale(link))


@pytest.mark.parametrize("name", SPECS)
def test_columns_equal_an_independent_newton_euler(name: str) -> None:
    robot = robot_of(name)
    motion = random_motion(robot, 4, seed=3)
    regressor = build_regressor(robot, bodies_and_rotors(robot), motion)
    groups, bodies = list(robot.rotor_groups), 10 * len(robot.bodies)
    membership = np.zeros((bodies + len(robot.rotors), bodies + len(groups)))
    membership[:bodies, :bodies] = np.eye(bodies)
    for r, rotor in enumerate(robot.rotors):
        membership[bodies + r, bodies + groups.index(f"{rotor.rotor_group}.rotor_inertia")] = 1.0
    for mine, other in zip((regressor.link, regressor.motor), IndependentDynamics(robot).rows(motion), strict=True):
        expected = other @ membership
        size = np.maximum(np.abs(expected).max(axis=(0, 1)), 1.0)  # by column: rotors go with gear ratio squared
        np.testing.assert_allclose(mine / size, expected / size, rtol=0.0, atol=1e-10)


@pytest.mark.parametrize("name", ["exo_leg", "kinova (geared)", "baxter arm, tilted rotors"])
def test_the_row_of_its_own_motor_is_part_of_what_a_rotor_needs(name: str) -> None:
    robot = robot_of(name)
    motion = random_motion(robot, 5, seed=6)
    whole = rotor_columns(robot, motion)[1]
    assert np.any(whole)
    for i, joint in enumerate(robot.joint_names):
        np.testing.assert_array_equal(own_rotor_row(robot, motion, joint), whole[:, i])


def test_own_parameters_of_the_urdf_give_its_own_torque() -> None:
    robot = robot_of("exo_leg")
    motion = random_motion(robot, 20, seed=4)
    effects = bodies_and_rotors(robot)
    link, motor = inverse_dynamics(robot, motion)
    regressor = build_regressor(robot, effects, motion)
    np.testing.assert_allclose(regressor.sum @ prior_parameters(robot, effects), link + motor, rtol=1e-10, atol=1e-9)


def test_springs_cancel_in_the_sum_and_balance_the_rows() -> None:
    robot = robot_of("exo_leg")
    effects = (*base_effects(robot), *spring_effects(robot))
    motion = random_motion(robot, 7, seed=5)
    regressor = build_regressor(robot, effects, motion)
    springs = [k for k, column in enumerate(regressor.columns) if column.side == "spring"]
    assert len(springs) == 9
    assert np.abs(regressor.link[:, :, springs]).max() > 0.0
    np.testing.assert_array_equal(regressor.sum[:, :, springs], 0.0)
    knee = robot.index("knee")
    deflection = motion.theta[:, knee] - motion.q[:, knee]
    names = regressor.names
    np.testing.assert_array_equal(regressor.motor[:, knee, names.index("knee.spring_stiffness")], deflection)
    np.testing.assert_allclose(regressor.motor[:, knee, names.index("knee.spring_stiffening")], deflection**3)


def test_motor_friction_acts_on_the_motor_and_link_friction_on_the_link() -> None:
    robot = robot_of("exo_leg_abduction")
    motion = random_motion(robot, 7, seed=6)
    hip = robot.index("hip")
    viscous = build_regressor(robot, (make_effect("viscous_friction", "hip"),), motion)
    np.testing.assert_array_equal(viscous.motor[:, hip, 0], motion.dtheta[:, hip])
    np.testing.assert_array_equal(viscous.link, 0.0)
    link = build_regressor(robot, (make_effect("link_friction", "hip"),), motion)
    np.testing.assert_array_equal(link.link[:, hip, 0], motion.dq[:, hip])
    np.testing.assert_array_equal(link.motor, 0.0)


def test_coulomb_friction_is_within_four_percent_of_the_sign_above_twice_the_smoothing() -> None:
    robot = robot_of("exo_leg")
    effect = make_effect("coulomb_friction", "knee", smoothing=0.05)
    speed = np.array([0.1, 0.2, 1.0, -0.1, -3.0])
    dtheta = np.repeat(speed[:, None], 3, axis=1)
    zero = np.zeros_like(dtheta)
    motion = Motion(np.arange(5.0), zero, zero, zero, zero, dtheta, zero)
    column = build_regressor(robot, (effect,), motion).motor[:, robot.index("knee"), 0]
    assert np.all(np.abs(column - np.sign(speed)) < 0.04)


def test_chunks_are_the_whole_in_parts() -> None:
    robot = robot_of("exo_leg")
    effects, motion = base_effects(robot), random_motion(robot, 25, seed=7)
    whole = build_regressor(robot, effects, motion)
    parts = list(regressor_chunks(robot, effects, motion, size=10))
    assert [len(part.link) for part in parts] == [10, 10, 5]
    np.testing.assert_array_equal(np.concatenate([part.sum for part in parts]), whole.sum)


@pytest.mark.parametrize("name", ["exo_leg", "panda (mimic finger)", "baxter arm, tilted rotors"])
def test_total_is_the_sum_of_both_rows_in_any_columns(name: str) -> None:
    robot = robot_of(name)
    links = tuple(make_effect("link_friction", j.name) for j in robot.joints if j.elastic)
    effects = (*base_effects(robot), *links)
    motion = random_motion(robot, 8, seed=8)
    whole = build_regressor(robot, effects, motion).sum
    np.testing.assert_allclose(build_total(robot, effects, motion), whole, rtol=1e-14)
    columns = np.sort(np.random.default_rng(0).permutation(whole.shape[2])[: whole.shape[2] // 2])
    some = build_total(robot, effects, motion, columns=columns)
    np.testing.assert_allclose(some, whole[:, :, columns], rtol=1e-14)


def test_two_columns_of_one_name_are_refused() -> None:
    robot = robot_of("exo_leg")
    twice = (make_effect("viscous_friction", "hip"), make_effect("viscous_friction", "hip"))
    with pytest.raises(SeaIdentError, match=r"two columns the same name: hip\.viscous_friction"):
        build_regressor(robot, twice, random_motion(robot, 3))


def test_motion_of_another_robot_is_refused() -> None:
    robot = robot_of("exo_leg")
    motion = random_motion(robot_of("quanser_2dof"), 3)
    with pytest.raises(SeaIdentError, match="2 joints, exo_leg has 3"):
        build_regressor(robot, base_effects(robot), motion)
