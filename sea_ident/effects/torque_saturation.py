"""Torque that falls behind the current when the motor is overloaded."""

from dataclasses import dataclass
from typing import ClassVar

from sea_ident._typing import FloatArray
from sea_ident.effects.base import Action, Column, Contribution, Side, SimulationState, State
from sea_ident.effects.load import LoadEffect
from sea_ident.robot import Robot


@dataclass(frozen=True)
class TorqueSaturation(LoadEffect):
    """C tau_m^3 in the motor row: the commanded torque that saturation takes away."""

    name: ClassVar[str] = "torque_saturation"
    side: ClassVar[Side] = Side.MOTOR
    source: ClassVar[str] = "Vantilt et al., ICRA 2015, on eq. 6"

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """One column."""
        unit = robot.joints[robot.index(self.at)].torque_unit
        return (Column(self.parameter_name(), f"1/({unit})^2", self.name, self.joint, self.side, True),)

    def evaluate(self, state: State) -> Contribution:
        """Cube of the motor torque."""
        return state.at(self.side, self.at, self.motor_torque(state)[:, None] ** 3)

    def torque(self, robot: Robot, values: FloatArray) -> Action:
        """The cube of the commanded torque."""
        i = robot.index(self.at)

        def act(state: SimulationState, link: FloatArray, motor: FloatArray) -> None:
            motor[i] += float(values[0] * state.tau_motor[i] ** 3)

        return act
