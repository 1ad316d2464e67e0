"""The regressor of links and rotors once more, by other means, as a judge of the one under test.

Geometry is read by yourdfpy, motion is propagated with plain 3-vectors in the world frame, and torques are projected
by the geometric Jacobian: nothing of Pinocchio, and nothing of sea_ident's own reading of URDFs, takes part.
"""

import io
from dataclasses import dataclass

import numpy as np
import yourdfpy
from scipy.spatial.transform import Rotation

from sea_ident._typing import FloatArray
from sea_ident.motion import Motion
from sea_ident.robot import Robot

GRAVITY = np.array([0.0, 0.0, -9.81])


@dataclass
class Frame:
    """Motion of a link frame in the world, with the Jacobians of its origin and rotation."""

    rotation: FloatArray
    origin: FloatArray
    omega: FloatArray
    alpha: FloatArray
    acceleration: FloatArray
    jacobian: FloatArray
    turning: FloatArray


def skew(v: FloatArray) -> FloatArray:
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


def dot(v: FloatArray) -> FloatArray:
    """(3, 6) L with I v = L (Ixx, Ixy, Iyy, Ixz, Iyz, Izz)."""
    x, y, z = v
    return np.array([[x, y, 0, z, 0, 0], [0, x, y, 0, z, 0], [0, 0, 0, x, y, z]])


class IndependentDynamics:
    """Torque of every joint of a URDF, linear in ten parameters for each moving link and one for each rotor."""

    def __init__(self, robot: Robot) -> None:
        urdf = yourdfpy.URDF.load(
            io.BytesIO(robot.urdf.encode()),
            load_meshes=False,
            build_scene_graph=False,
            mesh_dir="",
            build_collision_scene_graph=False,
        )
        self.joints = {j.child: j for j in urdf.robot.joints}
        self.robot, self.links = robot, [link.name for link in urdf.robot.links]
        self.order = self._from_the_root()

    def _from_the_root(self) -> list[str]:
        done, waiting = [], [name for name in self.links]
        while waiting:
            ready = [n for n in waiting if n not in self.joints or self.joints[n].parent in done]
            done += ready
            waiting = [n for n in waiting if n not in ready]
        return done

    def _coordinate(self, joint: yourdfpy.Joint) -> tuple[FloatArray, float]:
        """Row of d(position)/dq and constant part of a joint's position."""
        row, names = np.zeros(self.robot.n), self.robot.joint_names
        if joint.name in names:
            row[names.index(joint.name)] = 1.0
            return row, 0.0
        if joint.name in self.robot.locked:
            return row, self.robot.locked[joint.name]
        others = {j.name: j for j in self.joints.values()}
        master, constant = self._coordinate(others[joint.mimic.joint])
        multiplier = 1.0 if joint.mimic.multiplier is None else joint.mimic.multiplier
        offset = 0.0 if joint.mimic.offset is None else joint.mimic.offset
        return multiplier * master, multiplier * constant + offset

    def frames(self, q: FloatArray, dq: FloatArray, ddq: FloatArray) -> dict[str, Frame]:
        n = self.robot.n
        frames: dict[str, Frame] = {}
        for name in self.order:
            joint = self.joints.get(name)
            if joint is None:
                zero, none = np.zeros(3), np.zeros((3, n))
                frames[name] = Frame(np.eye(3), zero, zero, zero, -GRAVITY, none, none)
                continue
            parent = frames[joint.parent]
            placement = np.eye(4) if joint.origin is None else joint.origin
            rotation = parent.rotation @ placement[:3, :3]
            arm = parent.rotation @ placement[:3, 3]
            origin, omega, alpha = parent.origin + arm, parent.omega, parent.alpha
            acceleration = parent.acceleration + np.cross(alpha, arm) + np.cross(omega, np.cross(omega, arm))
            jacobian, turning = parent.jacobian - skew(arm) @ parent.turning, parent.turning
            if joint.type != "fixed":
                row, constant = self._coordinate(joint)
                axis = np.asarray(joint.axis, dtype=float)
                axis = axis / np.linalg.norm(axis)
                x, v, a = row @ q + constant, row @ dq, row @ ddq
                s = rotation @ axis
                if joint.type == "prismatic":
                    origin = origin + s * x
                    step = s * x
                    acceleration = (
                        acceleration
                        + np.cross(alpha, step)
                        + np.cross(omega, np.cross(omega, step))
                        + 2.0 * np.cross(omega, s) * v
                        + s * a
                    )
                    jacobian = jacobian - skew(step) @ turning + np.outer(s, row)
                else:
                    rotation = rotation @ Rotation.from_rotvec(axis * x).as_matrix()
                    alpha = alpha + s * a + np.cross(omega, s) * v
                    omega = omega + s * v
                    turning = turning + np.outer(s, row)
            frames[name] = Frame(rotation, origin, omega, alpha, acceleration, jacobian, turning)
        return frames

    def rows(self, motion: Motion, k: int) -> tuple[FloatArray, FloatArray]:
        """(n, 10 bodies + rotors) link rows and motor rows of one sample."""
        robot = self.robot
        frames = self.frames(motion.q[k], motion.dq[k], motion.ddq[k])
        width = 10 * len(robot.bodies) + len(robot.rotors)
        link, motor = np.zeros((robot.n, width)), np.zeros((robot.n, width))
        for b, body in enumerate(robot.bodies):
            f = frames[body]
            force, moment = np.zeros((3, 10)), np.zeros((3, 10))
            force[:, 0] = f.acceleration
            force[:, 1:4] = (skew(f.alpha) + skew(f.omega) @ skew(f.omega)) @ f.rotation
            moment[:, 1:4] = -skew(f.acceleration) @ f.rotation
            body_omega, body_alpha = f.rotation.T @ f.omega, f.rotation.T @ f.alpha
            moment[:, 4:] = f.rotation @ (dot(body_alpha) + skew(body_omega) @ dot(body_omega))
            link[:, 10 * b : 10 * b + 10] = f.jacobian.T @ force + f.turning.T @ moment
        for r, rotor in enumerate(robot.rotors):
            f, i, ratio = frames[rotor.carrier], robot.index(rotor.joint), rotor.gear_ratio
            s = f.rotation @ rotor.rotor_axis
            spin, rate = ratio * motion.dtheta[k, i], ratio * motion.ddtheta[k, i]
            # moment of a body with inertia about s alone: d/dt of its angular momentum
            momentum = s @ f.omega + spin
            change = s @ f.alpha + rate
            moment = change * s + momentum * np.cross(f.omega, s)
            column = 10 * len(robot.bodies) + r
            link[:, column] = f.turning.T @ moment
            motor[i, column] = ratio * change
        return link, motor


