"""Loss of the gear while the motor drives, and none while it is driven."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects.base import Column
from sea_ident.effects.gear_loss import GearLoss
from sea_ident.effects.state import Side
from sea_ident.robot import Robot


@dataclass(frozen=True)
class DirectionalEfficiency(GearLoss):
    """c |tau| sgn(theta') where tau theta' > 0, at the motor."""

    name: ClassVar[str] = "directional_efficiency"
    side: ClassVar[Side] = Side.MOTOR
    source: ClassVar[str] = (
        "Vantilt et al., ICRA 2015, eq. 7; Wang, Kim, Directional properties in harmonic drives, 2009"
    )

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """One column; negative where the loss is in the other direction."""
        robot.index(self.at)
        return (Column(self.parameter_name(), "-", self.name, self.joint, self.side),)

    def column_of(self, load: FloatArray, dtheta: FloatArray) -> FloatArray:
        """|tau| sgn(theta') where the motor drives."""
        return (np.abs(load) * self.sign(dtheta) * (load * dtheta > 0.0))[:, None]
