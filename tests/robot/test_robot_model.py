"""Coupling, motor inertia, mimic and locked joints: against formulas on paper and Pinocchio."""

from itertools import pairwise

import numpy as np
import pinocchio as pin
import pytest
from urdfs import ARM, build, joint, link, sea, urdf

from sea_ident.base_parameters import random_motion
from sea_ident.exceptions import RobotError
from sea_ident.motion import Motion
from sea_ident.regressor import inverse_dynamics
from sea_ident.robot import Robot, load_robot

BAXTER = "example:baxter_description/urdf/baxter.urdf"
LEFT_ARM = ("left_s0", "left_s1", "left_e0", "left_e1", "left_w0", "left_w1", "left_w2")


def poses(robot: Robot, seed: int = 0) -> np.ndarray:
    return random_motion(robot, 6, seed).q


def test_planar_coupling_is_constant_strictly_lower_triangular_and_what_the_gears_give() -> None:
    robot = load_robot("exo_leg")
    inertia, ratios = 2.2e-5, robot.gear_ratios
    expected = np.array([[0.0, 0, 0], [ratios[1], 0, 0], [ratios[2], ratios[2], 0]]) * inertia
    for q in poses(robot):
        np.testing.assert_allclose(robot.coupling(q), expected, rtol=1e-12, atol=1e-18)
        np.testing.assert_allclose(robot.motor_inertia(q), np.diag(ratios**2 * inertia), rtol=1e-12)


def test_planar_rotors_add_no_velocity_terms() -> None:
    robot = load_robot("exo_leg")
    motion = random_motion(robot, 6, seed=1)
    for k in range(6):
        first, second = robot.gyroscopic_terms(motion.q[k], motion.dq[k], motion.dtheta[k])
        np.testing.assert_allclose(first, 0.0, atol=1e-12)
        np.testing.assert_allclose(second, 0.0, atol=1e-12)


def test_rotors_askew_make_the_coupling_depend_on_the_pose() -> None:
    robot = load_robot(BAXTER, "baxter_tilted", LEFT_ARM)
    one, two = poses(robot)[:2]
    change = np.abs(robot.coupling(one) - robot.coupling(two))
    assert change.max() > 0.1 * np.abs(robot.coupling(one)).max()
    motion = random_motion(robot, 1, seed=1)
    first, second = robot.gyroscopic_terms(motion.q[0], motion.dq[0], motion.dtheta[0])
    assert np.abs(first).max() > 1e-3
    assert np.abs(second).max() > 1e-3


def test_rotors_askew_on_one_link_do_not_mix_their_own_inertias() -> None:
    # B couples only motors whose carriers move with motors: never, as theta moves no link.
    robot = load_robot(BAXTER, "baxter_tilted", LEFT_ARM)
    for q in poses(robot)[:2]:
        np.testing.assert_allclose(
            robot.motor_inertia(q), np.diag(robot.gear_ratios**2 * robot.rotor_inertias()), rtol=1e-12, atol=1e-18
        )


@pytest.mark.parametrize(
    ("source", "annotation", "joints"), [("exo_leg", None, None), (BAXTER, "baxter_tilted", LEFT_ARM)]
)
def test_matrices_and_velocity_terms_make_up_the_inverse_dynamics(
    source: str, annotation: str | None, joints: tuple[str, ...] | None
) -> None:
    robot = load_robot(source, annotation, joints)
    motion = random_motion(robot, 4, seed=3)
    link, motor = inverse_dynamics(robot, motion)
    zero = np.zeros_like(motion.q)
    still = Motion(motion.time, motion.q, motion.dq, zero, motion.theta, zero, zero)  # C q' + G, rotors at rest
    centrifugal, _ = inverse_dynamics(robot, still)
    for k in range(4):
        inertia, coupling, rotors = robot.mass_matrices(motion.q[k])
        first, second = robot.gyroscopic_terms(motion.q[k], motion.dq[k], motion.dtheta[k])
        on_links = inertia @ motion.ddq[k] + coupling.T @ motion.ddtheta[k] + centrifugal[k] + first
        on_motors = coupling @ motion.ddq[k] + rotors @ motion.ddtheta[k] + second
        np.testing.assert_allclose(on_links, link[k], rtol=1e-10, atol=1e-10 * np.abs(link).max())
        np.testing.assert_allclose(on_motors, motor[k], rtol=1e-10, atol=1e-10 * np.abs(motor).max())


