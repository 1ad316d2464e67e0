"""Stiffness that grows with the deflection."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects.base import Column, Shape
from sea_ident.effects.spring import SpringEffect, stated
from sea_ident.robot import Robot


@dataclass(frozen=True)
class SpringStiffening(SpringEffect):
    """K (theta - q) |theta - q|^(p-1); p = 3 is the paper's cubic stiffness.

    Attributes:
        joint: joint at which it acts.
        exponent: p [-].
    """

    exponent: float = 3.0

    name: ClassVar[str] = "spring_stiffening"
    source: ClassVar[str] = "Vantilt et al., ICRA 2015, eq. 21"
    shapes: ClassVar[tuple[Shape, ...]] = (Shape("exponent", "-", 2.0, 3.0, logarithmic=False),)

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """One column."""
        torque, position = self.units_of(robot)
        unit = f"{torque}/{position}{self.exponent:g}"
        return (Column(self.parameter_name(), unit, self.name, self.joint, self.side),)

    def local_columns(self, q: FloatArray, dq: FloatArray, theta: FloatArray, dtheta: FloatArray) -> FloatArray:
        """D |d|^(p-1)."""
        deflection = theta - q
        return (deflection * np.abs(deflection) ** (self.exponent - 1.0))[:, None]

    def prior(self, robot: Robot) -> FloatArray:
        """The annotation's cubic stiffness."""
        return stated(robot.spring(self.required_joint).cubic_stiffness if self.exponent == 3.0 else None)
