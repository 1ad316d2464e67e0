"""One motor's torque per current is another one than taken."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects.acting import Action, no_torque
from sea_ident.effects.base import Column
from sea_ident.effects.load import MotorLoadEffect
from sea_ident.effects.state import Contribution, Side, State
from sea_ident.exceptions import EffectError
from sea_ident.robot import Robot


@dataclass(frozen=True)
class TorqueConstant(MotorLoadEffect):
    """E (tau + tau_r) in the motor row alone: the torque that the joint carries, and what the rotor takes itself.

    The motor's own friction takes up its part of the change, the inertia of a rotor that is one of several alike does
    not. A change common to all motors cannot be seen: only ratios can.
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

    def evaluate(self, state: State) -> Contribution:
        """Motor row (N, n, 1)."""
        return state.at(Side.MOTOR, self.at, self.column_of(self.load(state) + self.rotor_torque(state), np.zeros(0)))

    def torque(self, robot: Robot, values: FloatArray) -> Action:
        """None: it acts in `demand`."""
        return no_torque

    def demand(self, robot: Robot, values: FloatArray) -> FloatArray:
        """As much more at its motor as is recorded.

        Raises:
            EffectError: if the motor would turn the other way.
        """
        factors = np.ones(robot.n)
        factors[robot.index(self.at)] += float(values[0])
        if not np.all(factors > 0.0):
            raise EffectError(
                f"torque_constant of {values[0]:g} at {self.at!r} turns the motor round; give more than -1"
            )
        return factors
