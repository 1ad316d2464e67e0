"""A link encoder whose readings come late."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects.base import Shape
from sea_ident.effects.signal import SignalEffect, ahead, with_joint
from sea_ident.motion import Motion
from sea_ident.robot import Robot


@dataclass(frozen=True)
class PositionDelay(SignalEffect):
    """The link encoder shows q(t - delay); at a rigid joint the only encoder does.

    Attributes:
        joint: joint at which it acts.
        delay: [s].
    """

    delay: float = 0.0

    name: ClassVar[str] = "position_delay"
    source: ClassVar[str] = "Swevers, Verdonck, De Schutter, Dynamic model identification for industrial robots, 2007"
    amounts: ClassVar[tuple[Shape, ...]] = (Shape("delay", "s", -0.1, 0.1, logarithmic=False),)

    def corrected(self, robot: Robot, motion: Motion) -> Motion:
        """Q as it was at the time."""
        i = self.required_index(robot)
        shown = np.stack([motion.q[:, i], motion.dq[:, i], motion.ddq[:, i]], axis=1)
        q, dq, ddq = ahead(motion.time, shown, self.delay).T
        return with_joint(robot, motion, i, q, dq, ddq)

    def measured(self, robot: Robot, time: FloatArray, signals: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
        """Q late."""
        i = self.required_index(robot)
        out = dict(signals)
        for kind in ("q",) if robot.joints[i].elastic else ("q", "theta"):
            if kind in signals:
                out[kind] = signals[kind].copy()
                out[kind][:, i] = ahead(time, signals[kind][:, i], -self.delay)
        return out
