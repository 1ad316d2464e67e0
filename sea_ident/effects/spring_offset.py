"""A spring that is loaded at zero deflection, or a wrong zero of the motor encoder."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects.base import Column
from sea_ident.effects.spring import SpringEffect
from sea_ident.robot import Robot


@dataclass(frozen=True)
class SpringOffset(SpringEffect):
    """A constant torque in the spring."""

    name: ClassVar[str] = "spring_offset"
    source: ClassVar[str] = "HEBI Robotics, X-series documentation, spring zero"
    depends_on: ClassVar[tuple[str, ...]] = ()

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """One column."""
        torque, _ = self.units_of(robot)
        return (Column(self.parameter_name(), torque, self.name, self.joint, self.side),)

    def local_columns(self, q: FloatArray, dq: FloatArray, theta: FloatArray, dtheta: FloatArray) -> FloatArray:
        """1."""
        return np.ones((len(q), 1))
