"""Linear stiffness of the spring in series with the motor."""

from dataclasses import dataclass
from typing import ClassVar

from sea_ident._typing import FloatArray
from sea_ident.effects.base import Column
from sea_ident.effects.spring import SpringEffect, stated
from sea_ident.robot import Robot


@dataclass(frozen=True)
class SpringStiffness(SpringEffect):
    """K1 (theta - q)."""

    name: ClassVar[str] = "spring_stiffness"
    source: ClassVar[str] = "Vantilt et al., ICRA 2015, eq. 21"

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """One column."""
        torque, position = self.units_of(robot)
        return (Column(self.parameter_name(), f"{torque}/{position}", self.name, self.joint, self.side, True),)

    def local_columns(self, q: FloatArray, dq: FloatArray, theta: FloatArray, dtheta: FloatArray) -> FloatArray:
        """Theta - q."""
        return (theta - q)[:, None]

    def prior(self, robot: Robot) -> FloatArray:
        """The annotation's value."""
        return stated(robot.spring(self.required_joint).stiffness)
