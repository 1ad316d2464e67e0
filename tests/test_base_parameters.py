"""Base parameters: their number and grouping, against independent methods, the paper and the literature."""

import warnings

import numpy as np
import pytest
from independent_dynamics import energy_rank

from sea_ident.base_parameters import find_base_parameters, group_columns, random_motion
from sea_ident.effects import Column, Side, base_effects, make_effect
from sea_ident.effects.rigid_bodies import RigidBodies
from sea_ident.exceptions import SeaIdentError, SeaIdentWarning
from sea_ident.motion import Motion
from sea_ident.regressor import build_regressor
from sea_ident.robot import Robot, load_robot, robot_from_text

BAXTER = "example:baxter_description/urdf/baxter.urdf"
LEFT_ARM = ("left_s0", "left_s1", "left_e0", "left_e1", "left_w0", "left_w1", "left_w2")
PANDA_ARM = tuple(f"panda_joint{k}" for k in range(1, 8))


def load(source: str, annotation: str | None = None, joints: tuple[str, ...] | None = None) -> Robot:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        return load_robot(source, annotation, joints)


def test_the_leg_has_the_papers_sixteen_parameters() -> None:
    robot = load("exo_leg")
    base = find_base_parameters(robot, base_effects(robot))
    effects = [base.columns[k].effect for k in base.independent]
    assert base.rank == 16
    assert effects.count("rigid_bodies") == 9
    assert effects.count("rotor_inertia") == 1
    assert effects.count("viscous_friction") + effects.count("coulomb_friction") == 6
    assert base.gap > 1e6


def test_the_reduced_model_of_the_excitation_has_fifteen() -> None:
    # Eqs. 14 and 19 of the paper: no coupling, no motor inertia, friction at the joint.
    robot = load("exo_leg")
    effects = [effect for effect in base_effects(robot) if effect.name != "rotor_inertia"]
    motion = random_motion(robot, 60, seed=1)
    rigid = Motion.rigid(motion.time, motion.q, motion.dq, motion.ddq)
    assert find_base_parameters(robot, effects, rigid).rank == 15


@pytest.mark.parametrize(
    ("source", "joints", "expected"),
    [
        # Mayeda, Yoshida, Osuka, Base parameters of manipulator dynamic models, IEEE Trans. Robotics and Automation 6,
        # 1990: 7 N - 4 b - 2 for N revolute joints, neighbours parallel or perpendicular, the first b of them parallel
        # to each other and to gravity; 7 N - 4 b where these are not parallel to gravity.
        ("example:ur_description/urdf/ur5_robot.urdf", None, 7 * 6 - 4 - 2),  # 36, as for the PUMA 560 (Gautier 1991)
        ("example:ur_description/urdf/ur10_robot.urdf", None, 36),
        ("example:ur_description/urdf/ur3_robot.urdf", None, 36),
        ("example:panda_description/urdf/panda.urdf", PANDA_ARM, 7 * 7 - 4 - 2),  # 43, Gaz et al., RA-L 4, 2019
        ("example:xarm_description/urdf/xarm7.urdf", None, 43),
        (BAXTER, LEFT_ARM, 43),
        ("example:double_pendulum_description/urdf/double_pendulum.urdf", None, 7 * 2 - 4 * 2),
        ("exo_leg", None, 7 * 3 - 4 * 3),
    ],
)
def test_number_of_link_parameters_is_the_published_one(
    source: str, joints: tuple[str, ...] | None, expected: int
) -> None:
    robot = load(source, None, joints)
    assert find_base_parameters(robot, RigidBodies.instances(robot)).rank == expected


@pytest.mark.parametrize(
    ("source", "joints"),
    [
        ("exo_leg_abduction", None),
        ("emps", None),
        ("example:panda_description/urdf/panda.urdf", None),  # a mimic finger
        ("example:solo_description/robots/solo12.urdf", None),  # a tree
        ("example:kinova_description/robots/kinova.urdf", None),  # twists of 55 and 60 deg
        ("example:tiago_description/robots/tiago_no_hand.urdf", None),  # a lift and wheels
        ("example:human_description/robots/human.urdf", None),  # links without mass between joints
        ("example:hextilt_description/urdf/hextilt_flying_arm_5.urdf", None),  # first axis neither up nor level
        (BAXTER, LEFT_ARM),
    ],
)
def test_rank_equals_that_of_the_energy_model(source: str, joints: tuple[str, ...] | None) -> None:
    robot = load(source, None, joints)
    assert find_base_parameters(robot, RigidBodies.instances(robot)).rank == energy_rank(robot)


