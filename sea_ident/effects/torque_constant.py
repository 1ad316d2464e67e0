"""One motor's torque per current is another one than taken."""

from dataclasses import dataclass
from typing import ClassVar

from sea_ident._typing import FloatArray
from sea_ident.effects.base import Column, Side
from sea_ident.effects.load import MotorLoadEffect
from sea_ident.robot import Robot


@dataclass(frozen=True)
class TorqueConstant(MotorLoadEffect):
    """E tau in the motor row alone, tau being the torque that the joint carries.

    The motor's own inertia and friction take up their part of the change. A change common to all motors cannot be
    seen: only ratios can.
    """

    name: ClassVar[str] = "torque_constant"
    side: ClassVar[Side] = Side.MOTOR
    source: ClassVar[str] = "Gautier, Briot, Global identification of joint drive gains, ASME J. Dyn. Sys. 136, 2014"

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """One column: relative error of the torque constant."""
        robot.index(self.at)
        return (Column(self.parameter_name(), "-", self.name, self.joint, self.side),)

    def column_of(self, load: FloatArray, dtheta: FloatArray) -> FloatArray:
        """Tau."""
        return load[:, None]
