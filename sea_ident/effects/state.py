"""What effects compute their columns from, and the rows that these are in.

Rows: a joint has a link row and a motor row (paper, eqs. 1-2), written so that

    link   sum of columns x parameters = 0           (the spring enters with a minus sign)
    motor  sum of columns x parameters = tau_motor   (the spring enters with a plus sign)

and their sum is the row of a rigid joint, in which the spring cancels (paper, eq. 4).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property

import numpy as np
import pinocchio as pin

from sea_ident._typing import FloatArray
from sea_ident.motion import Motion
from sea_ident.robot import Robot
from sea_ident.robot.rotor_columns import rotor_columns

MOMENTS = 4
"""Of the ten inertial parameters of a body, mass and first moments come first: they alone have a weight."""

POSTURES = 100
"""Samples of a motion in which an inertia is looked at: it changes with the posture alone."""


class Side(StrEnum):
    """Where an effect enters."""

    LINK = "link"
    MOTOR = "motor"
    SPRING = "spring"
    BOTH = "both"
    SENSOR = "sensor"

    @property
    def shares(self) -> tuple[float, float]:
        """Signs with which a torque at one joint enters its link row and its motor row; 0 where it does not."""
        match self:
            case Side.LINK:
                return 1.0, 0.0
            case Side.MOTOR:
                return 0.0, 1.0
            case Side.SPRING:
                return -1.0, 1.0
            case _:
                return 0.0, 0.0


@dataclass(frozen=True, eq=False)
class Contribution:
    """Columns of one effect.

    Attributes:
        link: (N, n, k) part in the link rows.
        motor: (N, n, k) part in the motor rows.
        joint: index of the joint in whose rows alone it is, None where it is in those of several.
    """

    link: FloatArray
    motor: FloatArray
    joint: int | None = None


@dataclass(frozen=True, eq=False)
class State:
    """A robot in a motion: what effects compute their columns from, with the costly parts computed once.

    Attributes:
        robot: the robot.
        motion: (N, n) motion.
        channels: further measured signals (N, n) by kind, for effects that need them (temperature, tau_spring).
    """

    robot: Robot
    motion: Motion
    channels: Mapping[str, FloatArray] | None = None

    @cached_property
    def body_regressor(self) -> FloatArray:
        """(N, n, 10 b) link rows of the standard inertial parameters of the links; in motor rows they are not."""
        return self._regressor(self.robot.model, self.motion.q, self.motion.dq, self.motion.ddq)

    def gravity_torque(self, gravity: FloatArray, inertial: FloatArray) -> FloatArray:
        """(N, n) torque that the links at rest with these standard inertial parameters (10 b,) need [N m].

        Args:
            gravity: (3,) in the frame of the base [m/s2].
            inertial: (10 b,).
        """
        out, moments = np.zeros_like(self.motion.q), np.reshape(inertial, (-1, 10))[:, :MOMENTS].ravel()
        for axis in range(3):
            if gravity[axis] != 0.0:
                out += gravity[axis] * (self._rows_of_gravity(axis) @ moments)
        return out

    def inertia_at(self, joint: int, inertial: FloatArray) -> FloatArray:
        """(M,) inertia that a joint has by links with these standard inertial parameters (10 b,), in some samples.

        Args:
            joint: its index.
            inertial: (10 b,).

        Returns:
            Torque per acceleration of this joint alone [kg m2], [kg] of one that slides.
        """
        model, q = pin.Model(self.robot.model), self.motion.q[:: 1 + len(self.motion) // POSTURES]
        model.gravity = pin.Motion.Zero()
        push = np.zeros_like(q)
        push[:, joint] = 1.0
        return np.asarray(self._regressor(model, q, np.zeros_like(q), push)[:, joint] @ inertial, dtype=np.float64)

    def gravity_rows(self, gravity: FloatArray) -> FloatArray:
        """(N, n, 10 b) link rows of the standard inertial parameters of links at rest, under gravity (3,) [m/s2]."""
        rows = np.zeros((*self.motion.q.shape, len(self.robot.bodies), 10))
        for axis in np.flatnonzero(gravity):
            own = self._rows_of_gravity(int(axis))
            rows[..., :MOMENTS] += gravity[axis] * own.reshape(*own.shape[:2], -1, MOMENTS)
        return rows.reshape(*self.motion.q.shape, -1)

    def _rows_of_gravity(self, axis: int) -> FloatArray:
        """(N, n, 4 b) link rows of masses and first moments at rest, under gravity of 1 m/s2 along an axis."""
        if axis not in self._gravity:
            model, still = pin.Model(self.robot.model), np.zeros_like(self.motion.q)
            model.gravity = pin.Motion(np.eye(3)[axis], np.zeros(3))
            rows = self._regressor(model, self.motion.q, still, still)
            self._gravity[axis] = rows.reshape(*rows.shape[:2], -1, 10)[..., :MOMENTS].reshape(*rows.shape[:2], -1)
        return self._gravity[axis]

    @cached_property
    def _gravity(self) -> dict[int, FloatArray]:
        """`_rows_of_gravity` by axis, of those that were asked for."""
        return {}

    def _regressor(self, model: pin.Model, q: FloatArray, dq: FloatArray, ddq: FloatArray) -> FloatArray:
        """(N, n, 10 b) link rows at these positions, speeds and accelerations of the links (N, n)."""
        robot, data = self.robot, model.createData()
        rows = [robot.extended_model.joints[int(k)].idx_v for k in robot.body_indices]
        link_map = robot.link_map[rows]
        x = np.ascontiguousarray(q @ link_map.T + robot.offset[rows])
        v, a = np.ascontiguousarray(dq @ link_map.T), np.ascontiguousarray(ddq @ link_map.T)
        out = np.empty((len(q), model.nv, 10 * (model.njoints - 1)))
        compute = pin.computeJointTorqueRegressor
        for k in range(len(q)):
            out[k] = compute(model, data, x[k], v[k], a[k])
        if link_map.shape[0] == link_map.shape[1] and np.array_equal(link_map, np.eye(robot.n)):
            return out
        return np.asarray(np.matmul(link_map.T, out), dtype=np.float64)

    @cached_property
    def rotor_rows(self) -> Contribution:
        """Link and motor rows (N, n, rotors) of the rotor inertias."""
        return Contribution(*rotor_columns(self.robot, self.motion))

    def body_columns(self, columns: FloatArray) -> Contribution:
        """Rows of (N, n, k) columns of bodies, which act on links alone."""
        return Contribution(columns, np.broadcast_to(0.0, columns.shape))

    def body_rows(self, inertial: FloatArray) -> Contribution:
        """Link and motor rows (N, n, 1) of the links with the standard inertial parameters (10 b,)."""
        return self.body_columns((self.body_regressor @ inertial)[:, :, None])

    def body_torque(self, inertial: FloatArray) -> FloatArray:
        """(N, n) torque that the links with these standard inertial parameters (10 b,) need [N m]."""
        return self.body_rows(inertial).link[:, :, 0]

    def at(self, side: Side, joint: str, columns: FloatArray) -> Contribution:
        """Rows of columns (N, k) that act at one joint, at its motor, its link or in its spring."""
        index, shape = self.robot.index(joint), (len(self.motion), self.robot.n, columns.shape[1])
        rows, nothing = np.zeros(shape), np.broadcast_to(0.0, shape)
        rows[:, index] = columns
        if side is Side.LINK:
            return Contribution(rows, nothing, index)
        if side is Side.SPRING:
            return Contribution(-rows, rows, index)
        return Contribution(nothing, rows if side is Side.MOTOR else nothing, index)
