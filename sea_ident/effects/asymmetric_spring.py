"""A spring that is stiffer one way than the other."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects.base import Column, Shape
from sea_ident.effects.spring import SpringEffect
from sea_ident.robot import Robot


@dataclass(frozen=True)
class AsymmetricSpring(SpringEffect):
    """K |theta - q|^p.

    Attributes:
        joint: joint at which it acts.
        exponent: p [-].
    """

    exponent: float = 1.0

    name: ClassVar[str] = "asymmetric_spring"
    source: ClassVar[str] = "Vanderborght et al., MACCEPA 2.0, ICRA 2009"
    shapes: ClassVar[tuple[Shape, ...]] = (Shape("exponent", "-", 1.0, 3.0, logarithmic=False, points=3),)

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """One column."""
        torque, position = self.units_of(robot)
        unit = f"{torque}/{position}^{self.exponent:.3g}"
        return (Column(self.parameter_name(), unit, self.name, self.joint, self.side),)

    def local_columns(self, q: FloatArray, dq: FloatArray, theta: FloatArray, dtheta: FloatArray) -> FloatArray:
        """|theta - q|^p."""
        return (np.abs(theta - q) ** self.exponent)[:, None]
