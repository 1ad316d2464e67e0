"""Friction proportional to the speed of the motor."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects.base import Column, JointEffect
from sea_ident.effects.state import Side
from sea_ident.robot import Robot


@dataclass(frozen=True)
class ViscousFriction(JointEffect):
    """c theta' at the motor (at a rigid joint: at the joint)."""

    name: ClassVar[str] = "viscous_friction"
    side: ClassVar[Side] = Side.MOTOR
    source: ClassVar[str] = "Vantilt et al., ICRA 2015, eq. 3"

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """One column."""
        torque, position = self.units_of(robot)
        return (Column(self.parameter_name(), f"{torque} s/{position}", self.name, self.joint, self.side, True),)

    def local_columns(self, q: FloatArray, dq: FloatArray, theta: FloatArray, dtheta: FloatArray) -> FloatArray:
        """Theta'."""
        return dtheta[:, None]

    def prior(self, robot: Robot) -> FloatArray:
        """The annotation's value; at a rigid joint the URDF's damping adds to it."""
        joint = robot.joints[robot.index(self.required_joint)]
        values = [joint.actuator.viscous_friction] if joint.actuator is not None else []
        if not joint.elastic:
            values.append(joint.damping)
        known = [value for value in values if value is not None]
        return np.array([sum(known) if known else np.nan])
