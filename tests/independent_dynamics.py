"""The regressor of links and rotors once more, by other means, as a judge of the one under test.

Geometry is read by yourdfpy, motion is propagated with plain 3-vectors in the world frame, and torques are projected
by the geometric Jacobian: nothing of Pinocchio, and nothing of sea_ident's own reading of URDFs, takes part. All is
done for K samples at once.
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
    """Motion of a link frame in the world, with the Jacobians of its origin and rotation; K samples first."""

    rotation: FloatArray
    origin: FloatArray
    omega: FloatArray
    alpha: FloatArray
    acceleration: FloatArray
    jacobian: FloatArray
    turning: FloatArray


def skew(v: FloatArray) -> FloatArray:
    """(K, 3, 3) with skew(v) w = v x w."""
    out = np.zeros((len(v), 3, 3))
    out[:, 0, 1], out[:, 0, 2], out[:, 1, 2] = -v[:, 2], v[:, 1], -v[:, 0]
    return out - np.swapaxes(out, 1, 2)


def dot(v: FloatArray) -> FloatArray:
    """(K, 3, 6) L with I v = L (Ixx, Ixy, Iyy, Ixz, Iyz, Izz)."""
    out = np.zeros((len(v), 3, 6))
    x, y, z = v.T
    out[:, 0, 0] = out[:, 1, 1] = out[:, 2, 3] = x
    out[:, 0, 1] = out[:, 1, 2] = out[:, 2, 4] = y
    out[:, 0, 3] = out[:, 1, 4] = out[:, 2, 5] = z
    return out


def times(matrix: FloatArray, v: FloatArray) -> FloatArray:
    """(K, 3) product of (K, 3, 3) or (3, 3) matrices and (K, 3) or (3,) vectors."""
    return np.matmul(matrix, np.broadcast_to(v, (len(matrix), 3))[..., None])[..., 0]


def transpose(matrix: FloatArray) -> FloatArray:
    return np.swapaxes(matrix, -1, -2)


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
        self.robot = robot
        self.joints = {j.child: j for j in urdf.robot.joints}
        self.by_name = {j.name: j for j in urdf.robot.joints}
        self.order = self._from_the_root([link.name for link in urdf.robot.links])

    def _from_the_root(self, links: list[str]) -> list[str]:
        done: list[str] = []
        while len(done) < len(links):
            known = set(done)
            done += [n for n in links if n not in known and (n not in self.joints or self.joints[n].parent in known)]
        return done

    def _coordinate(self, name: str) -> tuple[FloatArray, float]:
        """Row of d(position)/dq and constant part of a joint's position."""
        row, names = np.zeros(self.robot.n), self.robot.joint_names
        if name in names:
            row[names.index(name)] = 1.0
            return row, 0.0
        if name in self.robot.locked:
            return row, self.robot.locked[name]
        mimic = self.by_name[name].mimic
        master, constant = self._coordinate(mimic.joint)
        multiplier = 1.0 if mimic.multiplier is None else mimic.multiplier
        return multiplier * master, multiplier * constant + (mimic.offset or 0.0)

    def frames(self, q: FloatArray, dq: FloatArray, ddq: FloatArray) -> dict[str, Frame]:
        """Frames of all links at (K, n) states."""
        count, n = q.shape
        frames: dict[str, Frame] = {}
        for name in self.order:
            joint = self.joints.get(name)
            if joint is None:
                zero, none = np.zeros((count, 3)), np.zeros((count, 3, n))
                frames[name] = Frame(np.tile(np.eye(3), (count, 1, 1)), zero, zero, zero, zero - GRAVITY, none, none)
                continue
            parent = frames[joint.parent]
            placement = np.eye(4) if joint.origin is None else joint.origin
            rotation, arm = parent.rotation @ placement[:3, :3], times(parent.rotation, placement[:3, 3])
            origin, omega, alpha = parent.origin + arm, parent.omega, parent.alpha
            acceleration = parent.acceleration + np.cross(alpha, arm) + np.cross(omega, np.cross(omega, arm))
            jacobian, turning = parent.jacobian - skew(arm) @ parent.turning, parent.turning
            if joint.type not in ("fixed", "floating", "planar"):
                row, constant = self._coordinate(joint.name)
                axis = np.asarray(joint.axis, dtype=float)
                axis = axis / np.linalg.norm(axis)
                x, v, a = q @ row + constant, (dq @ row)[:, None], (ddq @ row)[:, None]
                s = times(rotation, axis)
                along = s[:, :, None] * row
                if joint.type == "prismatic":
                    step = s * x[:, None]
                    origin = origin + step
                    acceleration = acceleration + np.cross(alpha, step) + np.cross(omega, np.cross(omega, step))
                    acceleration = acceleration + 2.0 * np.cross(omega, s) * v + s * a
                    jacobian = jacobian - skew(step) @ turning + along
                else:
                    rotation = rotation @ Rotation.from_rotvec(axis * x[:, None]).as_matrix()
                    alpha = alpha + s * a + np.cross(omega, s) * v
                    omega = omega + s * v
                    turning = turning + along
            frames[name] = Frame(rotation, origin, omega, alpha, acceleration, jacobian, turning)
        return frames

    def rows(self, motion: Motion) -> tuple[FloatArray, FloatArray]:
        """(K, n, 10 bodies + rotors) link rows and motor rows."""
        robot, count = self.robot, len(motion)
        frames = self.frames(motion.q, motion.dq, motion.ddq)
        width = 10 * len(robot.bodies) + len(robot.rotors)
        link, motor = np.zeros((count, robot.n, width)), np.zeros((count, robot.n, width))
        for b, body in enumerate(robot.bodies):
            f = frames[body]
            force, moment = np.zeros((count, 3, 10)), np.zeros((count, 3, 10))
            force[:, :, 0] = f.acceleration
            force[:, :, 1:4] = (skew(f.alpha) + skew(f.omega) @ skew(f.omega)) @ f.rotation
            moment[:, :, 1:4] = -skew(f.acceleration) @ f.rotation
            back = transpose(f.rotation)
            omega, alpha = times(back, f.omega), times(back, f.alpha)
            moment[:, :, 4:] = f.rotation @ (dot(alpha) + skew(omega) @ dot(omega))
            link[:, :, 10 * b : 10 * b + 10] = transpose(f.jacobian) @ force + transpose(f.turning) @ moment
        for r, rotor in enumerate(robot.rotors):
            f, i, ratio = frames[rotor.carrier], robot.index(rotor.joint), rotor.gear_ratio
            s = times(f.rotation, rotor.rotor_axis)
            # moment of a body with inertia about s alone: d/dt of its angular momentum
            momentum = np.sum(s * f.omega, axis=1) + ratio * motion.dtheta[:, i]
            change = np.sum(s * f.alpha, axis=1) + ratio * motion.ddtheta[:, i]
            moment = change[:, None] * s + momentum[:, None] * np.cross(f.omega, s)
            column = 10 * len(robot.bodies) + r
            link[:, :, column] = np.einsum("kcn,kc->kn", f.turning, moment)
            motor[:, i, column] = ratio * change
        return link, motor


