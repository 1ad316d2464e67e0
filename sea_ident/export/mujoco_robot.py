"""The robot as a MuJoCo model, for users who want MuJoCo as simulator, and as a second opinion on the dynamics."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from sea_ident._typing import FloatArray, IntArray
from sea_ident.exceptions import ExportError, MissingExtraError
from sea_ident.export.mjcf import mjcf_text, rotor_name
from sea_ident.export.values import ExportValues
from sea_ident.motion import Motion
from sea_ident.robot import Robot
from sea_ident.robot.joints import root_master
from sea_ident.robot.urdf import parse_urdf


@dataclass(frozen=True, eq=False)
class MujocoRobot:
    """A MuJoCo model whose coordinates are known by the names of the robot.

    Attributes:
        model: the `mujoco.MjModel`; its controls are motor torques at the joint side [N m], one for each joint.
        robot: the robot.
        coordinate_map: (nv, n) MuJoCo's velocity due to q'.
        rotor_map: (nv, n) part due to theta'.
        offset: (nv,) MuJoCo's position at q = theta = 0.
        links: (n,) MuJoCo's index of each joint.
        motors: (n,) MuJoCo's index of each rotor, -1 where there is none.
    """

    model: Any
    robot: Robot
    coordinate_map: FloatArray
    rotor_map: FloatArray
    offset: FloatArray
    links: IntArray
    motors: IntArray

    def set_state(self, data: Any, q: FloatArray, dq: FloatArray, theta: FloatArray, dtheta: FloatArray) -> None:
        """Put positions and velocities (n,) of links and motors [rad, rad/s] into a `mujoco.MjData`."""
        data.qpos[:] = self.coordinate_map @ q + self.rotor_map @ theta + self.offset
        data.qvel[:] = self.coordinate_map @ dq + self.rotor_map @ dtheta

    def get_state(self, data: Any) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """q, q', theta, theta' (n,) of a `mujoco.MjData`; theta = q where a joint has no motor."""
        ratio, has_motor = self.robot.gear_ratios, self.motors >= 0
        q, dq = np.array(data.qpos[self.links]), np.array(data.qvel[self.links])
        theta = np.where(has_motor, data.qpos[self.motors] / ratio, q)
        dtheta = np.where(has_motor, data.qvel[self.motors] / ratio, dq)
        return q, dq, theta, dtheta

    def inverse_dynamics(self, motion: Motion) -> tuple[FloatArray, FloatArray]:
        """What MuJoCo's inverse dynamics says of a motion.

        Friction and springs count, limits of the joints do not.

        Args:
            motion: (N, n) motion.

        Returns:
            Link rows (N, n), which vanish where the springs explain the motion, and motor rows (N, n), the motor
            torque at the joint side [N m]. Their sum is the motor torque without the springs.
        """
        mujoco = _mujoco()
        data = mujoco.MjData(self.model)
        flags = int(self.model.opt.disableflags)
        link, motor = np.zeros_like(motion.q), np.zeros_like(motion.q)
        offsets = -self.model.actuator_biasprm[:, 0]
        self.model.opt.disableflags = flags | int(mujoco.mjtDisableBit.mjDSBL_LIMIT)
        try:
            for k in range(len(motion)):
                self.set_state(data, motion.q[k], motion.dq[k], motion.theta[k], motion.dtheta[k])
                data.qacc[:] = self.coordinate_map @ motion.ddq[k] + self.rotor_map @ motion.ddtheta[k]
                mujoco.mj_inverse(self.model, data)
                link[k] = self.coordinate_map.T @ data.qfrc_inverse
                motor[k] = self.rotor_map.T @ data.qfrc_inverse + offsets
        finally:
            self.model.opt.disableflags = flags
        return link, motor


def build_mujoco_robot(values: ExportValues) -> MujocoRobot:
    """Build the MuJoCo model of a robot.

    Args:
        values: the values, as `collect_values` or `model_values` give them.

    Returns:
        The model.

    Raises:
        MissingExtraError: if MuJoCo is not installed.
        ExportError: if MuJoCo cannot hold the robot.
    """
    mujoco = _mujoco()
    text, _ = mjcf_text(values)
    try:
        model = mujoco.MjModel.from_xml_string(text)
    except ValueError as error:
        raise ExportError(f"MuJoCo {mujoco.__version__} cannot read the exported robot: {error}") from None
    robot = values.robot
    tree = parse_urdf(robot.urdf, robot.source)
    names = [model.joint(k).name for k in range(model.njnt)]
    joints, links, motors = np.zeros((model.nv, robot.n)), np.zeros((model.nv, robot.n)), np.full(robot.n, -1)
    offset = np.zeros(model.nv)
    for i, joint in enumerate(robot.joints):
        for name in (joint.name, *joint.followers):
            _, multiplier, shift = root_master(tree, name)
            joints[names.index(name), i], offset[names.index(name)] = multiplier, shift
        if joint.actuator is not None:
            motors[i] = names.index(rotor_name(joint.name))
            links[motors[i], i] = joint.actuator.gear_ratio
    return MujocoRobot(
        model=model,
        robot=robot,
        coordinate_map=joints,
        rotor_map=links,
        offset=offset,
        links=np.array([names.index(name) for name in robot.joint_names], dtype=np.intp),
        motors=motors.astype(np.intp),
    )


def _mujoco() -> Any:
    try:
        import mujoco
    except ImportError:
        raise MissingExtraError("mujoco", "mujoco", "MuJoCo as simulator") from None
    return mujoco
