"""Effects in the spring of an elastic joint."""

from typing import ClassVar, Self

from sea_ident.effects.base import JointEffect, Side
from sea_ident.robot import Robot


class SpringEffect(JointEffect):
    """An effect in series with the spring: it enters the motor row and, with the opposite sign, the link row."""

    side: ClassVar[Side] = Side.SPRING

    @classmethod
    def instances(cls, robot: Robot) -> tuple[Self, ...]:
        """At every elastic joint."""
        return tuple(cls(joint=joint.name) for joint in robot.joints if joint.elastic)
