"""An encoder that reads in proportion too much: what a wrong number of counts or gear ratio does, by no name.

The nearest in the library is an error once per turn, of which a motion over a part of a turn sees little but a straight
line. So what was found in the encoder of a joint, or as a wave or spring along its path, is held against a scale where
it leaves something.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from sea_ident._typing import FloatArray
from sea_ident.effects import Effect, Shape
from sea_ident.effects.parallel_spring import ParallelSpring
from sea_ident.effects.signal import SignalEffect, with_joint
from sea_ident.effects.torque_ripple import TorqueRipple
from sea_ident.motion import Motion
from sea_ident.robot import Robot


@dataclass(frozen=True)
class ScaledEncoder(SignalEffect):
    """The link encoder shows (1 + s) q, or that of the motor (1 + s) theta.

    Attributes:
        joint: joint at which it acts; at a rigid joint the two are one.
        scale: s [-].
        of_motor: whether it is the encoder of the motor.
    """

    scale: float = 0.0
    of_motor: bool = False

    name: ClassVar[str] = "scaled_encoder"
    source: ClassVar[str] = "Hollerbach, Khalil, Gautier, Model identification, Springer Handbook of Robotics, 2008"
    amounts: ClassVar[tuple[Shape, ...]] = (Shape("scale", "-", -0.2, 0.2, logarithmic=False),)

    @classmethod
    def instances(cls, robot: Robot) -> tuple["ScaledEncoder", ...]:
        """None of itself: it has no name in the library."""
        return ()

    def corrected(self, robot: Robot, motion: Motion) -> Motion:
        """Position, velocity and acceleration as they were."""
        i, factor = self.required_index(robot), 1.0 / (1.0 + self.scale)
        if self.of_motor:
            theta, dtheta, ddtheta = (getattr(motion, kind).copy() for kind in ("theta", "dtheta", "ddtheta"))
            for values in (theta, dtheta, ddtheta):
                values[:, i] *= factor
            return Motion(motion.time, motion.q, motion.dq, motion.ddq, theta, dtheta, ddtheta)
        return with_joint(
            robot, motion, i, factor * motion.q[:, i], factor * motion.dq[:, i], factor * motion.ddq[:, i]
        )

    def measured(self, robot: Robot, time: FloatArray, signals: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
        """The position as it is shown."""
        i = self.required_index(robot)
        shown = ("theta",) if self.of_motor else ("q",) if robot.joints[i].elastic else ("q", "theta")
        out = dict(signals)
        for kind in shown:
            if kind in signals:
                out[kind] = signals[kind].copy()
                out[kind][:, i] *= 1.0 + self.scale
        return out

    @property
    def in_words(self) -> str:
        """What it does."""
        whose = "motor" if self.of_motor else "link"
        return (
            f"in proportion to the position, as a wrong gear ratio or number of counts of the {whose} encoder makes it "
            f"({1.0 + self.scale:.5g} times)"
        )


def scaled_encoders(robot: Robot, own: Effect) -> tuple[ScaledEncoder, ...]:
    """The scales that an effect may stand for: those of its joint.

    Args:
        robot: the robot.
        own: what was found.
    """
    if own.joint is None or not isinstance(own, SignalEffect | TorqueRipple | ParallelSpring):
        return ()
    if not robot.joints[robot.index(own.joint)].elastic:
        return (ScaledEncoder(own.joint),)
    return tuple(ScaledEncoder(own.joint, of_motor=side) for side in (False, True))
