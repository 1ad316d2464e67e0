"""The columns of a motor that moves two joints are the difference that its coupling makes to inverse dynamics."""

import numpy as np
import pinocchio as pin
import pytest

import sea_ident
from sea_ident.effects import State, make_effect
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
