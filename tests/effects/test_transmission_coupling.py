"""The columns of a motor that moves two joints are the difference that its coupling makes to inverse dynamics."""

import numpy as np
import pinocchio as pin
import pytest

import sea_ident
from sea_ident.effects import State, make_effect
from sea_ident.effects.transmission_coupling import TransmissionCoupling
from sea_ident.motion import Motion

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
