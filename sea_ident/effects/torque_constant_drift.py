"""A torque constant that changes in the course of the recording, as magnets warm."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects.acting import Action, JointAction, SimulationState
from sea_ident.effects.base import Column, Effect, Shape
from sea_ident.effects.drift import DriftInTime, friction_throughout
from sea_ident.effects.load import LoadEffect
from sea_ident.effects.state import Contribution, Side, State
from sea_ident.effects.torque_constant import TorqueConstant
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

    def throughout(self, values: FloatArray, change: float) -> tuple[tuple[Effect, FloatArray], ...]:
        """Another torque constant, and all that acts at the motor by as much more as the record shows of it.

        Of the torque u that the record shows, v c u is none: of what the motor gives it is 1 / (1 - v c).
        """
        more = 1.0 / (1.0 - change * values) - 1.0
        own = np.array([self.viscous or 0.0, self.coulomb or 0.0])
        beside = ((term.effect, more[0] * np.array(term.values)) for term in self._of(Side.MOTOR))
        return (TorqueConstant(self.at), more), *friction_throughout(self.at, self.smoothing, more * own), *beside

    def torque(self, robot: Robot, values: FloatArray) -> Action:
        """The part of the commanded torque that is lost."""

        def columns(state: SimulationState) -> FloatArray:
            return (state.tau_motor * self.change(np.array(state.time), None))[:, None]

        return JointAction(robot.index(self.at), self.side.shares, columns, values, of_speed=False)
