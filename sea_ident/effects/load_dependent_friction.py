"""Friction that grows with the load on the gear."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects.base import Column
from sea_ident.effects.gear_loss import GearLoss
from sea_ident.effects.state import Side
from sea_ident.robot import Robot


@dataclass(frozen=True)
class LoadDependentFriction(GearLoss):
    """c |tau| sgn(theta') at the motor, tau being the torque that the joint carries."""

    name: ClassVar[str] = "load_dependent_friction"
    side: ClassVar[Side] = Side.MOTOR
    source: ClassVar[str] = (
        "Hamon, Gautier, Garrec, Dynamic identification of robots with a dry friction model, IROS 2010"
    )

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """One column."""
        robot.index(self.at)
        return (Column(self.parameter_name(), "-", self.name, self.joint, self.side, True),)

    def column_of(self, load: FloatArray, dtheta: FloatArray) -> FloatArray:
        """|tau| sgn(theta')."""
        return (np.abs(load) * self.sign(dtheta))[:, None]
