"""A link encoder whose readings come late."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy.signal import lfilter

from sea_ident._typing import FloatArray
from sea_ident.effects.base import Shape
from sea_ident.effects.signal import DelayEffect, ahead, is_closed, rate_of, with_joint
from sea_ident.motion import Motion
from sea_ident.robot import Robot

LAG = Shape("lag", "s", 0.0, 0.1, logarithmic=False)
"""How far delays may spread."""


@dataclass(frozen=True)
class PositionDelay(DelayEffect):
    """The link encoder shows q(t - delay); at a rigid joint the only encoder does.

    Readings that were filtered are late by more than one time: what comes through a filter of first order with a time
    constant, and is late by the rest of the delay, stands for any filter whose delays spread as far.

    Attributes:
        joint: joint at which it acts, None where it does at all of them.
        delay: mean of the delays [s].
        lag: standard deviation of the delays, the time constant of that filter [s].
    """

    delay: float = 0.0
    lag: float = 0.0

    name: ClassVar[str] = "position_delay"
    source: ClassVar[str] = "Swevers, Verdonck, De Schutter, Dynamic model identification for industrial robots, 2007"
    amounts: ClassVar[tuple[Shape, ...]] = (Shape("delay", "s", -0.1, 0.1, logarithmic=False),)

    @property
    def ranges(self) -> tuple[Shape, ...]:
        """The delay, and how far delays spread where they do."""
        return (*self.amounts, LAG) if self.lag > 0.0 else self.amounts

    def corrected(self, robot: Robot, motion: Motion) -> Motion:
        """Q as it was at the time."""
        for i in self.indices(robot):
            shown = np.stack([motion.q[:, i], motion.dq[:, i], motion.ddq[:, i]], axis=1)
            if self.lag > 0.0:
                rates = np.column_stack([shown[:, 1:], rate_of(motion.time, shown[:, 2])])
                shown = shown + self.lag * rates
            q, dq, ddq = ahead(motion.time, shown, self.delay - self.lag).T
            motion = with_joint(robot, motion, i, q, dq, ddq)
        return motion

    def measured(self, robot: Robot, time: FloatArray, signals: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
        """Q late."""
        out = {kind: values.copy() if kind in ("q", "theta") else values for kind, values in signals.items()}
        for i in self.indices(robot):
            for kind in ("q",) if robot.joints[i].elastic else ("q", "theta"):
                if kind in signals:
                    late = _filtered(time, signals[kind][:, i], self.lag)
                    out[kind][:, i] = ahead(time, late, self.lag - self.delay)
        return out


def _filtered(time: FloatArray, values: FloatArray, lag: float) -> FloatArray:
    """What comes through a filter of first order with a time constant: of a closed period as if it went on and on."""
    if lag == 0.0:
        return values
    step = float(time[-1] - time[0]) / (len(time) - 1)
    if is_closed(values):
        turns = 2j * np.pi * np.fft.rfftfreq(len(time), step)
        return np.asarray(np.fft.irfft(np.fft.rfft(values) / (1.0 + lag * turns), n=len(time)), dtype=np.float64)
    # a line from sample to sample through the filter, exactly
    stays = float(np.exp(-step / lag))
    before, now = lag / step * (1.0 - stays) - stays, 1.0 - lag / step * (1.0 - stays)
    late, _ = lfilter([now, before], [1.0, -stays], values, zi=[(1.0 - now) * values[0]])
    return np.asarray(late, dtype=np.float64)
