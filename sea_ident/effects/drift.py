"""Effects that change in the course of a recording."""

from abc import abstractmethod
from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects.acting import SimulationState
from sea_ident.effects.base import Effect, JointEffect, Shape
from sea_ident.effects.coulomb_friction import CoulombFriction
from sea_ident.effects.state import Contribution, State
from sea_ident.effects.viscous_friction import ViscousFriction
from sea_ident.robot import Robot

_MINUTE = 60.0

STRAIGHT = 300.0
"""Times the time at which a drift is none from which on its time constant is none that anybody could see [-]."""


class TrendEffect(Effect):
    """An effect that is a column times a change in time.

    The time of the motion is that of the recording: the columns of one mean period show next to nothing, and the
    comparison of the periods shows it all. A search asks for the two factors separately.

    Attributes:
        mean_is_free: whether the model has parameters of its own that take up its mean over a recording, as friction
            and stiffness are; else those of others do.
        follows: kind of the measured signal that it goes with; None where it goes by the time since a recording began,
            which says nothing of what was before.
    """

    mean_is_free: ClassVar[bool] = True
    follows: ClassVar[str | None] = None

    @abstractmethod
    def steady(self, state: State) -> Contribution:
        """Link and motor rows (N, n, k) for a change of one."""

    @abstractmethod
    def change(self, time: FloatArray, temperature: FloatArray | None) -> FloatArray:
        """Change at the times (P,) [s], with the temperatures (P,) of its joint where they are measured [degC]."""

    def referred(self, values: FloatArray, change: float) -> FloatArray:
        """Values (k,) for columns of a time at which less has changed, by `change`: where columns drift themselves."""
        return values

    @abstractmethod
    def about(self, change: float) -> Self:
        """The same, counted from where it has changed by so much: there it is none.

        What a model has in the mean of a recording is that of such a moment.
        """

    def throughout(self, values: FloatArray, change: float) -> tuple[tuple[Effect, FloatArray], ...]:
        """Effects with their values (k,) that do what this one does where it has changed by so much, and stays so.

        For a simulation of one period in the place of the mean of many. By default there are none that do.

        Args:
            values: (k,) of its own columns.
            change: how much it has changed.
        """
        return ()

    def delivered_share(self, robot: Robot, values: FloatArray, change: float) -> FloatArray:
        """(n,) share of the recorded torque that each motor gives where it has changed by so much [-]; by default all.

        Args:
            robot: the robot.
            values: (k,) of its own columns.
            change: how much it has changed.
        """
        return np.ones(robot.n)

    @property
    def moment(self) -> str:
        """Where it is none, and how it goes on, for people."""
        return "in the mean of a recording"


def friction_throughout(joint: str, smoothing: float, values: FloatArray) -> tuple[tuple[Effect, FloatArray], ...]:
    """The viscous and Coulomb friction of a motor, of two values."""
    return (ViscousFriction(joint), values[:1]), (CoulombFriction(joint, smoothing), values[1:])


def warming(time: FloatArray, time_constant: float) -> FloatArray:
    """Change at the times (any shape) [s] that starts at a rate of one per minute and ends with a time constant.

    With a time constant far longer than the recording it is linear in time.
    """
    amount: FloatArray = -time_constant * np.expm1(-time / time_constant) / _MINUTE
    return amount


class DriftInTime(TrendEffect):
    """A change in time that begins with the recording, and ends with a time constant.

    Attributes:
        time_constant: of the drift [s].
        reference: time at which it is none [s].
    """

    time_constant: float
    reference: float

    def change(self, time: FloatArray, temperature: FloatArray | None) -> FloatArray:
        """The drift."""
        at_reference = warming(np.array(self.reference), self.time_constant)
        return np.asarray(warming(time, self.time_constant) - at_reference, dtype=np.float64)

    def about(self, change: float) -> Self:
        """With the time at which that is reached as its reference."""
        # of all that it will change by, the share that it has by then
        share = change * _MINUTE / self.time_constant - float(np.expm1(-self.reference / self.time_constant))
        reference = -self.time_constant * float(np.log1p(-share))
        return replace(self, reference=reference)  # type: ignore[call-arg]

    @property
    def moment(self) -> str:
        """Where it is none, and how it goes on, for people."""
        straight = self.time_constant > STRAIGHT * abs(self.reference)
        on = "straight on" if straight else f"with a time constant of {self.time_constant:.4g} s"
        return f"{self.reference:.4g} s after a recording begins, {on}"


@dataclass(frozen=True)
class DriftEffect(JointEffect, DriftInTime):
    """Columns of a joint, as `local_columns` gives them, times a change in time.

    Attributes:
        joint: joint at which it acts.
        time_constant: of the drift [s].
        reference: time at which it is none [s].
    """

    time_constant: float = 1e4
    reference: float = 0.0

    shapes: ClassVar[tuple[Shape, ...]] = (Shape("time_constant", "s", 20.0, 1e4, points=4),)

    def steady(self, state: State) -> Contribution:
        """Columns for a change of one."""
        return JointEffect.evaluate(self, state)

    def evaluate(self, state: State) -> Contribution:
        """Columns times the drift."""
        rows = self.steady(state)
        change = self.change(state.motion.time, None)[:, None, None]
        return Contribution(rows.link * change, rows.motor * change, rows.joint)

    def present_columns(self, state: SimulationState) -> FloatArray:
        """Columns times the drift."""
        return super().present_columns(state) * self.change(np.array(state.time), None)
