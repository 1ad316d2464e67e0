"""Wrong zeros: what encoders show of an angle, and an offset."""

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects.base import Shape
from sea_ident.effects.signal import SignalEffect
from sea_ident.motion import Motion
from sea_ident.robot import Robot

TURNED = (0.5 * np.pi, -0.5 * np.pi, np.pi)
"""By so much conventions differ [rad]."""

WIDEST = 4.0
"""Half a turn and some more: half a turn is no end of a range [rad]."""


@dataclass(frozen=True)
class Offset(SignalEffect):
    """Encoders of a joint show its position and an offset.

    Attributes:
        joint: joint at which it acts.
        offset: [rad] or [m].
    """

    offset: float = 0.0

    @abstractmethod
    def shown(self, robot: Robot) -> tuple[str, ...]:
        """Signals that it is in, of q and theta."""

    def corrected(self, robot: Robot, motion: Motion) -> Motion:
        """Positions without the offset."""
        moved = self._moved(robot, {kind: getattr(motion, kind) for kind in self.shown(robot)}, -self.offset)
        return replace(motion, **moved)

    def measured(self, robot: Robot, time: FloatArray, signals: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
        """Positions with the offset."""
        seen = {kind: signals[kind] for kind in self.shown(robot) if kind in signals}
        return {**signals, **self._moved(robot, seen, self.offset)}

    def _moved(self, robot: Robot, signals: Mapping[str, FloatArray], by: float) -> dict[str, FloatArray]:
        i, out = self.required_index(robot), {kind: values.copy() for kind, values in signals.items()}
        for values in out.values():
            values[:, i] += by
        return out


@dataclass(frozen=True)
class TurnedOffset(Offset):
    """A zero that may be another posture: it is looked for within the range of its kind, and about right angles."""

    @property
    def ranges(self) -> tuple[Shape, ...]:
        """Any angle where it is beyond the range of its kind."""
        (usual,) = self.amounts
        if usual.lower <= self.offset <= usual.upper:
            return self.amounts
        return (replace(usual, lower=-WIDEST, upper=WIDEST),)

    def beginnings(self) -> tuple[Self, ...]:
        """Turned."""
        return tuple(replace(self, offset=float(offset)) for offset in TURNED)
