"""The columns of a motor that moves two joints are the difference that its coupling makes to inverse dynamics."""

import numpy as np
import pinocchio as pin
import pytest

import sea_ident
from sea_ident.effects import State, make_effect
from sea_ident.effects.transmission_coupling import TransmissionCoupling
from sea_ident.exceptions import EffectError
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


def arms(slides=False):
    """A body that turns, or slides, and carries two arms of two joints; every joint has a motor."""
    links, joints = ["base", "body", "a1", "a2", "b1", "b2"], []
    for name, parent, child in (
        ("waist", "base", "body"),
        ("a_shoulder", "body", "a1"),
        ("a_elbow", "a1", "a2"),
        ("b_shoulder", "body", "b1"),
        ("b_elbow", "b1", "b2"),
    ):
        kind = "prismatic" if slides and name == "waist" else "revolute"
        joints.append(
            f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
            '<origin xyz="0.3 0 0.1"/><axis xyz="0 1 0"/><limit effort="50" velocity="5" lower="-1" upper="1"/></joint>'
            f'<transmission name="{name}_drive" type="transmission_interface/SimpleTransmission"><joint name="{name}"/>'
            f'<actuator name="{name}_motor"><mechanicalReduction>50</mechanicalReduction>'
            "<rotorInertia>1e-4</rotorInertia></actuator></transmission>"
        )
    bodies = "".join(
        f'<link name="{link}"><inertial><mass value="2"/><origin xyz="0.1 0 0"/>'
        '<inertia ixx="0.01" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>'
        for link in links
    )
    return robot_from_text(f'<robot name="arms">{bodies}{"".join(joints)}</robot>', "arms")


def test_motors_are_coupled_with_their_neighbours_on_the_way_from_the_base():
    """Not with whatever comes next in the list: that may be the end of another arm."""
    pairs = {(effect.joint, effect.other) for effect in TransmissionCoupling.instances(arms())}
    tree = [("waist", "a_shoulder"), ("a_shoulder", "a_elbow"), ("waist", "b_shoulder"), ("b_shoulder", "b_elbow")]
    assert pairs == {*tree, *((b, a) for a, b in tree)}
    leg = [(effect.joint, effect.other) for effect in TransmissionCoupling.instances(sea_ident.load_robot("exo_leg"))]
    assert leg == [("hip", "knee"), ("knee", "hip"), ("knee", "ankle"), ("ankle", "knee")]


def test_a_motor_that_moves_a_slide_by_its_turn_and_one_that_turns_by_its_slide():
    robot = arms(slides=True)
    slide_moves = TransmissionCoupling("waist", "a_shoulder").columns(robot)
    assert [column.unit for column in slide_moves] == ["N s2/rad", "N s/rad", "N m"]
    turn_moves = TransmissionCoupling("a_shoulder", "waist")
    assert [column.unit for column in turn_moves.columns(robot)] == ["N m s2/m", "N m s/m", "N"]
    both_turn = TransmissionCoupling("a_shoulder", "a_elbow")
    assert [column.unit for column in both_turn.columns(robot)] == ["N m s2/rad", "N m s/rad", "N m"]
    # a pinion of a third of a metre: friction and inertia act by the same ratio
    known = TransmissionCoupling("a_shoulder", "waist", viscous=0.5, coulomb=0.8)
    values = known.planted(robot, 3.0)
    assert known._ratio(robot, values) == pytest.approx(3.0)
    i, k = robot.index("a_shoulder"), robot.index("waist")
    moved = known.modified(robot, values).link_map - robot.link_map
    own = [rotor.joint for rotor in robot.rotors].index("a_shoulder")
    row = robot.extended_model.joints[int(robot.rotor_indices[own])].idx_v
    assert moved[row, k] == pytest.approx(3.0 * (robot.motor_map[row, i] + robot.link_map[row, i]))
    assert np.count_nonzero(moved) == 1
    with pytest.raises(EffectError, match="ratios up to 1; 3 was given"):
        TransmissionCoupling("a_shoulder", "a_elbow").planted(robot, 3.0)
