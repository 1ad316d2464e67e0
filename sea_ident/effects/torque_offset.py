"""A constant torque at the motor: an offset of the current sensor, or Coulomb friction that differs by direction."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects.base import Column, JointEffect
from sea_ident.effects.state import Side
from sea_ident.robot import Robot


@dataclass(frozen=True)
class TorqueOffset(JointEffect):
    """A constant in the motor row."""

    name: ClassVar[str] = "torque_offset"
    side: ClassVar[Side] = Side.MOTOR
    source: ClassVar[str] = "Janot, Gautier, Brunot, EMPS benchmark, 2019"
    depends_on: ClassVar[tuple[str, ...]] = ()

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """One column."""
        torque, _ = self.units_of(robot)
        return (Column(self.parameter_name(), torque, self.name, self.joint, self.side),)

    def local_columns(self, q: FloatArray, dq: FloatArray, theta: FloatArray, dtheta: FloatArray) -> FloatArray:
        """1."""
        return np.ones((len(q), 1))
