"""Where the links of a robot are at many samples at once, and how far they reach around each joint."""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from sea_ident._typing import FloatArray
from sea_ident.robot import Robot


@dataclass(frozen=True, eq=False)
class Poses:
    """Poses of all bodies (index 0: the base) at M samples, in the frame of the robot's root.

    Attributes:
        rotations: (J + 1, M, 3, 3).
        positions: (J + 1, M, 3) origins of the joint frames [m].
        axes: (J + 1, M, 3) directions of the joints; zero for the base.
    """

    rotations: FloatArray
    positions: FloatArray
    axes: FloatArray

    def points(self, body: int, point: FloatArray) -> FloatArray:
        """(M, 3) a point (3,) of a body [m]."""
        found: FloatArray = self.positions[body] + self.rotations[body] @ point
        return found


@dataclass(frozen=True, eq=False)
class Chain:
    """The tree of J moving bodies, body k behind joint k.

    Attributes:
        parents: (J + 1,) parent of each body.
        rotations: (J + 1, 3, 3) placement of each joint in its parent.
        translations: (J + 1, 3) placement of each joint in its parent [m].
        axes: (J + 1, 3) unit direction of each joint in its own frame; zero for the base.
        slides: (J + 1,) whether the joint slides.
        carries: (J + 1, J + 1) whether joint [j] carries body [k].
        map: (J + 1, n) coordinates of the tree from q: several rows per joint where others mimic it.
        offset: (J + 1,) coordinates at q = 0.
    """

    parents: tuple[int, ...]
    rotations: FloatArray
    translations: FloatArray
    axes: FloatArray
    slides: NDArray[np.bool_]
    carries: NDArray[np.bool_]
    map: FloatArray
    offset: FloatArray

    @staticmethod
    def of(robot: Robot) -> "Chain":
        """The links of a robot, without its rotors."""
        model, extended = robot.model, robot.extended_model
        data, count = model.createData(), model.njoints
        pin.computeJointJacobians(model, data, np.zeros(model.nq))
        axes, slides = np.zeros((count, 3)), np.zeros(count, dtype=bool)
        carries = np.zeros((count, count), dtype=bool)
        linear_map, offset = np.zeros((count, robot.n)), np.zeros(count)
        for k in range(1, count):
            jacobian = pin.getJointJacobian(model, data, k, pin.ReferenceFrame.LOCAL).reshape(6, model.nv)
            column = jacobian[:, model.joints[k].idx_v]
            slides[k] = not np.any(column[3:])
            axes[k] = column[:3] if slides[k] else column[3:]
            carries[:, k] = carries[:, model.parents[k]]
            carries[k, k] = True
            row = extended.joints[int(robot.body_indices[k - 1])].idx_v
            linear_map[k], offset[k] = robot.link_map[row], robot.offset[row]
        return Chain(
            parents=tuple(int(parent) for parent in model.parents),
            rotations=np.array([placement.rotation for placement in model.jointPlacements]),
            translations=np.array([placement.translation for placement in model.jointPlacements]),
            axes=axes,
            slides=slides,
            carries=carries,
            map=linear_map,
            offset=offset,
        )

    def at(self, q: FloatArray) -> Poses:
        """Poses at (M, n) positions of the joints."""
        x = q @ self.map.T + self.offset
        count, samples = len(self.parents), len(q)
        rotations = np.broadcast_to(np.eye(3), (count, samples, 3, 3)).copy()
        positions, axes = np.zeros((count, samples, 3)), np.zeros((count, samples, 3))
        for k in range(1, count):
            parent = self.parents[k]
            placed = rotations[parent] @ self.rotations[k]
            positions[k] = positions[parent] + rotations[parent] @ self.translations[k]
            axes[k] = placed @ self.axes[k]
            if self.slides[k]:
                rotations[k] = placed
                positions[k] += x[:, k, None] * axes[k]
                continue
            u = self.axes[k]
            skew = np.array([[0.0, -u[2], u[1]], [u[2], 0.0, -u[0]], [-u[1], u[0], 0.0]])
            sine, cosine = np.sin(x[:, k])[:, None, None], np.cos(x[:, k])[:, None, None]
            rotations[k] = placed @ (np.eye(3) + sine * skew + (1.0 - cosine) * (skew @ skew))
        return Poses(rotations, positions, axes)

    def slopes(self, poses: Poses, body: int, points: FloatArray, directions: FloatArray) -> FloatArray:
        """How points move along directions with every coordinate of the tree.

        Args:
            poses: at M samples.
            body: that carries the points.
            points: (M, 3) [m].
            directions: (M, 3).

        Returns:
            (M, J + 1) derivatives [m/rad] or [-].
        """
        found = np.zeros((len(points), len(self.parents)))
        for j in np.flatnonzero(self.carries[:, body]):
            moved = poses.axes[j] if self.slides[j] else np.cross(poses.axes[j], points - poses.positions[j])
            found[:, j] = np.einsum("mi,mi->m", moved, directions)
        return found

    def rates(self, joint_rates: FloatArray) -> FloatArray:
        """(..., J + 1) bounds on the speeds of the tree's coordinates from those (..., n) of the joints."""
        bounds: FloatArray = joint_rates @ np.abs(self.map).T
        return bounds

    def travel(self, reach: FloatArray) -> FloatArray:
        """(J + 1,) how far slides go from zero at most [m], from bounds (n,) on |q|; zero where a joint turns."""
        return np.where(self.slides, np.abs(self.map) @ reach + np.abs(self.offset), 0.0)

    def levers(self, body: int, centre: FloatArray, radius: float, travel: FloatArray) -> FloatArray:
        """Largest distance of the points of a ball on a body from the axis of every joint that carries it.

        Args:
            body: that carries it.
            centre: (3,) of the ball in the frame of the body [m].
            radius: of the ball [m].
            travel: (J + 1,) of the slides [m].

        Returns:
            (J + 1,) distances [m]; 1 for slides, which move every point as far as themselves; 0 elsewhere.
        """
        found = np.zeros(len(self.parents))
        beyond, first, joint = radius, centre, body  # beyond the next frame outward, and where that is in this one
        while joint > 0:
            across = first - (first @ self.axes[joint]) * self.axes[joint]
            found[joint] = 1.0 if self.slides[joint] else float(np.linalg.norm(across)) + beyond
            beyond += float(np.linalg.norm(first)) + travel[joint]
            first, joint = self.translations[joint], self.parents[joint]
        return found

    def levers_behind(self, joint: int, body: int, reach: float, travel: FloatArray) -> float:
        """Largest distance from the origin of a joint of points on a body that it does not carry [m].

        Args:
            joint: the joint.
            body: the body.
            reach: largest distance of the points from the origin of the body [m].
            travel: (J + 1,) of the slides [m].
        """
        up = [j for j in self._path(joint) if not self.carries[j, body]]
        down = [j for j in self._path(body) if not self.carries[j, joint]]
        return reach + sum(float(np.linalg.norm(self.translations[j])) + float(travel[j]) for j in (*up, *down))

    def _path(self, body: int) -> list[int]:
        return [int(j) for j in np.flatnonzero(self.carries[:, body])]