def test_first_velocity_term_is_bilinear_and_the_second_quadratic() -> None:
    robot = load_robot(BAXTER, "baxter_tilted", LEFT_ARM)
    motion = random_motion(robot, 1, seed=4)
    q, dq, dtheta = motion.q[0], motion.dq[0], motion.dtheta[0]
    first, second = robot.gyroscopic_terms(q, dq, dtheta)
    np.testing.assert_allclose(robot.gyroscopic_terms(q, 2 * dq, 3 * dtheta)[0], 6 * first, rtol=1e-9)
    np.testing.assert_allclose(robot.gyroscopic_terms(q, 2 * dq, 3 * dtheta)[1], 4 * second, rtol=1e-9)


def test_rigid_joint_reflects_its_rotor_as_gear_ratio_squared() -> None:
    transmission = (
        '<transmission name="t" type="transmission_interface/SimpleTransmission"><joint name="shoulder"/>'
        '<actuator name="m"><mechanicalReduction>-30</mechanicalReduction><rotorInertia>1e-3</rotorInertia></actuator>'
        "</transmission>"
    )
    robot = build(*ARM, transmission)
    assert robot.elastic == (False, False)
    inertia, coupling, rotors = robot.mass_matrices(np.zeros(2))
    bare = np.triu(pin.crba(robot.model, robot.model.createData(), np.zeros(2)))
    total = inertia + coupling + coupling.T + rotors
    assert total[0, 0] == pytest.approx(bare[0, 0] + 30**2 * 1e-3)
    np.testing.assert_allclose(total[0, 1], bare[0, 1])
    np.testing.assert_allclose(total[1, 1], bare[1, 1])


FINGERS = (
    *ARM,
    link("left"),
    link("right"),
    joint("slide", "lower", "left", "prismatic", "1 0 0", 'lower="0" upper="0.04" velocity="0.1" effort="5"'),
    joint(
        "follow", "lower", "right", "prismatic", "1 0 0", 'lower="-0.1" upper="0" velocity="0.1" effort="5"',
        '<mimic joint="slide" multiplier="-2" offset="0.01"/>',
    ),
)  # fmt: skip


def test_mimic_joint_moves_with_its_master() -> None:
    robot = build(*FINGERS)
    assert robot.joint_names == ("shoulder", "elbow", "slide")
    assert robot.joints[2].followers == ("follow",)
    assert set(robot.bodies) == {"upper", "lower", "left", "right"}
    x = robot.extended_state(np.array([0.1, 0.2, 0.03]))
    names = list(robot.extended_model.names)[1:]
    assert x[names.index("follow")] == pytest.approx(-2 * 0.03 + 0.01)
    # kinetic energy of the pair along the slide: m/2 v^2 + m/2 (2 v)^2
    assert robot.inertia(np.zeros(3))[2, 2] == pytest.approx(1.0 + 4.0)


def test_mimic_joint_narrows_the_range_and_the_speed_of_its_master() -> None:
    limits = build(*FINGERS).limits
    assert limits.lower[2] == pytest.approx(0.005)  # -2 x + 0.01 <= 0
    assert limits.upper[2] == pytest.approx(0.04)
    assert limits.velocity[2] == pytest.approx(0.05)


def test_chained_mimics_and_mimics_of_locked_joints() -> None:
    third = (link("third"), joint("third", "lower", "third", more='<mimic joint="follow" multiplier="3" offset="1"/>'))
    robot = build(*FINGERS, *third)
    assert set(robot.joints[2].followers) == {"follow", "third"}
    x = robot.extended_state(np.array([0.0, 0.0, 0.02]))
    names = list(robot.extended_model.names)[1:]
    assert x[names.index("third")] == pytest.approx(3 * (-2 * 0.02 + 0.01) + 1)
    locked = build(*FINGERS, *third, joints=("shoulder", "elbow")).locked
    assert locked == {"slide": 0.0, "follow": pytest.approx(0.01), "third": pytest.approx(1.03)}


def test_locked_joint_is_held_at_its_nearest_limit_and_its_mass_is_kept() -> None:
    parts = (*ARM, link("hand"), joint("wrist", "lower", "hand", limit='lower="0.5" upper="1" velocity="1" effort="1"'))
    free, held = build(*parts), build(*parts, joints=("elbow",))
    assert held.joint_names == ("elbow",)
    assert held.locked == {"shoulder": 0.0, "wrist": 0.5}
    assert "locked: shoulder at 0, wrist at 0.5" in held.summary()
    assert held.bodies == ("lower",)
    assert held.inertial_parameters[0] == pytest.approx(2.0)  # lower and hand
    expected = free.inertia(np.array([0.0, 0.3, 0.5]))[1, 1]
    assert held.inertia(np.array([0.3]))[0, 0] == pytest.approx(expected)


