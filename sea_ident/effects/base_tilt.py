"""A base that does not stand level."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pinocchio as pin

from sea_ident._typing import FloatArray
from sea_ident.effects.acting import Action
from sea_ident.effects.base import Anchor, Column, Effect
from sea_ident.effects.state import Contribution, Side, State
from sea_ident.robot import Robot

LARGEST = 1.0
"""Angle beyond which the columns are not followed: no base stands so, and near a right angle they vanish [rad]."""

HARDLY_SEEN = 1e-3
"""Share of the torque by a rotation about one axis below which that about the other is none, as long as its angle is 0:
a robot that moves in an upright plane does not feel it turn about an axis in the plane, but for the digits that the
plane was given with [-]."""


@dataclass(frozen=True)
class BaseTilt(Effect):
    """Gravity in another direction than the description says.

    Gravity turned by an angle t is g - sin t / t (t x g) + (1 - cos t) / t^2 (t x (t x g)): linear in the angle, but
    for what is known of it by `angles`.

    Attributes:
        joint: None, it acts on the whole robot.
        inertial: (10 b,) standard inertial parameters of all links; empty for those of the description.
        angles: rotation about the two level axes that the columns hold at, and nearly so close by [rad].
    """

    inertial: Sequence[float] = ()
    angles: Sequence[float] = (0.0, 0.0)

    name: ClassVar[str] = "base_tilt"
    side: ClassVar[Side] = Side.LINK
    source: ClassVar[str] = "Khalil, Dombre, Modeling, Identification and Control of Robots, 2002, section 9.3"
    depends_on: ClassVar[tuple[str, ...]] = ("q",)

    def __post_init__(self) -> None:
        object.__setattr__(self, "inertial", tuple(float(value) for value in self.inertial))
        object.__setattr__(self, "angles", tuple(float(value) for value in self.angles))

    @classmethod
    def instances(cls, robot: Robot) -> tuple[Effect, ...]:
        """Once for the whole robot, if there is gravity."""
        return (cls(),) if np.any(robot.model.gravity.linear) else ()

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """Rotation of the base about two level axes."""
        return tuple(
            Column(self.parameter_name(label), "rad", self.name, None, self.side) for label in ("first", "second")
        )

    def evaluate(self, state: State) -> Contribution:
        """Torque of the change of gravity over the angle."""
        inertial = np.array(self.inertial) if len(self.inertial) else state.robot.inertial_parameters
        gravity = np.asarray(state.robot.model.gravity.linear)
        axes = level_axes(gravity)
        turn = self.angles[0] * axes[0] + self.angles[1] * axes[1]
        half = 0.5 * float(np.linalg.norm(turn))
        along, across = np.sinc(2.0 * half / np.pi), 0.5 * np.sinc(half / np.pi) ** 2
        columns = []
        for axis in axes:
            sideways = np.cross(axis, gravity)
            change = along * sideways - across * np.cross(turn, sideways)
            # the base turns by an angle, so gravity turns the other way as the robot sees it
            columns.append(-state.gravity_torque(change, inertial))
        out = np.stack(columns, axis=2)
        sizes = np.linalg.norm(out, axis=(0, 1))
        out[:, :, (sizes < HARDLY_SEEN * np.max(sizes)) & (np.array(self.angles) == 0.0)] = 0.0
        return state.body_columns(out)

    def anchored(self, anchor: Anchor) -> "BaseTilt":
        """With the inertial parameters of the model, and the angles that it has by now."""
        found = (anchor.value(self.parameter_name(label)) for label in ("first", "second"))
        angles = tuple(float(np.clip(angle, -LARGEST, LARGEST)) for angle in found)
        return replace(self, inertial=anchor.inertial(), angles=angles)

    def torque(self, robot: Robot, values: FloatArray) -> Action:
        """None: it acts in `modified`."""
        return lambda state, link, motor: None

    def modified(self, robot: Robot, values: FloatArray) -> Robot:
        """The robot with its gravity turned."""
        gravity = np.asarray(robot.model.gravity.linear)
        turn = sum((value * axis for value, axis in zip(values, level_axes(gravity), strict=True)), np.zeros(3))
        return with_gravity(robot, pin.exp3(-turn) @ gravity)


def level_axes(gravity: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Two axes at right angles to gravity: those of the base where it stands level."""
    down = gravity / np.linalg.norm(gravity)
    start = np.eye(3)[int(np.argmin(np.abs(down)))]
    first = start - (start @ down) * down
    first /= np.linalg.norm(first)
    return first, np.cross(-down, first)


def with_gravity(robot: Robot, gravity: FloatArray) -> Robot:
    """The same robot under another gravity (3,) [m/s2]."""
    model, extended = pin.Model(robot.model), pin.Model(robot.extended_model)
    model.gravity = pin.Motion(np.asarray(gravity), np.zeros(3))
    extended.gravity = pin.Motion(np.asarray(gravity), np.zeros(3))
    return replace(robot, model=model, extended_model=extended)
