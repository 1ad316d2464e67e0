"""A spring that is stiffer one way than the other."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects.base import Column, Shape
from sea_ident.effects.spring import SpringEffect
from sea_ident.effects.state import State
from sea_ident.robot import Robot

KINKS = (-0.3, -0.15, 0.15, 0.3)
"""Places of a kink that a search tries beside none, as shares of the largest deflection of the motion [-]."""

OUT_OF_REACH = (0.9, 0.45, 0.225, 0.1125)
"""Where the motion deflects to one side only: places of a kink between rest and the motion, as shares of its least
deflection [-]. For the same torque on the motion the sides differ least at the first, and twice as much at every other,
which another motion is less likely to pass."""


@dataclass(frozen=True)
class AsymmetricSpring(SpringEffect):
    """K (|theta - q - d|^p - |d|^p): at rest there is no torque, wherever the kink is.

    Attributes:
        joint: joint at which it acts.
        exponent: p [-].
        kink: d, deflection at which one side ends and the other begins [rad] or [m].
    """

    exponent: float = 1.0
    kink: float = 0.0

    name: ClassVar[str] = "asymmetric_spring"
    source: ClassVar[str] = "Vanderborght et al., MACCEPA 2.0, ICRA 2009"
    shapes: ClassVar[tuple[Shape, ...]] = (
        Shape("exponent", "-", 1.0, 3.0, logarithmic=False, points=3),
        Shape("kink", "rad", -0.2, 0.2, logarithmic=False),
    )
    depends_on: ClassVar[tuple[str, ...]] = ("q", "theta")

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """One column."""
        torque, position = self.units_of(robot)
        unit = f"{torque}/{position}" + ("" if self.exponent == 1.0 else f"{self.exponent:.3g}")
        return (Column(self.parameter_name(), unit, self.name, self.joint, self.side),)

    def variants(self, state: State) -> tuple["AsymmetricSpring", ...]:
        """Exponents with the kink where the spring is at rest, and kinks elsewhere between two straight sides.

        A kink that the motion does not pass is tried only between it and the rest of the spring: beyond rest it does
        nothing but change the stiffness.
        """
        deflection = state.motion.deflection[:, state.robot.index(self.required_joint)]
        low, high = min(float(deflection.min()), 0.0), max(float(deflection.max()), 0.0)
        kinks = [share * max(-low, high) for share in KINKS]
        least = deflection[np.argmin(np.abs(deflection))]
        if low == 0.0 or high == 0.0:
            kinks.extend(share * float(least) for share in OUT_OF_REACH)
        exponents = (float(exponent) for exponent in self.shapes[0].grid())
        return (
            *(replace(self, exponent=exponent, kink=0.0) for exponent in exponents),
            *(replace(self, exponent=1.0, kink=kink) for kink in kinks if low < kink < high),
        )

    def same_here(self, state: State) -> tuple["AsymmetricSpring", ...]:
        """Kinks nearer to rest, where the motion deflects to one side only and does not pass its own."""
        deflection = state.motion.deflection[:, state.robot.index(self.required_joint)]
        least = float(deflection[np.argmin(np.abs(deflection))])
        one_sided = float(deflection.min()) * float(deflection.max()) > 0.0
        if self.exponent != 1.0 or not one_sided or not 0.0 < self.kink / least < 1.0:
            return ()
        kinks = (share * least for share in OUT_OF_REACH)
        return tuple(replace(self, kink=kink) for kink in kinks if abs(kink) < abs(self.kink))

    def plausible(self, values: FloatArray, parameters: Mapping[str, float]) -> bool:
        """Whether a spring of two straight sides pushes back on both."""
        stiffness = parameters.get(f"{self.joint}.spring_stiffness", 0.0)
        return bool(self.exponent > 1.0 or abs(values[0]) < abs(stiffness))

    def slope(self, deflection: FloatArray) -> FloatArray:
        """(N,) stiffness at deflections (N,) of a spring with K = 1, of either sign."""
        beyond = deflection - self.kink
        slope: FloatArray = self.exponent * np.sign(beyond) * np.abs(beyond) ** (self.exponent - 1.0)
        return slope

    def local_columns(self, q: FloatArray, dq: FloatArray, theta: FloatArray, dtheta: FloatArray) -> FloatArray:
        """|theta - q - d|^p - |d|^p."""
        column: FloatArray = np.abs(theta - q - self.kink) ** self.exponent - abs(self.kink) ** self.exponent
        return column[:, None]