def test_motor_on_a_locked_link_turns_with_the_link_that_carries_it() -> None:
    parts = (*ARM, link("hand"), joint("wrist", "lower", "hand"))
    motor = sea("wrist", '<rotorInertia>1e-3</rotorInertia><rotorAxis link="upper" xyz="0 1 0"/>')
    free = build(*parts, motor)
    held = build(*parts, motor, joints=("shoulder", "wrist"))
    q = np.array([0.3, 0.0, 0.4])
    np.testing.assert_allclose(held.coupling(q[[0, 2]]), free.coupling(q)[np.ix_([0, 2], [0, 2])], atol=1e-15)
    assert held.coupling(q[[0, 2]])[1, 0] == pytest.approx(50 * 1e-3)
    assert [rotor.joint for rotor in build(*parts, motor, joints=("elbow",)).rotors] == []


def test_linear_limit_follows_mimics_and_locked_joints() -> None:
    text = (
        '<transmission name="sum" type="sea_ident/LinearLimit">'
        '<joint name="elbow"><coefficient>2</coefficient></joint><joint name="shoulder"/><joint name="follow"/>'
        '<limit lower="-1" upper="3"/></transmission>'
    )
    limits = build(*FINGERS, text).limits
    np.testing.assert_allclose(limits.combinations, [[1.0, 2.0, -2.0]])
    np.testing.assert_allclose([limits.combination_lower[0], limits.combination_upper[0]], [-1.01, 2.99])
    held = build(*FINGERS, text, joints=("elbow",)).limits
    np.testing.assert_allclose(held.combinations, [[2.0]])
    np.testing.assert_allclose([held.combination_lower[0], held.combination_upper[0]], [-1.01, 2.99])


def test_order_of_the_joints_is_that_of_pinocchio_whatever_their_names() -> None:
    one = build(*ARM, link("b"), joint("z", "lower", "b"), link("a"), joint("a", "lower", "a"))
    model = pin.buildModelFromXML(one.urdf)
    assert list(one.joint_names) == list(model.names)[1:]


def test_neighbours_are_those_in_the_tree() -> None:
    """One is next to another where no joint but one of the two moves one body and not the other."""
    more = (link("thumb"), joint("thumb", "right", "thumb"), link("other"), joint("other", "base", "other"))
    robot = build(*FINGERS, *more)
    assert robot.joint_names == ("other", "shoulder", "elbow", "thumb", "slide")
    bodies = [list(robot.model.names).index(name) for name in robot.joint_names]
    paths = [{int(k) for k in robot.model.supports[body]} & set(bodies) for body in bodies]
    for i, path in enumerate(paths):
        expected = {k for k, other in enumerate(paths) if len(path ^ other) == 1 and path & other}
        assert set(robot.neighbours(i)) == expected
    assert robot.neighbours(2) == (1, 3, 4)  # of the fingers the one that follows is passed over
    assert build(*FINGERS, *more, joints=("shoulder", "thumb", "other")).neighbours(1) == (2,)


def test_any_name_is_kept() -> None:
    names = ("universe", "a b", "é", "hip rotor")
    robot = build(*map(link, names), *(joint(f" {n} ", a, n) for a, n in pairwise(names)))
    assert robot.joint_names == (" a b ", " é ", " hip rotor ")
    assert robot.bodies == names[1:]


def test_link_and_joint_may_share_a_name() -> None:
    robot = build(link("base"), link("arm"), joint("arm", "base", "arm"), sea("arm", "<rotorInertia>1</rotorInertia>"))
    assert robot.motor_inertia(np.zeros(1))[0, 0] == pytest.approx(2500.0)


def test_default_namespace_and_encoding_do_not_matter(tmp_path) -> None:
    plain = build(*ARM)
    text = urdf(*ARM).replace("<robot ", '<robot xmlns="http://drake.mit.edu" ').replace("upper", "übér")
    path = tmp_path / "arm.urdf"
    path.write_bytes(('<?xml version="1.0" encoding="ISO-8859-1"?>' + text).encode("latin-1"))
    with pytest.warns(UserWarning, match="rigid robot"):
        robot = load_robot(path)
    assert robot.bodies == ("übér", "lower")
    np.testing.assert_array_equal(robot.inertial_parameters, plain.inertial_parameters)


def test_missing_meshes_do_not_matter() -> None:
    mesh = '<visual><geometry><mesh filename="package://nowhere/none.stl"/></geometry></visual>'
    parts = [part.replace("</link>", mesh + mesh.replace("visual", "collision") + "</link>") for part in ARM]
    np.testing.assert_array_equal(build(*parts).inertial_parameters, build(*ARM).inertial_parameters)


def test_rotors_of_one_group_share_a_parameter() -> None:
    robot = build(
        *ARM,
        sea("shoulder", '<rotorInertia group="big">1e-4</rotorInertia>'),
        sea("elbow", '<rotorInertia group="big">1e-4</rotorInertia>'),
    )
    assert robot.rotor_groups == ("big.rotor_inertia",)