@pytest.mark.parametrize(
    ("source", "annotation", "joints"),
    [
        ("exo_leg", None, None),
        ("exo_leg_abduction", None, None),
        ("quanser_2dof", None, None),
        ("emps", None, None),
        ("hebi_x5", None, None),
        ("example:ur_description/urdf/ur5_robot.urdf", None, None),
        ("example:panda_description/urdf/panda.urdf", None, None),
        (BAXTER, "baxter_sea", LEFT_ARM),
        (BAXTER, "baxter_tilted", LEFT_ARM),
        ("example:talos_data/robots/talos_full_v2.urdf", None, None),
        ("example:pr2_description/urdf/pr2.urdf", None, None),
    ],
)
def test_base_columns_times_grouped_parameters_are_the_whole(
    source: str, annotation: str | None, joints: tuple[str, ...] | None
) -> None:
    robot = load(source, annotation, joints)
    effects = base_effects(robot)
    base = find_base_parameters(robot, effects)
    fresh = build_regressor(robot, effects, random_motion(robot, 6, seed=99)).sum
    psi = np.random.default_rng(5).normal(size=len(base.columns))
    for k, column in enumerate(base.columns):  # of the size that such things have
        psi[k] *= 1e-4 if column.effect == "rotor_inertia" else 1.0
    torque = fresh @ psi
    np.testing.assert_allclose(
        fresh[:, :, base.independent] @ base.project(psi), torque, rtol=0.0, atol=1e-8 * np.abs(torque).max()
    )


def test_grouping_is_the_identity_on_the_independent_columns() -> None:
    base = find_base_parameters(load("exo_leg"), base_effects(load("exo_leg")))
    np.testing.assert_array_equal(base.grouping[:, base.independent], np.eye(base.rank))
    assert len(set(base.names)) == base.rank
    first = base.combination(0)
    assert first[base.columns[int(base.independent[0])].name] == 1.0
    assert all(value != 0.0 for value in first.values())


def test_the_leg_groups_as_the_textbook_does() -> None:
    # Three parallel axes: what hangs on a joint acts on the link before it like a point mass in the joint.
    robot = load("exo_leg")
    base = find_base_parameters(robot, base_effects(robot))
    combination = {n.rstrip("*"): base.combination(k) for k, n in enumerate(base.names)}
    length = 0.42
    assert combination["thigh.mz"]["shank.m"] == pytest.approx(-length)
    assert combination["thigh.mz"]["foot.m"] == pytest.approx(-length)
    (inertia,) = (terms for name, terms in combination.items() if name.startswith("thigh.I"))
    assert inertia["shank.m"] == pytest.approx(length**2)
    assert "foot.mz" not in combination["thigh.mz"]


def test_parameter_without_a_value_leaves_only_its_own_groups_unknown() -> None:
    robot = load("exo_leg")
    base = find_base_parameters(robot, base_effects(robot))
    psi = np.ones(len(base.columns))
    psi[[column.name for column in base.columns].index("foot.mx")] = np.nan
    unknown = [n.rstrip("*") for n, value in zip(base.names, base.project(psi), strict=True) if np.isnan(value)]
    assert unknown == ["foot.mx"]


@pytest.mark.parametrize("source", ["exo_leg_abduction", "example:ur_description/urdf/ur5_robot.urdf"])
def test_motion_does_not_change_the_choice(source: str) -> None:
    robot = load(source)
    one, two = (find_base_parameters(robot, base_effects(robot), seed=seed) for seed in (0, 7))
    assert one.names == two.names
    np.testing.assert_allclose(one.grouping, two.grouping, atol=1e-8)


