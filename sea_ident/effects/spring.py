"""Effects in the spring of an elastic joint."""

from typing import ClassVar, Self

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects.base import JointEffect
from sea_ident.effects.state import Side, State
from sea_ident.robot import Robot


class SpringEffect(JointEffect):
    """An effect in series with the spring: it enters the motor row and, with the opposite sign, the link row."""

    side: ClassVar[Side] = Side.SPRING

    @classmethod
    def instances(cls, robot: Robot) -> tuple[Self, ...]:
        """At every elastic joint."""
        return tuple(cls(joint=joint.name) for joint in robot.joints if joint.elastic)


def stated(value: float | None) -> FloatArray:
    """(1,) prior of one parameter: not a number where the robot's description does not state it."""
    return np.array([np.nan if value is None else value])


def deflections(state: State, joint: str, points: int) -> tuple[float, ...]:
    """Sizes of the deflection of a joint that a search should try, from a small one to the largest of the motion."""
    size = np.abs(state.motion.deflection[:, state.robot.index(joint)])
    largest = max(float(size.max()), 1e-9)
    even = np.quantile(size, np.linspace(0.03, 0.97, points - 3))
    small = largest * np.array([0.01, 0.03, 0.1])
    return tuple(float(v) for v in np.unique(np.concatenate([small, even])) if v > 0.0)
