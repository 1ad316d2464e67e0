"""Torque that falls behind the current when the motor is overloaded."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects.acting import Action, SimulationState
from sea_ident.effects.base import Anchor, Column, Contribution, Side, State
from sea_ident.effects.load import LoadEffect
from sea_ident.robot import Robot

_STEPS = 12
"""Newton steps from the torque to the command."""


@dataclass(frozen=True)
class TorqueSaturation(LoadEffect):
    """C u^3 in the motor row, u being the commanded torque: what saturation takes away from it.

    Attributes:
        coefficient: c of the model, by which u follows from the torque that the motor gives: u - c u^3 = tau_m.
    """

    coefficient: float = 0.0

    name: ClassVar[str] = "torque_saturation"
    side: ClassVar[Side] = Side.MOTOR
    source: ClassVar[str] = "Vantilt et al., ICRA 2015, on eq. 6"

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """One column."""
        unit = robot.joints[robot.index(self.at)].torque_unit
        return (Column(self.parameter_name(), f"1/({unit})^2", self.name, self.joint, self.side, True),)

    def anchored(self, anchor: Anchor) -> "TorqueSaturation":
        """With the load and the saturation of the model."""
        loaded = super().anchored(anchor)
        return replace(loaded, coefficient=max(anchor.value(self.parameter_name()), 0.0))

    def evaluate(self, state: State) -> Contribution:
        """Cube of the commanded torque."""
        torque = self.motor_torque(state)
        command = torque
        if self.coefficient > 0.0:
            largest = 1.0 / np.sqrt(3.0 * self.coefficient)
            for _ in range(_STEPS):
                error = command - self.coefficient * command**3 - torque
                slope = np.maximum(1.0 - 3.0 * self.coefficient * command**2, 0.1)
                command = np.clip(command - error / slope, -largest, largest)
        return state.at(self.side, self.at, command[:, None] ** 3)

    def torque(self, robot: Robot, values: FloatArray) -> Action:
        """The cube of the commanded torque."""
        i = robot.index(self.at)

        def act(state: SimulationState, link: FloatArray, motor: FloatArray) -> None:
            motor[i] += float(values[0] * state.tau_motor[i] ** 3)

        return act