def energy_rank(robot: Robot, seed: int = 0, tolerance: float = 1e-9) -> int:
    """Number of base parameters of the links by the energy model.

    A combination of parameters stays unseen exactly if it adds no kinetic energy and a constant potential energy.
    """
    rng = np.random.default_rng(seed)
    dynamics = IndependentDynamics(robot)
    samples = 14 * len(robot.bodies)
    kinetic, potential = np.zeros((samples, 10 * len(robot.bodies))), np.zeros((samples, 10 * len(robot.bodies)))
    zero = np.zeros(robot.n)
    for k in range(samples):
        q, dq = rng.uniform(-3.0, 3.0, robot.n), rng.uniform(-2.0, 2.0, robot.n)
        frames = dynamics.frames(q, dq, zero)
        for b, body in enumerate(robot.bodies):
            f = frames[body]
            velocity, omega = f.rotation.T @ f.jacobian @ dq, f.rotation.T @ f.omega
            at = 10 * b
            kinetic[k, at] = velocity @ velocity / 2.0
            kinetic[k, at + 1 : at + 4] = np.cross(velocity, omega)
            kinetic[k, at + 4 : at + 10] = omega @ dot(omega) / 2.0
            potential[k, at] = -GRAVITY @ f.origin
            potential[k, at + 1 : at + 4] = -GRAVITY @ f.rotation
    stacked = np.vstack([kinetic, potential - potential.mean(axis=0)])
    norms = np.linalg.norm(stacked, axis=0)
    seen = norms > tolerance * norms.max()
    values = np.linalg.svd(stacked[:, seen] / norms[seen], compute_uv=False)
    return int(np.count_nonzero(values > tolerance * values[0]))
