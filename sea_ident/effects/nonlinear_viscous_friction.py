"""Friction that grows with another power of the speed than one."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects.base import Column, JointEffect, Shape
from sea_ident.effects.state import Side
from sea_ident.robot import Robot


@dataclass(frozen=True)
class NonlinearViscousFriction(JointEffect):
    """c sgn(theta') |theta'|^p at the motor.

    Attributes:
        joint: joint at which it acts.
        exponent: p [-].
    """

    exponent: float = 2.0

    name: ClassVar[str] = "nonlinear_viscous_friction"
    side: ClassVar[Side] = Side.MOTOR
    source: ClassVar[str] = "Bona, Indri, Friction compensation in robotics: an overview, IEEE CDC, 2005"
    shapes: ClassVar[tuple[Shape, ...]] = (Shape("exponent", "-", 0.3, 3.0, logarithmic=False, points=8),)

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """One column; with a power below one it may be negative, as less friction at high speed."""
        torque, position = self.units_of(robot)
        unit = f"{torque} (s/{position})^{self.exponent:.3g}"
        return (Column(self.parameter_name(), unit, self.name, self.joint, self.side),)

    def local_columns(self, q: FloatArray, dq: FloatArray, theta: FloatArray, dtheta: FloatArray) -> FloatArray:
        """Sgn(theta') |theta'|^p."""
        return (np.sign(dtheta) * np.abs(dtheta) ** self.exponent)[:, None]
