"""Friction that opposes the motion with constant size."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects.base import Column, Effect, JointEffect, Shape, smooth_sign
from sea_ident.effects.state import Side
from sea_ident.robot import Robot


@dataclass(frozen=True)
class CoulombFriction(JointEffect):
    """c tanh(theta' / v_off) at the motor (at a rigid joint: at the joint).

    Attributes:
        joint: joint at which it acts.
        smoothing: v_off [rad/s] or [m/s].
    """

    smoothing: float = 0.01

    name: ClassVar[str] = "coulomb_friction"
    side: ClassVar[Side] = Side.MOTOR
    source: ClassVar[str] = "Vantilt et al., ICRA 2015, eq. 3"
    shapes: ClassVar[tuple[Shape, ...]] = (Shape("smoothing", "rad/s", 1e-4, 0.3),)

    @classmethod
    def instances(cls, robot: Robot) -> tuple[Effect, ...]:
        """At every joint; slides move at tenths of a metre per second, so theirs turns over at 1 mm/s."""
        return tuple(cls(joint.name, 0.001) if joint.prismatic else cls(joint.name) for joint in robot.joints)

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """One column."""
        torque, _ = self.units_of(robot)
        return (Column(self.parameter_name(), torque, self.name, self.joint, self.side, True),)

    def local_columns(self, q: FloatArray, dq: FloatArray, theta: FloatArray, dtheta: FloatArray) -> FloatArray:
        """tanh(theta' / v_off)."""
        return smooth_sign(dtheta, self.smoothing)[:, None]

    def prior(self, robot: Robot) -> FloatArray:
        """The annotation's value; at a rigid joint the URDF's friction adds to it."""
        joint = robot.joints[robot.index(self.required_joint)]
        values = [joint.actuator.coulomb_friction] if joint.actuator is not None else []
        if not joint.elastic:
            values.append(joint.friction)
        known = [value for value in values if value is not None]
        return np.array([sum(known) if known else np.nan])
