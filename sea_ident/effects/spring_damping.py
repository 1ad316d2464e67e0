"""Damping in parallel with the spring."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects.base import Column, Effect, JointEffect, Side
from sea_ident.robot import Robot


@dataclass(frozen=True)
class SpringDamping(JointEffect):
    """D (theta' - q')."""

    name: ClassVar[str] = "spring_damping"
    side: ClassVar[Side] = Side.SPRING
    source: ClassVar[str] = "Vantilt et al., ICRA 2015, eq. 21"

    @classmethod
    def instances(cls, robot: Robot) -> tuple[Effect, ...]:
        """At every elastic joint."""
        return tuple(cls(joint=joint.name) for joint in robot.joints if joint.elastic)

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """One column."""
        torque, position = self.units_of(robot)
        return (Column(self.parameter_name(), f"{torque} s/{position}", self.name, self.joint, self.side, True),)

    def local_columns(self, q: FloatArray, dq: FloatArray, theta: FloatArray, dtheta: FloatArray) -> FloatArray:
        """Theta' - q'."""
        return (dtheta - dq)[:, None]

    def prior(self, robot: Robot) -> FloatArray:
        """The annotation's value."""
        value = robot.spring(self.required_joint).damping
        return np.array([np.nan if value is None else value])
