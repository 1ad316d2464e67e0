"""A joint whose zero is not that of the description."""

from dataclasses import dataclass
from typing import ClassVar

from sea_ident.effects.base import Shape
from sea_ident.effects.offset import TurnedOffset
from sea_ident.robot import Robot


@dataclass(frozen=True)
class JointOffset(TurnedOffset):
    """Both encoders of a joint with a spring show its angle + offset.

    What lies behind the joint is turned. The bodies of the last joint are turned with it and are free; what the first
    one does is done by `base_tilt`, for it turns gravity and nothing else, unless another chain feels the same gravity.
    """

    name: ClassVar[str] = "joint_offset"
    source: ClassVar[str] = "Hollerbach, Khalil, Gautier, Model identification, Springer Handbook of Robotics, 2008"
    amounts: ClassVar[tuple[Shape, ...]] = (Shape("offset", "rad", -1.5, 1.5, logarithmic=False),)

    @classmethod
    def instances(cls, robot: Robot) -> tuple["JointOffset", ...]:
        """At every joint with a spring that has a joint before it, or another one beside it, and one behind it."""
        parents = robot.parents
        alone = sum(before < 0 for before in parents) == 1
        return tuple(
            cls(joint=joint.name)
            for i, joint in enumerate(robot.joints)
            if joint.elastic and i in parents and not (alone and parents[i] < 0)
        )

    def shown(self, robot: Robot) -> tuple[str, ...]:
        """Both."""
        return ("q", "theta")
