"""A wrong zero of the link encoder."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

from sea_ident._typing import FloatArray
from sea_ident.effects.base import Shape
from sea_ident.effects.signal import SignalEffect, with_joint
from sea_ident.motion import Motion
from sea_ident.robot import Robot


@dataclass(frozen=True)
class EncoderOffset(SignalEffect):
    """The link encoder shows q + offset; at a rigid joint the only encoder does.

    Attributes:
        joint: joint at which it acts.
        offset: [rad] or [m].
    """

    offset: float = 0.0

    name: ClassVar[str] = "encoder_offset"
    source: ClassVar[str] = "Hollerbach, Khalil, Gautier, Model identification, Springer Handbook of Robotics, 2008"
    amounts: ClassVar[tuple[Shape, ...]] = (Shape("offset", "rad", -0.5, 0.5, logarithmic=False),)

    def beginnings(self) -> tuple["EncoderOffset", ...]:
        """To either side: a stiffening spring bends the derivative at zero."""
        return tuple(replace(self, offset=offset) for offset in (-0.01, 0.01))

    def corrected(self, robot: Robot, motion: Motion) -> Motion:
        """Q without the offset."""
        i = self.required_index(robot)
        return with_joint(robot, motion, i, motion.q[:, i] - self.offset, motion.dq[:, i], motion.ddq[:, i])

    def measured(self, robot: Robot, time: FloatArray, signals: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
        """Q with the offset."""
        i = self.required_index(robot)
        out = dict(signals)
        for kind in ("q",) if robot.joints[i].elastic else ("q", "theta"):
            if kind in signals:
                out[kind] = signals[kind].copy()
                out[kind][:, i] += self.offset
        return out
