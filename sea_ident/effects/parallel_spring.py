"""A spring between neighbouring links: for balance, or a cable, or a hose."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects.base import Column, JointEffect
from sea_ident.effects.state import Side
from sea_ident.robot import Robot


@dataclass(frozen=True)
class ParallelSpring(JointEffect):
    """K q + t_0 at the link."""

    name: ClassVar[str] = "parallel_spring"
    side: ClassVar[Side] = Side.LINK
    source: ClassVar[str] = "Khalil, Dombre, Modeling, Identification and Control of Robots, 2002, section 9.3"
    depends_on: ClassVar[tuple[str, ...]] = ("q",)

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """Stiffness, and torque at q = 0."""
        torque, position = self.units_of(robot)
        return (
            Column(self.parameter_name("stiffness"), f"{torque}/{position}", self.name, self.joint, self.side),
            Column(self.parameter_name("preload"), torque, self.name, self.joint, self.side),
        )

    def local_columns(self, q: FloatArray, dq: FloatArray, theta: FloatArray, dtheta: FloatArray) -> FloatArray:
        """Q and 1."""
        return np.stack([q, np.ones_like(q)], axis=1)