def test_further_effect_leaves_the_base_parameters_as_they_are() -> None:
    robot = load("exo_leg_abduction")
    before = find_base_parameters(robot, base_effects(robot))
    more = (*base_effects(robot), *(make_effect("torque_offset", joint) for joint in robot.joint_names))
    after = find_base_parameters(robot, more)
    assert after.names[: before.rank] == before.names
    np.testing.assert_allclose(after.grouping[: before.rank, : len(before.columns)], before.grouping, atol=1e-8)


def column(name: str, unit: str = "kg m2") -> Column:
    return Column(name, unit, "rigid_bodies", None, Side.BOTH)


def test_rank_that_hangs_on_the_tolerance_is_told() -> None:
    axes = np.linalg.qr(np.random.default_rng(0).normal(size=(50, 3)))[0]
    matrix = np.column_stack([axes[:, 0], axes[:, 0] + 3e-9 * axes[:, 1], axes[:, 0] + 7e-10 * axes[:, 2]])
    with pytest.warns(SeaIdentWarning, match="less than a decade apart"):
        base = group_columns(tuple(map(column, "abc")), matrix)
    assert base.rank == 2
    assert "hangs on the tolerance" in base.warnings[0]
    assert "warning" in base.summary()


def test_columns_of_any_scale_are_grouped_exactly() -> None:
    rng = np.random.default_rng(1)
    free = rng.normal(size=(60, 3)) * [1e-4, 1.0, 1e4]
    matrix = np.column_stack([free, free @ [2.0, -3.0, 0.5], np.zeros(60)])
    base = group_columns(tuple(map(column, "abcde")), matrix)
    assert base.rank == 3
    psi = rng.normal(size=5)
    np.testing.assert_allclose(matrix[:, base.independent] @ base.project(psi), matrix @ psi, rtol=1e-9)
    assert not np.any(base.grouping[:, 4])


def test_what_another_effect_is_measured_in_hides_nothing() -> None:
    """A saturation is in 1/N2 m2: its column is a torque to the power of three, 1e13 beside the 1e-2 of friction."""
    rng = np.random.default_rng(2)
    matrix = rng.normal(size=(60, 3)) * [1.0, 1e-2, 1e13]
    columns = (
        column("a"),
        Column("j.viscous_friction", "N m s/rad", "viscous_friction", "j", Side.MOTOR),
        Column("j.torque_saturation", "1/(N m)^2", "torque_saturation", "j", Side.MOTOR),
    )
    base = group_columns(columns, matrix)
    np.testing.assert_array_equal(base.independent, [0, 1, 2])
    psi = np.array([2.0, -1.0, 1e-13])
    np.testing.assert_allclose(matrix @ base.project(psi), matrix @ psi, rtol=1e-12)


def test_what_is_rounding_in_all_of_a_unit_is_judged_by_the_rest_of_the_effect() -> None:
    rng = np.random.default_rng(3)
    matrix = np.column_stack([rng.normal(size=60), 1e-15 * rng.normal(size=60)])
    base = group_columns((column("a"), column("b", "kg m")), matrix)
    assert base.names == ("a",)


def test_robot_without_gravity_at_rest_has_nothing_to_tell() -> None:
    robot = load("quanser_2dof")
    rest = np.zeros((10, 2))
    with pytest.raises(SeaIdentError, match="no parameter has any influence"):
        find_base_parameters(robot, base_effects(robot), Motion.rigid(np.arange(10.0), rest, rest, rest))


def test_vertical_slider_sees_its_mass_alone() -> None:
    urdf = """<robot name="lift"><link name="base"/><link name="car"><inertial><mass value="3"/>
    <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
    <joint name="rise" type="prismatic"><parent link="base"/><child link="car"/><axis xyz="0 0 1"/>
    <limit lower="0" upper="1" velocity="1" effort="1"/></joint></robot>"""
    with pytest.warns(SeaIdentWarning, match="rigid robot"):
        robot = robot_from_text(urdf, "lift.urdf")
    base = find_base_parameters(robot, RigidBodies.instances(robot))
    assert base.names == ("car.m",)
    assert base.gap == float("inf")
