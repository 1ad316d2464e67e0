"""Inertia and gravity of the links."""

from dataclasses import dataclass
from typing import ClassVar

from sea_ident._typing import FloatArray
from sea_ident.effects.acting import Action, no_torque
from sea_ident.effects.base import Column, Effect
from sea_ident.effects.state import Contribution, Side, State
from sea_ident.robot import INERTIAL_UNITS, Robot


@dataclass(frozen=True)
class RigidBodies(Effect):
    """Ten standard inertial parameters for every moving link, about its joint frame."""

    name: ClassVar[str] = "rigid_bodies"
    side: ClassVar[Side] = Side.BOTH
    source: ClassVar[str] = "Hollerbach, Khalil, Gautier, Model identification, Springer Handbook of Robotics, 2008"

    @classmethod
    def instances(cls, robot: Robot) -> tuple[Effect, ...]:
        """Once for the whole robot."""
        return (cls(),)

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """`<link>.m`, `<link>.mx`, ..., `<link>.Izz`, body by body."""
        units = INERTIAL_UNITS * len(robot.bodies)
        return tuple(
            Column(
                name,
                unit,
                self.name,
                None,
                self.side,
                nonnegative=name.endswith((".m", ".Ixx", ".Iyy", ".Izz")),
            )
            for name, unit in zip(robot.inertial_names, units, strict=True)
        )

    def evaluate(self, state: State) -> Contribution:
        """Rows of the links."""
        return state.body_columns(state.body_regressor)

    def prior(self, robot: Robot) -> FloatArray:
        """The URDF's own inertials."""
        return robot.inertial_parameters

    def torque(self, robot: Robot, values: FloatArray) -> Action:
        """Nothing to add: the simulator integrates the bodies themselves."""
        return no_torque
