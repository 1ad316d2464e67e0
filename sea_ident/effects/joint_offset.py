"""A joint whose zero is not that of the description."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

from sea_ident._typing import FloatArray
from sea_ident.effects.base import Shape
from sea_ident.effects.signal import SignalEffect
from sea_ident.motion import Motion
from sea_ident.robot import Robot

LARGEST = 1.5
"""Conventions differ by a right angle, which is seen at once; what is looked for is less [rad]."""


@dataclass(frozen=True)
class JointOffset(SignalEffect):
    """Both encoders of a joint with a spring show its angle + offset.

    What lies behind the joint is turned. The bodies of the last joint are turned with it and are free; what the first
    one does is done by `base_tilt`, for it turns gravity and nothing else.

    Attributes:
        joint: joint at which it acts.
        offset: [rad] or [m].
    """

    offset: float = 0.0

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

    def corrected(self, robot: Robot, motion: Motion) -> Motion:
        """Both positions without the offset."""
        q, theta, i = motion.q.copy(), motion.theta.copy(), self.required_index(robot)
        q[:, i] -= self.offset
        theta[:, i] -= self.offset
        return replace(motion, q=q, theta=theta)

    def measured(self, robot: Robot, time: FloatArray, signals: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
        """Both positions with the offset."""
        i, out = self.required_index(robot), dict(signals)
        for kind in ("q", "theta"):
            if kind in signals:
                out[kind] = signals[kind].copy()
                out[kind][:, i] += self.offset
        return out
