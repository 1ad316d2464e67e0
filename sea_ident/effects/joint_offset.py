"""A joint whose zero is not that of the description."""

from dataclasses import dataclass
from typing import ClassVar

from sea_ident.effects.base import Shape
from sea_ident.effects.offset import Offset
from sea_ident.robot import Robot

LARGEST = 1.5
"""Conventions differ by a right angle, which is seen at once; what is looked for is less [rad]."""


@dataclass(frozen=True)
class JointOffset(Offset):
    """Both encoders of a joint with a spring show its angle + offset.

    What lies behind the joint is turned. The bodies of the last joint are turned with it and are free; what the first
    one does is done by `base_tilt`, for it turns gravity and nothing else.
    """

    name: ClassVar[str] = "joint_offset"
    source: ClassVar[str] = "Hollerbach, Khalil, Gautier, Model identification, Springer Handbook of Robotics, 2008"
    amounts: ClassVar[tuple[Shape, ...]] = (Shape("offset", "rad", -LARGEST, LARGEST, logarithmic=False),)

    @classmethod
    def instances(cls, robot: Robot) -> tuple["JointOffset", ...]:
        """At every joint with a spring that has a joint before it and one behind it."""
        parents = robot.parents
        return tuple(
            cls(joint=joint.name)
            for i, joint in enumerate(robot.joints)
            if joint.elastic and parents[i] >= 0 and i in parents
        )

    def shown(self, robot: Robot) -> tuple[str, ...]:
        """Both."""
        return ("q", "theta")
