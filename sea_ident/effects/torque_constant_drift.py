"""A torque constant that changes in the course of the recording, as magnets warm."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects.acting import Action, JointAction, SimulationState
from sea_ident.effects.base import Column, Shape
from sea_ident.effects.drift import DriftInTime
from sea_ident.effects.load import LoadEffect
from sea_ident.effects.state import Contribution, Side, State
from sea_ident.robot import Robot


@dataclass(frozen=True)
class TorqueConstantDrift(LoadEffect, DriftInTime):
    """tau_m times the drift, in the motor row.

    Attributes:
        joint: joint at which it acts.
        time_constant: of the drift [s].
        reference: time at which it is none [s].
    """

    time_constant: float = 1e4
    reference: float = 0.0

    name: ClassVar[str] = "torque_constant_drift"
    side: ClassVar[Side] = Side.MOTOR
    source: ClassVar[str] = (
        "Sebastian, Temperature effects on torque production of PM motors, IEEE Trans. Ind. Appl. 1995"
    )
    shapes: ClassVar[tuple[Shape, ...]] = (Shape("time_constant", "s", 20.0, 1e4, points=4),)
    mean_is_free: ClassVar[bool] = False

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """Initial relative rate of the torque that the record shows."""
        robot.index(self.at)
        return (Column(self.parameter_name(), "1/min", self.name, self.joint, self.side),)

    def evaluate(self, state: State) -> Contribution:
        """Motor torque times the drift."""
        column = self.motor_torque(state) * self.change(state.motion.time, None)
        return state.at(self.side, self.at, column[:, None])

    def steady(self, state: State) -> Contribution:
        """Motor torque: as it was measured where it was, for a model that lacks something does not have it all."""
        measured = None if state.channels is None else state.channels.get("tau_motor")
        torque = self.motor_torque(state) if measured is None else measured[:, state.robot.index(self.at)]
        return state.at(self.side, self.at, torque[:, None])

    def referred(self, values: FloatArray, change: float) -> FloatArray:
        """The measured torque drifts as the constant does: it is another share of what was measured before."""
        return np.asarray(values / (1.0 + values * change), dtype=np.float64)

    def delivered_share(self, robot: Robot, values: FloatArray, change: float) -> FloatArray:
        """Of the torque u that the record shows, v c u is none."""
        shares = np.ones(robot.n)
        shares[robot.index(self.at)] -= change * float(values[0])
        return shares

    def torque(self, robot: Robot, values: FloatArray) -> Action:
        """The part of the commanded torque that is lost."""

        def columns(state: SimulationState) -> FloatArray:
            return (state.tau_motor * self.change(np.array(state.time), None))[:, None]

        return JointAction(robot.index(self.at), self.side.shares, columns, values, of_speed=False)
