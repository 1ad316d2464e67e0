"""Inverse dynamics of links and rotors against MuJoCo, which reads the URDF itself and is given the rotors as bodies.

MuJoCo wants a mass and three moments of inertia of every body. So the rotors get some there; here the same mass and
transverse inertia are put into the link that carries the rotor, which is the same robot.
"""

import re

import numpy as np
import pinocchio as pin
import pytest
from urdfs import sea, urdf

from sea_ident.base_parameters import random_motion
from sea_ident.motion import Motion
from sea_ident.regressor import inverse_dynamics
from sea_ident.robot import Robot, find_urdf, load_robot, robot_from_text

mujoco = pytest.importorskip("mujoco", reason="the cross-check needs MuJoCo: pip install 'sea-ident[mujoco]'")

BAXTER = "example:baxter_description/urdf/baxter.urdf"
LEFT_ARM = ("left_s0", "left_s1", "left_e0", "left_e1", "left_w0", "left_w1", "left_w2")
BOTH_ARMS = (*LEFT_ARM, *(name.replace("left", "right") for name in LEFT_ARM))
UR5 = "example:ur_description/urdf/ur5_robot.urdf"
UR5_JOINTS = (
    "shoulder_pan_joint",
    "shoulder_lift_joint",
    "elbow_joint",
    "wrist_1_joint",
    "wrist_2_joint",
    "wrist_3_joint",
)
UR5_SEA = urdf(*(sea(name, f"<rotorInertia>{k + 1}e-5</rotorInertia>") for k, name in enumerate(UR5_JOINTS)))
# every rotor askew, that of the wrist two links back
UR5_TILTED = urdf(
    sea("shoulder_pan_joint", '<rotorInertia>2e-4</rotorInertia><rotorAxis link="base_link" xyz="0.6 0 0.8"/>'),
    sea("shoulder_lift_joint", '<rotorInertia>3e-4</rotorInertia><rotorAxis link="shoulder_link" xyz="0 0.6 0.8"/>'),
    sea("elbow_joint", '<rotorInertia>4e-4</rotorInertia><rotorAxis link="upper_arm_link" xyz="1 0 0"/>', ratio="-20"),
    sea("wrist_1_joint", '<rotorInertia>1e-4</rotorInertia><rotorAxis link="upper_arm_link" xyz="0 0 1"/>'),
    sea("wrist_2_joint", '<rotorInertia>1e-4</rotorInertia><rotorAxis link="wrist_1_link" xyz="0.8 -0.6 0"/>'),
)
ROTOR_MASS, TRANSVERSE = 0.7, 0.003

CASES = {
    "exo_leg": ("exo_leg", None, None),
    "exo_leg_abduction": ("exo_leg_abduction", None, None),
    "ur5": (UR5, UR5_SEA, None),
    "ur5, rotors askew": (UR5, UR5_TILTED, None),
    "baxter, left arm": (BAXTER, "baxter_sea", LEFT_ARM),
    "baxter, both arms, rotors askew": (BAXTER, "baxter_tilted", BOTH_ARMS),
}


def load(name: str) -> Robot:
    source, annotation, joints = CASES[name]
    if annotation is not None and annotation.startswith("<"):
        return robot_from_text(find_urdf(source).read_text(), source, annotation, joints)
    return load_robot(source, annotation, joints)


def mujoco_model(robot: Robot) -> "mujoco.MjModel":
    """MuJoCo's own reading of the URDF, with a body for every rotor."""
    text = re.sub(r"<!--.*?-->", "", robot.urdf, flags=re.S)
    for tag in ("visual", "collision", "transmission", "gazebo", "dynamics", "mimic"):
        text = re.sub(rf"<{tag}\b[^>]*?(/>|>.*?</{tag}>)", "", text, flags=re.S)
    text = re.sub(r"(<robot\b[^>]*>)", r'\1<mujoco><compiler fusestatic="false"/></mujoco>', text, count=1)
    spec = mujoco.MjSpec.from_string(text)
    for rotor in robot.rotors:
        carrier = spec.body(rotor.carrier)
        body = (spec.worldbody if carrier is None else carrier).add_body(name=f"{rotor.joint} rotor")
        body.quat = pin.Quaternion.FromTwoVectors(np.array([0.0, 0, 1]), rotor.rotor_axis).coeffs()[[3, 0, 1, 2]]
        body.mass, body.inertia = ROTOR_MASS, [TRANSVERSE, TRANSVERSE, rotor.rotor_inertia]
        body.explicitinertial, body.ipos, body.iquat = True, np.zeros(3), [1, 0, 0, 0]
        body.add_joint(name=f"{rotor.joint} rotor", type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 0, 1])
    model = spec.compile()
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    return model


