"""Play in series with the spring."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import ClassVar

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects.base import Anchor, Column, Shape
from sea_ident.effects.spring import SpringEffect, deflections
from sea_ident.effects.state import State
from sea_ident.robot import Robot

LARGEST_STEP = 2.0
"""Factor between two widths that a search tries: where the play is never closed, K follows from the width, and what is
between the spring's own stiffness and its double must not be stepped over."""

SOFT = 0.5
"""Softness of the ends of a play that a search tries beside `NEARLY_HARD` ones, of every third width [-]."""

NEARLY_HARD = 0.05
"""Softness that few motions tell from hard ends, from which a search begins [-]."""


@dataclass(frozen=True)
class Backlash(SpringEffect):
    """-K (c + r (d^3 - (d - c)^3)), d = theta - q, c = clip(d, -w, w): within the play the spring carries nothing.

    With K the stiffness of the spring and r its cubic stiffness over K, what is left is the torque of the spring at
    d - c. K is fitted on its own. Teeth, cables and padding do not take hold at once: soft ends are met with a
    probability that grows over the deflections +-w +-s w, so c is the mean of the clip with a logistic spread, which is
    s w / 2 log(cosh((d + w) / s w) / cosh((d - w) / s w)).

    Attributes:
        joint: joint at which it acts.
        half_width: w [rad] or [m].
        softness: s of its ends; the smaller, the harder [-].
        cubic: r of the spring that the play is in series with [1/rad2] or [1/m2].
    """

    half_width: float = 0.003
    softness: float = NEARLY_HARD
    cubic: float = 0.0

    name: ClassVar[str] = "backlash"
    source: ClassVar[str] = "Nordin, Gutman, Controlling mechanical systems with backlash, Automatica 38, 2002"
    shapes: ClassVar[tuple[Shape, ...]] = (
        Shape("half_width", "rad", 1e-5, 0.5),
        Shape("softness", "-", 0.01, 1.5),
    )
    depends_on: ClassVar[tuple[str, ...]] = ("q", "theta")

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """One column."""
        torque, position = self.units_of(robot)
        return (Column(self.parameter_name(), f"{torque}/{position}", self.name, self.joint, self.side, True),)

    def anchored(self, anchor: Anchor) -> "Backlash":
        """With the cubic stiffness of the model."""
        stiffness = anchor.value(f"{self.joint}.spring_stiffness")
        if not stiffness > 0.0:
            return self
        return replace(self, cubic=max(anchor.value(f"{self.joint}.spring_stiffening") / stiffness, 0.0))

    def variants(self, state: State) -> tuple["Backlash", ...]:
        """Widths within the deflections of this motion, and between where it deflects to one side only."""
        widths = deflections(state, self.required_joint, 18)
        between = [
            float(width)
            for low, high in pairwise(widths)
            for width in np.geomspace(low, high, int(np.ceil(np.log(high / low) / np.log(LARGEST_STEP))) + 1)[1:-1]
        ]
        every = sorted((*widths, *between))
        hard = (replace(self, half_width=width) for width in every)
        return (*hard, *(replace(self, half_width=width, softness=SOFT) for width in every[::3]))

    def plausible(self, values: FloatArray, parameters: Mapping[str, float]) -> bool:
        """Whether K is about the stiffness of the spring that the play is in series with."""
        stiffness = parameters.get(f"{self.joint}.spring_stiffness", 0.0)
        return bool(0.4 * stiffness < values[0] < 2.5 * stiffness)

    def local_columns(self, q: FloatArray, dq: FloatArray, theta: FloatArray, dtheta: FloatArray) -> FloatArray:
        """-(c + r (d^3 - (d - c)^3))."""
        d = theta - q
        c = self._taken_up(d)
        left = d - c
        return -(c + self.cubic * (d * d * d - left * left * left))[:, None]

    def _taken_up(self, deflection: FloatArray) -> FloatArray:
        """(N,) part of deflections (N,) that the play takes up."""
        w, spread = self.half_width, self.softness * self.half_width
        beyond = np.abs(np.array([deflection + w, deflection - w])) * (-2.0 / spread)
        low, high = np.log1p(np.exp(beyond, out=beyond), out=beyond)
        within = np.minimum(np.maximum(deflection, -w), w)
        return np.asarray(within + 0.5 * spread * (low - high), dtype=np.float64)