def test_unknown_joint_and_spring_of_a_rigid_joint() -> None:
    robot = build(*ARM, sea("elbow"))
    assert robot.spring("elbow").stiffness == 100.0
    with pytest.raises(RobotError, match="has no joint 'knee'; its joints are shoulder, elbow"):
        robot.index("knee")
    with pytest.raises(RobotError, match="joint 'shoulder' of test is rigid"):
        robot.spring("shoulder")


def test_new_inertial_parameters_leave_the_robot_as_it_was() -> None:
    robot = load_robot("exo_leg")
    before = robot.inertial_parameters
    other = robot.with_inertial_parameters(2.0 * before, np.array([1e-5, 2e-5, 3e-5]))
    np.testing.assert_array_equal(robot.inertial_parameters, before)
    np.testing.assert_allclose(other.inertial_parameters, 2.0 * before, rtol=1e-12)
    np.testing.assert_allclose(other.rotor_inertias(), [1e-5, 2e-5, 3e-5])
    assert other.joints[2].actuator.rotor_inertia == 3e-5
    np.testing.assert_allclose(
        pin.crba(other.model, other.model.createData(), np.zeros(3)),
        2.0 * pin.crba(robot.model, robot.model.createData(), np.zeros(3)),
    )


def test_massless_frame_between_two_joints_is_a_note() -> None:
    parts = (
        link("base"),
        link("upper", None),
        link("lower"),
        joint("a", "base", "upper"),
        joint("b", "upper", "lower", axis="1 0 0"),
    )
    robot = build(*parts)
    assert any("zero mass: upper" in text for text in robot.warnings)
    assert robot.n == 2


@pytest.mark.parametrize("name", ["exo_leg", "exo_leg_abduction", "hebi_x5"])
def test_masses_on_the_axes_of_joints_may_be_a_part_of_either_body(name: str) -> None:
    """Pinocchio divides by the mass of bodies together: an estimate may say that they have less than none."""
    robot, generator = load_robot(name), np.random.default_rng(8)
    inertial = robot.inertial_parameters
    inertial[::10] = generator.uniform(-20.0, 1.0, len(robot.bodies))
    there = robot.of_positive_mass(inertial)
    bodies = there.reshape(-1, 10)
    assert np.all(bodies[:, 0] > 0.0)
    same, changed = (robot.with_inertial_parameters(each, robot.rotor_inertias()) for each in (inertial, there))
    q, dq, ddq = generator.uniform(-1.0, 1.0, (3, 10, robot.n))
    motion = Motion(np.arange(10) / 100.0, q, dq, ddq, q, dq, ddq)
    expected, found = (np.stack(inverse_dynamics(each, motion)) for each in (same, changed))
    np.testing.assert_allclose(found, expected, atol=1e-10 * np.abs(expected).max())
    np.testing.assert_array_equal(robot.of_positive_mass(robot.inertial_parameters), robot.inertial_parameters)
    # the mass matrix is the slope of those torques over the accelerations
    x = changed.extended_state(q)[0]
    data = changed.extended_model.createData()
    mass = np.array(pin.crba(changed.extended_model, data, x))
    mass = np.triu(mass) + np.triu(mass, 1).T
    still, plain = np.zeros_like(x), same.extended_model
    weight = np.array(pin.rnea(plain, plain.createData(), x, still, still))
    rows = [pin.rnea(plain, plain.createData(), x, still, each) - weight for each in np.eye(len(x))]
    np.testing.assert_allclose(mass, np.array(rows), atol=1e-9 * np.abs(mass).max())


@pytest.mark.parametrize("moving", [None, ("arm",), ("hand",)])
def test_a_link_may_carry_the_name_of_a_joint(moving: tuple[str, ...] | None) -> None:
    def robot(second: str) -> Robot:
        parts = (joint("arm", "base", "arm"), joint("hand", "arm", second, axis="1 0 0"))
        return build(link("base"), link("arm", 2.0), link(second, 0.5), *parts, joints=moving)

    twice, plain = robot("hand"), robot("other")
    assert twice.joint_names == plain.joint_names
    assert twice.locked == plain.locked
    motion = random_motion(plain, 4, seed=1)
    np.testing.assert_array_equal(inverse_dynamics(twice, motion)[0], inverse_dynamics(plain, motion)[0])


def test_limits_that_no_robot_reaches_are_none() -> None:
    limit = 'lower="-1e+16" upper="1e+16" velocity="1e16" effort="1e16"'
    limits = build(link("base"), link("rotor"), joint("spin", "base", "rotor", limit=limit)).limits
    for bound in (-limits.lower, limits.upper, limits.velocity, limits.torque):
        assert np.all(np.isposinf(bound))
