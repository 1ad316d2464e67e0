"""What a model leaves of a recording whose columns are put right, in a few of its samples."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from sea_ident._typing import FloatArray
from sea_ident.effects import Effect, corrected_motion
from sea_ident.motion import Motion
from sea_ident.processing import ProcessedRecording
from sea_ident.processing.torque import transmitted
from sea_ident.regressor import build_total
from sea_ident.robot import Robot

EQUATIONS = 900
"""Equations that are looked at, of all joints together."""


@dataclass(frozen=True, eq=False)
class Order:
    """Columns as they may have been meant.

    Attributes:
        link: (n,) number of the joint under whose name the q of every joint stands.
        motor: (n,) the same of theta.
        torque: (n,) the same of the torque.
        motion_sign: (n,) 1 or -1.
        torque_sign: (n,) 1 or -1.
        text: what is wrong if this is right, and what to do.
        gravity: (3,) in the root link [m/s2]; that of the description where None.
        zeros: wrong zeros of encoders.
    """

    link: NDArray[np.int_]
    motor: NDArray[np.int_]
    torque: NDArray[np.int_]
    motion_sign: FloatArray
    torque_sign: FloatArray
    text: str
    gravity: FloatArray | None = None
    zeros: tuple[Effect, ...] = ()


def as_they_say(robot: Robot, zeros: tuple[Effect, ...] = ()) -> Order:
    """Every column that of its name, but for wrong zeros."""
    own, plain = np.arange(robot.n), np.ones(robot.n)
    return Order(own, own, own, plain, plain, "", zeros=zeros)


@dataclass(frozen=True, eq=False)
class Trial:
    """A recording and a model, by which columns are tried that were put right.

    Attributes:
        robot: the robot.
        effects: the model.
        motion: (N, n).
        torque: (N, n) of the motors [N m] or [N].
        channels: further signals (N, n) by kind.
        noise: (n,) variance of the mean of the periods, as a share of the power of the torque [-].
        by_current: whether the torque is that of the currents.
    """

    robot: Robot
    effects: tuple[Effect, ...]
    motion: Motion
    torque: FloatArray
    channels: Mapping[str, FloatArray]
    noise: FloatArray
    by_current: bool

    @classmethod
    def of(cls, robot: Robot, effects: Sequence[Effect], processed: ProcessedRecording) -> Self | None:
        """Some samples of a recording; None where a motor gives no torque."""
        thin = slice(None, None, max(1, processed.samples * robot.n // EQUATIONS))
        motion, torque = processed.motion[thin], processed.tau_motor[thin]
        channels = {kind: values[thin] for kind, values in processed.channels.items()}
        power = np.mean(torque**2, axis=0)
        if not np.all(power > 0.0):
            return None
        noise = np.mean(processed.raw_tau_variance[thin], axis=0) / processed.periods / power
        current = channels.get("current")
        by_current = current is not None and np.allclose(_from_current(robot, current, motion), torque, rtol=1e-6)
        return cls(robot, tuple(effects), motion, torque, channels, noise, by_current)

    def __call__(self, order: Order) -> tuple[float, bool]:
        """Share of the power of the torque that is left, the mean of the joints, and whether all inertias are positive.

        Args:
            order: how the columns were meant.
        """
        robot = self.robot
        arranged = corrected_motion(robot, order.zeros, _arranged(robot, self.motion, order))
        target = self.torque[:, order.torque] * order.torque_sign
        if self.by_current:
            target = _from_current(robot, self.channels["current"][:, order.torque] * order.torque_sign, arranged)
        mounted = robot if order.gravity is None else robot.with_gravity(order.gravity)
        rows = build_total(mounted, self.effects, arranged, self.channels)
        scale = 1.0 / np.sqrt(np.mean(target**2, axis=0))
        table = (rows * scale[:, None]).reshape(-1, rows.shape[-1])
        norms = np.linalg.norm(table, axis=0)
        norms = np.where(norms > 0.0, norms, 1.0)
        values = np.linalg.lstsq(table / norms, (target * scale).ravel(), rcond=1e-8)[0]
        residual = target * scale - (table / norms @ values).reshape(target.shape)
        left = np.maximum(np.mean(residual**2, axis=0) - self.noise[order.torque], 0.0)
        response = build_total(mounted, self.effects, _pushes(robot, arranged.q.mean(axis=0)))
        inertia = np.array([(response[i, i] - response[-1, i]) / norms @ values for i in range(robot.n)])
        return float(np.mean(left)), bool(np.all(inertia > 0.0))


def _arranged(robot: Robot, motion: Motion, order: Order) -> Motion:
    """A motion with the columns of its joints put right."""
    link = [getattr(motion, kind)[:, order.link] * order.motion_sign for kind in ("q", "dq", "ddq")]
    motor = [getattr(motion, kind)[:, order.motor] * order.motion_sign for kind in ("theta", "dtheta", "ddtheta")]
    rigid = np.setdiff1d(np.arange(robot.n), robot.elastic_indices)
    for own, other in zip(motor, link, strict=True):
        own[:, rigid] = other[:, rigid]
    return Motion(motion.time, *link, *motor)


def _from_current(robot: Robot, current: FloatArray, motion: Motion) -> FloatArray:
    """(N, n) torque of currents (N, n) of the motors [N m] or [N]; zero where a motor is not described."""
    torque, efficiency = np.zeros_like(current), np.ones(robot.n)
    for i, joint in enumerate(robot.joints):
        if joint.actuator is not None and joint.actuator.torque_constant is not None:
            torque[:, i] = joint.actuator.gear_ratio * joint.actuator.torque_constant * current[:, i]
            efficiency[i] = joint.actuator.efficiency or 1.0
    return torque * transmitted(torque, efficiency, motion.dtheta)


def _pushes(robot: Robot, middle: FloatArray) -> Motion:
    """(n + 1 samples) every joint accelerated alone at one posture (n,), and none."""
    still = np.zeros((robot.n + 1, robot.n))
    push = np.vstack([np.eye(robot.n), np.zeros((1, robot.n))])
    return Motion.rigid(np.arange(robot.n + 1.0), still + middle, still, push)
