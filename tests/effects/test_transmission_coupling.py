"""The columns of a motor that moves two joints are the difference that its coupling makes to inverse dynamics."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

import sea_ident
from sea_ident.effects import Anchor, SimulationState, State, make_effect
from sea_ident.effects.transmission_coupling import TransmissionCoupling
from sea_ident.motion import Motion
from sea_ident.robot import robot_from_text

RATIO = 0.3


def random_motion(n, samples=20):
    rng = np.random.default_rng(4)
    return Motion(np.arange(samples) * 0.01, *rng.standard_normal((6, samples, n)))


def inverse_dynamics(robot, motion):
    """(2, N, n) link and motor torques of bodies and rotors."""
    model = robot.extended_model
    data = model.createData()
    x = robot.extended_state(motion.q, motion.theta)
    v, a = robot.extended_rate(motion.dq, motion.dtheta), robot.extended_rate(motion.ddq, motion.ddtheta)
    torque = np.stack([pin.rnea(model, data, *each) for each in zip(x, v, a, strict=True)])
    return np.stack([torque @ robot.link_map, torque @ robot.motor_map])


def tree(*joints):
    """A robot out of joints (parent, child, type), each with a motor and named as the link that it moves."""
    links = dict.fromkeys(name for parent, child, _ in joints for name in (parent, child))
    parts = [
        f'<link name="{name}"><inertial><origin xyz="0.1 0.02 0.2"/><mass value="2"/>'
        '<inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>'
        for name in links
    ]
    for parent, child, kind in joints:
        parts.append(
            f'<joint name="{child}" type="{kind}"><origin xyz="0 0 0.3"/><parent link="{parent}"/>'
            f'<child link="{child}"/><axis xyz="0 1 0"/>'
            '<limit lower="-1" upper="1" velocity="3" effort="100"/></joint>'
            f'<transmission name="{child}" type="transmission_interface/SimpleTransmission"><joint name="{child}"/>'
            '<actuator name="motor"><mechanicalReduction>50</mechanicalReduction><rotorInertia>1e-4</rotorInertia>'
            "<viscousFriction>0.5</viscousFriction><coulombFriction>0.8</coulombFriction></actuator></transmission>"
        )
    return robot_from_text(f'<robot name="tree">{"".join(parts)}</robot>', "tree.urdf")


def pairs(robot):
    return [(effect.joint, effect.other) for effect in TransmissionCoupling.instances(robot)]


def test_motors_are_coupled_with_their_neighbours_in_the_tree():
    """Not with those of another branch that happen to come next."""
    robot = tree(
        ("base", "waist", "revolute"),
        ("waist", "l_arm", "revolute"),
        ("l_arm", "l_hand", "revolute"),
        ("waist", "r_arm", "revolute"),
    )
    assert robot.joint_names == ("waist", "l_arm", "l_hand", "r_arm")
    assert pairs(robot) == [
        ("waist", "l_arm"),
        ("waist", "r_arm"),
        ("l_arm", "waist"),
        ("l_arm", "l_hand"),
        ("l_hand", "l_arm"),
        ("r_arm", "waist"),
    ]


def test_motors_of_a_chain_are_coupled_with_the_joint_before_and_the_joint_after():
    leg = sea_ident.load_robot("exo_leg")
    assert pairs(leg) == [("hip", "knee"), ("knee", "hip"), ("knee", "ankle"), ("ankle", "knee")]


def inertia_of(leg, joint, other):
    """What the coupling changes by inverse dynamics, what its columns say, and the gear ratio."""
    actuator = leg.joints[leg.index(joint)].actuator
    inertia = actuator.rotor_inertia * actuator.gear_ratio**2
    effect = TransmissionCoupling(joint, other, inertia, viscous=0.0, coulomb=0.0, ratio=RATIO)
    values = effect.planted(leg, RATIO)
    motion = random_motion(leg.n)
    change = inverse_dynamics(effect.modified(leg, values), motion) - inverse_dynamics(leg, motion)
    part = effect.evaluate(State(leg, motion))
    return change, np.stack([part.link @ values, part.motor @ values]), actuator.gear_ratio


def test_inertia_of_a_motor_that_the_base_carries():
    change, columns, _ = inertia_of(sea_ident.load_robot("exo_leg"), "hip", "knee")
    assert np.abs(change).max() > 0.1
    np.testing.assert_allclose(columns, change, atol=1e-12)


@pytest.mark.parametrize(("joint", "other"), [("knee", "hip"), ("ankle", "knee")])
def test_inertia_of_a_motor_that_a_link_carries(joint, other):
    """Its own row is exact; that its carrier turns it too is less than its spin by the gear ratio, and left out."""
    change, columns, gear_ratio = inertia_of(sea_ident.load_robot("exo_leg"), joint, other)
    np.testing.assert_allclose(columns[1], change[1], atol=1e-12)
    assert np.linalg.norm(columns[0] - change[0]) < 5.0 / gear_ratio * np.linalg.norm(change[0])


@pytest.mark.parametrize("ratio", [RATIO, -0.4])
def test_friction(ratio):
    """The friction of the motor at its own speed instead of that of its joint, by virtual work at both joints."""
    leg = sea_ident.load_robot("exo_leg")
    i, k = leg.index("knee"), leg.index("hip")
    viscous, coulomb, smoothing = 0.9, 1.2, 0.05
    effect = make_effect("transmission_coupling", "knee", other="hip", ratio=ratio, smoothing=smoothing)
    motion = random_motion(leg.n)

    def friction(speed):
        return viscous * speed + coulomb * np.tanh(speed / smoothing)

    turned = motion.dtheta[:, i] + ratio * motion.dq[:, k]
    part = effect.evaluate(State(leg, motion))
    values = ratio * np.array([0.0, viscous, coulomb])
    expected = np.zeros((2, len(motion), leg.n))
    expected[0, :, k] = ratio * friction(turned)
    expected[1, :, i] = friction(turned) - friction(motion.dtheta[:, i])
    np.testing.assert_allclose(part.link @ values, expected[0], atol=1e-12)
    np.testing.assert_allclose(part.motor @ values, expected[1], atol=1e-12)


KINDS = {
    ("revolute", "revolute"): ("N m s2/rad", "N m s/rad", "N m"),
    ("revolute", "prismatic"): ("N s2/rad", "N s/rad", "N"),
    ("prismatic", "revolute"): ("N s2/rad", "N s/rad", "N m"),
    ("prismatic", "prismatic"): ("N s2/m", "N s/m", "N"),
}
"""Kinds of the joint of the motor and of the other one, and the units of r J, r b and r c."""


def two_joints(own, other):
    return tree(("base", "other", other), ("other", "own", own))


@pytest.mark.parametrize("ratio", [RATIO, 5e-5])
@pytest.mark.parametrize("kinds", KINDS)
def test_a_motion_in_millimetres_has_the_same_energy(kinds, ratio):
    """Forces along a slide are a thousandth then, and parameters change by the metres in their units alone."""
    robot = two_joints(*kinds)
    effect = TransmissionCoupling("own", "other", ratio=ratio, smoothing=0.05)
    units = [column.unit for column in effect.columns(robot)]
    assert tuple(units) == KINDS[kinds]
    values = np.array([0.5, 0.3, 0.2])
    longer = np.array([1000.0 if joint.prismatic else 1.0 for joint in robot.joints])
    own, other = longer[robot.index("own")], longer[robot.index("other")]
    metres = [(0 if unit.startswith("N m") else -1) - unit.endswith("/m") for unit in units]
    motion = random_motion(robot.n)
    parts = ("q", "dq", "ddq", "theta", "dtheta", "ddtheta")
    scaled = Motion(motion.time, *(getattr(motion, part) * longer for part in parts))
    in_millimetres = replace(effect, ratio=ratio * own / other, smoothing=0.05 * own)
    before, after = effect.evaluate(State(robot, motion)), in_millimetres.evaluate(State(robot, scaled))
    for rows, others in ((before.link, after.link), (before.motor, after.motor)):
        np.testing.assert_allclose(others @ (values * 1000.0 ** np.array(metres)), rows @ values / longer, rtol=1e-9)


@pytest.mark.parametrize(("kinds", "ratio"), [(("revolute", "prismatic"), 3.0), (("revolute", "revolute"), -1.5)])
def test_friction_and_inertia_of_a_simulation_turn_by_the_same_ratio(kinds, ratio):
    robot = two_joints(*kinds)
    i, k = robot.index("own"), robot.index("other")
    effect = make_effect("transmission_coupling", "own", other="other", smoothing=0.05)
    values = effect.planted(robot, ratio)
    q, dq, theta, dtheta, none = np.random.default_rng(4).standard_normal((5, robot.n))
    turned = dtheta[i] + ratio * dq[k]
    # 50 turns of the rotor for one of the motor after its gear
    change = effect.modified(robot, values).extended_rate(dq, dtheta) - robot.extended_rate(dq, dtheta)
    rotor = robot.extended_model.joints[int(robot.rotor_indices[[r.joint for r in robot.rotors].index("own")])].idx_v
    assert change[rotor] == pytest.approx(50.0 * ratio * dq[k])
    link, motor = np.zeros(robot.n), np.zeros(robot.n)
    effect.torque(robot, values)(SimulationState(0.0, q, dq, theta, dtheta, none, none), link, motor)

    def friction(speed):
        return 0.5 * speed + 0.8 * np.tanh(speed / 0.05)

    assert link[k] == pytest.approx(ratio * friction(turned))
    assert motor[i] == pytest.approx(friction(turned) - friction(dtheta[i]))


def test_friction_of_a_simulation_is_that_of_the_columns():
    """Also where a fit found another size of it than the ratio at which it turns would have."""
    leg = sea_ident.load_robot("exo_leg")
    effect = make_effect("transmission_coupling", "knee", other="hip", ratio=RATIO, smoothing=0.05)
    values, motion = np.array([0.0, 0.4, 0.7]), random_motion(leg.n)
    act, part, none = effect.torque(leg, values), effect.evaluate(State(leg, motion)), np.zeros(leg.n)
    for t in range(len(motion)):
        link, motor = np.zeros(leg.n), np.zeros(leg.n)
        now = (motion.q[t], motion.dq[t], motion.theta[t], motion.dtheta[t])
        act(SimulationState(0.0, *now, none, none), link, motor)
        np.testing.assert_allclose(link, part.link[t] @ values, atol=1e-12)
        np.testing.assert_allclose(motor, part.motor[t] @ values, atol=1e-12)


def test_a_fit_keeps_the_ratio_that_it_has_found():
    """What the amounts say of it is a beginning."""
    robot = two_joints("revolute", "revolute")
    names = [column.name for column in TransmissionCoupling("own", "other").columns(robot)]
    model = dict(zip(names, (0.1, 0.2, 0.4), strict=True)) | {
        "own.rotor_inertia": 1e-4,
        "own.viscous_friction": 0.5,
        "own.coulomb_friction": 0.8,
    }
    begun = TransmissionCoupling("own", "other").anchored(Anchor(robot, (), model))
    assert begun.ratio == pytest.approx(0.5)
    assert replace(begun, ratio=-0.3).anchored(Anchor(robot, (), model)).ratio == -0.3


@pytest.mark.parametrize(
    ("kinds", "unit", "most"),
    [
        (("revolute", "prismatic"), "rad/m", 150.0),
        (("prismatic", "revolute"), "m/rad", 1.5),
        (("revolute", "revolute"), "-", 1.5),
        (("prismatic", "prismatic"), "-", 1.5),
    ],
)
def test_ratio_of_a_fit_has_the_unit_and_the_range_of_its_joints(kinds, unit, most):
    """A belt of one to one is not at the end of it."""
    robot = two_joints(*kinds)
    effect = TransmissionCoupling("own", "other").anchored(Anchor(robot, (), {}))
    (ratio,) = effect.ranges
    assert (ratio.name, effect.shape_unit(ratio, robot)) == ("ratio", unit)
    assert (ratio.lower, ratio.upper) == pytest.approx((-most, most))


@pytest.mark.parametrize(
    ("kinds", "given", "expected"),
    [
        (("revolute", "prismatic"), 3.0, 3.0),
        (("revolute", "prismatic"), -1000.0, -100.0),
        (("prismatic", "revolute"), 0.3, 0.3),
        (("prismatic", "revolute"), 3.0, 1.0),
        (("revolute", "revolute"), 3.0, 1.0),
        (("prismatic", "prismatic"), -3.0, -1.0),
    ],
)
def test_a_fit_bounds_the_ratio_by_levers_where_kinds_differ(kinds, given, expected):
    """A slide may turn a pinion of a third of a metre by 3 rad/m, and none of a millimetre."""
    robot = two_joints(*kinds)
    effect = TransmissionCoupling("own", "other")
    values = dict(zip((c.name for c in effect.columns(robot)), effect.planted(robot, given), strict=True))
    model = {"own.rotor_inertia": 1e-4, "own.viscous_friction": 0.5, "own.coulomb_friction": 0.8}
    assert effect.anchored(Anchor(robot, (effect,), values | model)).ratio == pytest.approx(expected)


@pytest.mark.parametrize(("kinds", "largest"), [(("revolute", "prismatic"), 100.0), (("revolute", "revolute"), 1.0)])
def test_a_search_begins_with_ratios_up_to_that_of_a_belt_either_way(kinds, largest):
    """What a large one does is no multiple of what a small one does: from nothing a fit does not get there."""
    robot = two_joints(*kinds)
    begun = TransmissionCoupling("own", "other").variants(State(robot, random_motion(robot.n)))
    ratios = sorted(each.ratio / largest for each in begun)
    assert ratios == pytest.approx([-1.0, -0.3, 0.0, 0.3, 1.0])