def energy_rank(robot: Robot, seed: int = 0, tolerance: float = 1e-9) -> int:
    """Number of base parameters of the links by the energy model.

    A combination of parameters stays unseen exactly if it adds no kinetic energy and a constant potential energy.
    """
    rng = np.random.default_rng(seed)
    count, width = 8 * len(robot.bodies) + 20, 10 * len(robot.bodies)
    kinetic, potential = np.zeros((count, width)), np.zeros((count, width))
    q, dq = rng.uniform(-3.0, 3.0, (count, robot.n)), rng.uniform(-2.0, 2.0, (count, robot.n))
    frames = IndependentDynamics(robot).frames(q, dq, np.zeros_like(q))
    for b, body in enumerate(robot.bodies):
        f, at = frames[body], 10 * b
        back = transpose(f.rotation)
        velocity, omega = times(back, np.einsum("kcn,kn->kc", f.jacobian, dq)), times(back, f.omega)
        kinetic[:, at] = np.sum(velocity**2, axis=1) / 2.0
        kinetic[:, at + 1 : at + 4] = np.cross(velocity, omega)
        kinetic[:, at + 4 : at + 10] = np.einsum("kc,kcp->kp", omega, dot(omega)) / 2.0
        potential[:, at] = -f.origin @ GRAVITY
        potential[:, at + 1 : at + 4] = -GRAVITY @ f.rotation
    stacked = np.vstack([kinetic, potential - potential.mean(axis=0)])
    norms = np.linalg.norm(stacked, axis=0)
    seen = norms > tolerance * norms.max()
    values = np.linalg.svd(stacked[:, seen] / norms[seen], compute_uv=False)
    return int(np.count_nonzero(values > tolerance * values[0]))
