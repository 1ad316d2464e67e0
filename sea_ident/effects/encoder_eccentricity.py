"""An encoder disc off its centre: an error once per turn."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects.base import Shape
from sea_ident.effects.signal import SignalEffect, with_joint
from sea_ident.motion import Motion
from sea_ident.robot import Robot

NEWTON_STEPS = 8
"""Largest number of steps to the angle that is shown as it is; two of them find a usual error."""

EXACT = 1e-8
"""Step after which the next one, the square of it at most, is below the last digit [rad]."""


@dataclass(frozen=True)
class EncoderEccentricity(SignalEffect):
    """The link encoder shows q + a sin q + b cos q.

    Attributes:
        joint: joint at which it acts.
        sine: a [rad].
        cosine: b [rad].
    """

    sine: float = 0.0
    cosine: float = 0.0

    name: ClassVar[str] = "encoder_eccentricity"
    source: ClassVar[str] = "Hollerbach, Khalil, Gautier, Model identification, Springer Handbook of Robotics, 2008"
    amounts: ClassVar[tuple[Shape, ...]] = (
        Shape("sine", "rad", -0.2, 0.2, logarithmic=False),
        Shape("cosine", "rad", -0.2, 0.2, logarithmic=False),
    )

    @classmethod
    def instances(cls, robot: Robot) -> tuple["EncoderEccentricity", ...]:
        """At every joint that turns."""
        return tuple(cls(joint=joint.name) for joint in robot.joints if not joint.prismatic)

    def corrected(self, robot: Robot, motion: Motion) -> Motion:
        """Q without the error, and its derivatives, by Newton's method."""
        i = self.required_index(robot)
        shown, shown_rate, shown_acceleration = motion.q[:, i], motion.dq[:, i], motion.ddq[:, i]
        q, error, slope = shown, *self._shown(shown)
        for _ in range(NEWTON_STEPS):
            step = (q + error - shown) / slope
            q = q - step
            error, slope = self._shown(q)
            if np.max(np.abs(step), initial=0.0) < EXACT:  # the next one would be below the last digit
                break
        dq = shown_rate / slope
        return with_joint(robot, motion, i, q, dq, (shown_acceleration + error * dq**2) / slope)

    def _shown(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(N,) error of the encoder at q, and (N,) slope of what it shows over q."""
        sine, cosine = np.sin(q), np.cos(q)
        return self.sine * sine + self.cosine * cosine, 1.0 + self.sine * cosine - self.cosine * sine

    def measured(self, robot: Robot, time: FloatArray, signals: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
        """Q with the error."""
        i = self.required_index(robot)
        out = dict(signals)
        for kind in ("q",) if robot.joints[i].elastic else ("q", "theta"):
            if kind in signals:
                q = signals[kind][:, i]
                out[kind] = signals[kind].copy()
                out[kind][:, i] = q + self.sine * np.sin(q) + self.cosine * np.cos(q)
        return out
