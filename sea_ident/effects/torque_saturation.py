"""Torque that falls behind the current when the motor is overloaded."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects.acting import Action, JointAction
from sea_ident.effects.base import Anchor, Column, Shape
from sea_ident.effects.load import LoadEffect
from sea_ident.effects.state import Contribution, Side, State
from sea_ident.robot import Robot

CUBE = 3.0
"""Power of the first term of any saturation that is the same both ways [-]."""

_STEPS = 12
"""Newton steps from the torque to the command."""


@dataclass(frozen=True)
class TorqueSaturation(LoadEffect):
    """C sgn(u) |u|^p in the motor row, u being the commanded torque: what saturation takes away from it.

    Attributes:
        exponent: p, a cube by default [-].
        coefficient: c of the model, by which u follows from the torque that the motor gives: u - c u^p = tau_m.
        found_with: the p that belongs to this c [-].
        typical: torque at which as much is taken away with another p; that of the motion where 0 [N m].
    """

    exponent: float = CUBE
    coefficient: float = 0.0
    found_with: float = CUBE
    typical: float = 0.0

    name: ClassVar[str] = "torque_saturation"
    side: ClassVar[Side] = Side.MOTOR
    source: ClassVar[str] = "Vantilt et al., ICRA 2015, on eq. 6"
    shapes: ClassVar[tuple[Shape, ...]] = (Shape("exponent", "-", 1.5, 9.0, points=1),)

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """One column."""
        torque = "N" if robot.joints[robot.index(self.at)].prismatic else "(N m)"
        unit = f"1/{torque}^{self.exponent - 1.0:.3g}"
        return (Column(self.parameter_name(), unit, self.name, self.joint, self.side, True),)

    def variants(self, state: State) -> tuple["TorqueSaturation", ...]:
        """The cube: other powers are nearly the same, and found from there."""
        return (replace(self, typical=self._typical(self.motor_torque(state))),)

    def anchored(self, anchor: Anchor) -> "TorqueSaturation":
        """With the load and the saturation of the model.

        Where the command saturates much, more of it leaves less to be explained: followed at once, the one would jump
        about the other.
        """
        value = max(anchor.value(self.parameter_name()), 0.0)
        if self.coefficient > 0.0 and (self.typical > 0.0 or self.found_with == self.exponent):
            value = 0.5 * (value + self.coefficient * (self.typical or 1.0) ** (self.found_with - self.exponent))
        return replace(super().anchored(anchor), coefficient=value, found_with=self.exponent)

    def evaluate(self, state: State) -> Contribution:
        """Power of the commanded torque."""
        torque, p = self.motor_torque(state), self.exponent
        command = torque
        if self.coefficient > 0.0:
            # what is taken away stays about the same with another exponent
            typical = self.typical or self._typical(torque)
            coefficient = self.coefficient * typical ** (self.found_with - p)
            largest = (p * coefficient) ** (-1.0 / (p - 1.0))
            for _ in range(_STEPS):
                size = np.abs(command)
                error = command - coefficient * np.sign(command) * size**p - torque
                slope = np.maximum(1.0 - p * coefficient * size ** (p - 1.0), 0.1)
                command = np.clip(command - error / slope, -largest, largest)
        return state.at(self.side, self.at, self._power(command))

    def _power(self, command: FloatArray) -> FloatArray:
        column: FloatArray = (np.sign(command) * np.abs(command) ** self.exponent)[:, None]
        return column

    @staticmethod
    def _typical(torque: FloatArray) -> float:
        return float(np.sqrt(np.mean(torque**2)))

    def torque(self, robot: Robot, values: FloatArray) -> Action:
        """The power of the commanded torque."""
        return JointAction(
            robot.index(self.at), self.side.shares, lambda state: self._power(state.tau_motor), values, of_speed=False
        )
