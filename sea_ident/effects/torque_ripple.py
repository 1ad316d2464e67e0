"""Torque that repeats with every turn: cogging, gear teeth, wave generators."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects.base import Column, JointEffect, Shape, Side, State
from sea_ident.effects.orders import orders
from sea_ident.robot import Robot


@dataclass(frozen=True)
class TorqueRipple(JointEffect):
    """A sin(n theta) + b cos(n theta) at the motor.

    Attributes:
        joint: joint at which it acts.
        order: n, periods per turn of the joint (of the motor: times the gear ratio) [-].
    """

    order: float = 1.0

    name: ClassVar[str] = "torque_ripple"
    side: ClassVar[Side] = Side.MOTOR
    source: ClassVar[str] = "Ghorbel, Gandhi, Alpeter, On the kinematic error in harmonic drive gears, 2001"
    shapes: ClassVar[tuple[Shape, ...]] = (Shape("order", "1/rad", 0.5, 2000.0),)

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """Sine and cosine."""
        torque, _ = self.units_of(robot)
        return tuple(
            Column(self.parameter_name(label), torque, self.name, self.joint, self.side) for label in ("sine", "cosine")
        )

    def local_columns(self, q: FloatArray, dq: FloatArray, theta: FloatArray, dtheta: FloatArray) -> FloatArray:
        """Sine and cosine of n theta."""
        angle = self.order * theta
        columns = np.empty((len(angle), 2))
        np.sin(angle, out=columns[:, 0])
        np.cos(angle, out=columns[:, 1])
        return columns

    def variants(self, state: State) -> tuple["TorqueRipple", ...]:
        """All orders that this motion tells apart, up to those too fast for its samples."""
        return tuple(replace(self, order=order) for order in orders(state, self.required_joint, 300))
