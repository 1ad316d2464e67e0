"""What a unit of inertia of each rotor needs: columns of the regressor, for all samples of a motion at once.

A rotor is a body with an inertia about its own axis s and nothing else. Its angular momentum along s is that of the
link that carries it plus its own spin, and the moment that changes it needs only rotations: no masses, no positions.
Pinocchio's regressor of links and rotors as one tree says the same at twice the cost (see the tests).
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin

from sea_ident._typing import FloatArray

if TYPE_CHECKING:
    from sea_ident.motion import Motion
    from sea_ident.robot.model import Robot


class _Turning:
    """Rotation of the moving links, from the base outwards, as far as rotors ask for it; samples come last."""

    def __init__(self, robot: "Robot", motion: "Motion") -> None:
        self.robot, self.model = robot, robot.model
        self.q, self.dq, self.ddq = (np.ascontiguousarray(x.T) for x in (motion.q, motion.dq, motion.ddq))
        self.rows = [robot.extended_model.joints[int(k)].idx_v for k in robot.body_indices]
        still = np.zeros((3, len(motion)))
        upright = np.repeat(np.eye(3)[:, :, None], len(motion), axis=2)
        self._done: dict[int, tuple[FloatArray, FloatArray, FloatArray]] = {0: (upright, still, still)}
        self.axes: dict[int, FloatArray] = {}

    def of(self, body: int) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Orientation (3, 3, N), angular velocity and acceleration (3, N) in the world of the body of a joint."""
        if body in self._done:
            return self._done[body]
        rotation, omega, alpha = self.of(self.model.parents[body])
        placement = self.model.jointPlacements[body].rotation
        axis = _turning_axis(self.model.joints[body])
        if not np.any(axis):  # it slides
            self._done[body] = _product(rotation, placement[:, :, None]), omega, alpha
            return self._done[body]
        row = self.robot.link_map[self.rows[body - 1]]
        angle = row @ self.q + self.robot.offset[self.rows[body - 1]]
        along = np.outer(axis, axis)
        cross = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
        turn = (placement @ (np.eye(3) - along))[:, :, None] * np.cos(angle)
        turn += (placement @ cross)[:, :, None] * np.sin(angle)
        turn += (placement @ along)[:, :, None]
        world = _applied(rotation, placement @ axis)
        speed = row @ self.dq
        self.axes[body] = world
        self._done[body] = (
            _product(rotation, turn),
            omega + world * speed,
            alpha + world * (row @ self.ddq) + _cross(omega, world) * speed,
        )
        return self._done[body]


def rotor_columns(robot: "Robot", motion: "Motion") -> tuple[FloatArray, FloatArray]:
    """Link and motor rows of the rotor inertias.

    Args:
        robot: the robot.
        motion: (N, n) motion.

    Returns:
        Link rows and motor rows (N, n, rotors): torque for one unit of inertia at the shaft [N m/(kg m2)].
    """
    link, motor = np.zeros((2, robot.n, len(robot.rotors), len(motion)))
    turning = _Turning(robot, motion)
    for r in range(len(robot.rotors)):
        spun = _spun(robot, motion, turning, r)
        motor[robot.index(robot.rotors[r].joint), r] = spun.effort
        moment = spun.axis * spun.change + _cross(spun.omega, spun.axis) * spun.momentum
        body = spun.carrier
        while body:
            if body in turning.axes:
                row = robot.link_map[turning.rows[body - 1]]
                effort = _dot(turning.axes[body], moment)
                for j in np.flatnonzero(row):
                    link[j, r] += row[j] * effort
            body = robot.model.parents[body]
    return np.moveaxis(link, 2, 0), np.moveaxis(motor, 2, 0)


def own_rotor_row(robot: "Robot", motion: "Motion", joint: str) -> FloatArray:
    """(N, rotors) motor row of one joint, which only its own rotors need [N m/(kg m2)]: a part of `rotor_columns`."""
    row, turning = np.zeros((len(motion), len(robot.rotors))), _Turning(robot, motion)
    for r, rotor in enumerate(robot.rotors):
        if rotor.joint == joint:
            row[:, r] = _spun(robot, motion, turning, r).effort
    return row


@dataclass(frozen=True, eq=False)
class _Spun:
    """A rotor of unit inertia.

    Attributes:
        carrier: joint of the body that carries it.
        axis: (3, N) in the world.
        omega: (3, N) angular velocity of its carrier [rad/s].
        momentum: (N,) along the axis.
        change: (N,) of that in time.
        effort: (N,) torque on the side of the joint.
    """

    carrier: int
    axis: FloatArray
    omega: FloatArray
    momentum: FloatArray
    change: FloatArray
    effort: FloatArray


def _spun(robot: "Robot", motion: "Motion", turning: _Turning, r: int) -> _Spun:
    """What the rotor at a place among those of the robot does."""
    index, i = int(robot.rotor_indices[r]), robot.index(robot.rotors[r].joint)
    spin = float(robot.motor_map[robot.extended_model.joints[index].idx_v, i])
    carrier = _carrier(robot, index)
    rotation, omega, alpha = turning.of(carrier)
    axis = _applied(rotation, robot.extended_model.jointPlacements[index].rotation[:, 2])
    change = _dot(axis, alpha) + spin * motion.ddtheta[:, i]
    momentum = _dot(axis, omega) + spin * motion.dtheta[:, i]
    return _Spun(carrier, axis, omega, momentum, change, spin * change)


def _turning_axis(joint: pin.JointModel) -> FloatArray:
    """(3,) axis in the frame of the joint; zero where it slides."""
    data = joint.createData()
    joint.calc(data, np.zeros(joint.nq), np.zeros(joint.nv))
    return np.asarray(data.S, dtype=np.float64).reshape(6)[3:]


def _carrier(robot: "Robot", rotor: int) -> int:
    """Joint in `robot.model` of the body that carries a rotor; 0 where that is the base."""
    parent = robot.extended_model.parents[rotor]
    return 0 if parent == 0 else int(np.flatnonzero(robot.body_indices == parent)[0]) + 1


def _product(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(a[:, 0, None] * b[0] + a[:, 1, None] * b[1] + a[:, 2, None] * b[2], dtype=np.float64)


def _applied(rotation: FloatArray, vector: FloatArray) -> FloatArray:
    return np.asarray(rotation[:, 0] * vector[0] + rotation[:, 1] * vector[1] + rotation[:, 2] * vector[2])


def _dot(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(a[0] * b[0] + a[1] * b[1] + a[2] * b[2], dtype=np.float64)


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])
