"""Stiffness that grows with the deflection."""

from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects.base import Column, Shape
from sea_ident.effects.spring import SpringEffect, stated
from sea_ident.effects.state import State
from sea_ident.robot import Robot

CUBIC = 3.0

BESIDE_CUBIC = (2.0, 5.0)
"""Powers that are tried beside the cubic one: springs that stiffen sooner, and those that stiffen at their end."""


@dataclass(frozen=True)
class SpringStiffening(SpringEffect):
    """K (theta - q) |theta - q|^(p-1); p = 3 is the paper's cubic stiffness, beside which another power can stand.

    Attributes:
        joint: joint at which it acts.
        exponent: p [-].
    """

    exponent: float = CUBIC

    name: ClassVar[str] = "spring_stiffening"
    source: ClassVar[str] = "Vantilt et al., ICRA 2015, eq. 21"
    shapes: ClassVar[tuple[Shape, ...]] = (Shape("exponent", "-", 1.5, 5.0, logarithmic=False, points=8),)

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """One column; that of another power than the third has a name of its own."""
        torque, position = self.units_of(robot)
        unit = f"{torque}/{position}{self.exponent:.3g}"
        name = self.parameter_name(None if self.exponent == CUBIC else "power")
        return (Column(name, unit, self.name, self.joint, self.side),)

    def local_columns(self, q: FloatArray, dq: FloatArray, theta: FloatArray, dtheta: FloatArray) -> FloatArray:
        """D |d|^(p-1)."""
        deflection = theta - q
        return (deflection * np.abs(deflection) ** (self.exponent - 1.0))[:, None]

    def slope(self, deflection: FloatArray) -> FloatArray:
        """(N,) stiffness at deflections (N,) of a spring with K = 1."""
        slope: FloatArray = self.exponent * np.abs(deflection) ** (self.exponent - 1.0)
        return slope

    def prior(self, robot: Robot) -> FloatArray:
        """The annotation's cubic stiffness."""
        return stated(robot.spring(self.required_joint).cubic_stiffness if self.exponent == CUBIC else None)

    def beside(self) -> Self | None:
        """Another power."""
        return replace(self, exponent=BESIDE_CUBIC[0]) if self.exponent == CUBIC else None

    def variants(self, state: State) -> tuple[Self, ...]:
        """All powers; where the cubic one is in the model already, some beside it."""
        if self.exponent == CUBIC:
            return super().variants(state)
        return tuple(replace(self, exponent=exponent) for exponent in BESIDE_CUBIC)