def mujoco_torque(robot: Robot, motion: Motion) -> tuple[np.ndarray, np.ndarray]:
    """Link rows and motor rows by MuJoCo."""
    model = mujoco_model(robot)
    data = mujoco.MjData(model)
    dof = {model.joint(k).name: k for k in range(model.njnt)}
    for name, value in robot.locked.items():
        data.qpos[dof[name]] = value
    links = [dof[name] for name in robot.joint_names]
    motors = [dof[f"{rotor.joint} rotor"] for rotor in robot.rotors]
    driven = [robot.index(rotor.joint) for rotor in robot.rotors]
    ratio = np.array([rotor.gear_ratio for rotor in robot.rotors])
    link, motor = np.zeros_like(motion.q), np.zeros_like(motion.q)
    for k in range(len(motion)):
        for target, of_link, of_motor in (
            (data.qpos, motion.q, motion.theta),
            (data.qvel, motion.dq, motion.dtheta),
            (data.qacc, motion.ddq, motion.ddtheta),
        ):
            target[links] = of_link[k]
            target[motors] = ratio * of_motor[k, driven]
        mujoco.mj_inverse(model, data)
        link[k] = data.qfrc_inverse[links]
        motor[k, driven] = ratio * data.qfrc_inverse[motors]
    return link, motor


def with_rotor_masses(robot: Robot) -> Robot:
    """The robot whose links carry the mass and the transverse inertia that MuJoCo's rotors have."""
    parameters = robot.inertial_parameters
    for rotor in robot.rotors:
        frame = robot.model.frames[robot.model.getFrameId(rotor.carrier, pin.FrameType.BODY)]
        if frame.parentJoint == 0:
            continue
        s = rotor.rotor_axis
        rotor_body = pin.Inertia(ROTOR_MASS, np.zeros(3), TRANSVERSE * (np.eye(3) - np.outer(s, s)))
        at = 10 * (frame.parentJoint - 1)
        parameters[at : at + 10] += frame.placement.act(rotor_body).toDynamicParameters()
    return robot.with_inertial_parameters(parameters, robot.rotor_inertias())


@pytest.mark.parametrize("name", CASES)
def test_inverse_dynamics_of_links_and_rotors_agrees_with_mujoco(name: str) -> None:
    robot = load(name)
    motion = random_motion(robot, 20, seed=11)
    theirs = mujoco_torque(robot, motion)
    mine = inverse_dynamics(with_rotor_masses(robot), motion)
    for one, other in zip(mine, theirs, strict=True):
        for i in range(robot.n):
            size = float(np.abs(other[:, i]).max())
            np.testing.assert_allclose(one[:, i], other[:, i], rtol=0.0, atol=1e-9 * max(size, 1e-3))
    assert min(np.abs(theirs[1]).max(axis=0)[[robot.index(r.joint) for r in robot.rotors]]) > 1e-2


def test_planar_simplification_does_not_agree_on_rotors_askew() -> None:
    # what the paper leaves as future work is not small: the judge above would see it
    robot = load("ur5, rotors askew")
    motion = random_motion(robot, 20, seed=11)
    theirs = mujoco_torque(robot, motion)[1]
    coupling = robot.coupling(np.zeros(robot.n))
    planar = motion.ddq @ coupling.T + motion.ddtheta @ np.diag(np.diag(robot.motor_inertia(np.zeros(robot.n))))
    error = np.abs(planar - theirs).max(axis=0)
    assert np.all(error[2:5] > 0.02 * np.abs(theirs).max(axis=0)[2:5])
