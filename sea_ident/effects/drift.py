"""Effects that change in the course of a recording."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects.acting import SimulationState
from sea_ident.effects.base import JointEffect, Shape
from sea_ident.effects.state import Contribution, State

_MINUTE = 60.0


class TrendEffect(ABC):
    """An effect that is a column times a change in time.

    The time of the motion is that of the recording: the columns of one mean period show next to nothing, and the
    comparison of the periods shows it all. A search asks for the two factors separately.

    Attributes:
        mean_is_free: whether the model has parameters of its own that take up its mean over a recording, as friction
            and stiffness are; else those of others do.
    """

    mean_is_free: ClassVar[bool] = True

    @abstractmethod
    def steady(self, state: State) -> Contribution:
        """Link and motor rows (N, n, k) for a change of one."""

    @abstractmethod
    def change(self, time: FloatArray, temperature: FloatArray | None) -> FloatArray:
        """Change at the times (P,) [s], with the temperatures (P,) of its joint where they are measured [degC]."""

    def referred(self, values: FloatArray, change: float) -> FloatArray:
        """Values (k,) for columns of a time at which less has changed, by `change`: where columns drift themselves."""
        return values


def warming(time: FloatArray, time_constant: float) -> FloatArray:
    """Change at the times (any shape) [s] that starts at a rate of one per minute and ends with a time constant.

    With a time constant far longer than the recording it is linear in time.
    """
    amount: FloatArray = -time_constant * np.expm1(-time / time_constant) / _MINUTE
    return amount


@dataclass(frozen=True)
class DriftEffect(JointEffect, TrendEffect):
    """Columns of a joint, as `local_columns` gives them, times a change in time.

    Attributes:
        joint: joint at which it acts.
        time_constant: of the drift [s].
    """

    time_constant: float = 1e4

    shapes: ClassVar[tuple[Shape, ...]] = (Shape("time_constant", "s", 20.0, 1e4, points=4),)

    def steady(self, state: State) -> Contribution:
        """Columns for a change of one."""
        return JointEffect.evaluate(self, state)

    def change(self, time: FloatArray, temperature: FloatArray | None) -> FloatArray:
        """The drift."""
        return warming(time, self.time_constant)

    def evaluate(self, state: State) -> Contribution:
        """Columns times the drift."""
        rows = self.steady(state)
        change = warming(state.motion.time, self.time_constant)[:, None, None]
        return Contribution(rows.link * change, rows.motor * change, rows.joint)

    def present_columns(self, state: SimulationState) -> FloatArray:
        """Columns times the drift."""
        return super().present_columns(state) * warming(np.array(state.time), self.time_constant)
