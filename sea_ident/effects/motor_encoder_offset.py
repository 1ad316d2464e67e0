"""A wrong zero of the motor encoder."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from sea_ident.effects.base import Shape
from sea_ident.effects.offset import Offset
from sea_ident.exceptions import EffectError
from sea_ident.robot import Robot

LARGEST = float(np.pi)
"""An encoder that counts from where it was switched on is off by as much as the joint may turn [rad]."""


@dataclass(frozen=True)
class MotorEncoderOffset(Offset):
    """The motor encoder shows theta + offset, of a joint with a spring.

    A spring is bent by as much more. To a linear one that is a constant torque, `spring_offset`, which stands for a
    small offset; a spring of another law bends about its own zero.
    """

    name: ClassVar[str] = "motor_encoder_offset"
    source: ClassVar[str] = "HEBI Robotics, X-series documentation, spring zero"
    amounts: ClassVar[tuple[Shape, ...]] = (Shape("offset", "rad", -LARGEST, LARGEST, logarithmic=False),)

    @classmethod
    def instances(cls, robot: Robot) -> tuple["MotorEncoderOffset", ...]:
        """At every joint with a spring."""
        return tuple(cls(joint=joint.name) for joint in robot.joints if joint.elastic)

    def required_index(self, robot: Robot) -> int:
        """Index of its joint.

        Raises:
            EffectError: if none was given, or it has no spring.
        """
        i = super().required_index(robot)
        if not robot.joints[i].elastic:
            raise EffectError(f"{self.name} at {self.joint!r}: the joint is rigid and has one zero, encoder_offset")
        return i

    def shown(self, robot: Robot) -> tuple[str, ...]:
        """Theta."""
        return ("theta",)
