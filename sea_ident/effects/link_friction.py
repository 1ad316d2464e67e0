"""Friction of the link side of an elastic joint: in its bearing, its cables, its seals."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects.base import Column, Effect, JointEffect, Shape, smooth_sign
from sea_ident.effects.state import Side
from sea_ident.robot import Robot


@dataclass(frozen=True)
class LinkFriction(JointEffect):
    """Viscous c q' and Coulomb c tanh(q' / v_off) at the link.

    Attributes:
        joint: joint at which it acts.
        smoothing: v_off [rad/s] or [m/s].
    """

    smoothing: float = 0.01

    name: ClassVar[str] = "link_friction"
    side: ClassVar[Side] = Side.LINK
    source: ClassVar[str] = "Vantilt et al., ICRA 2015, eqs. 1, 3"
    shapes: ClassVar[tuple[Shape, ...]] = (Shape("smoothing", "rad/s", 1e-4, 0.3),)

    @classmethod
    def instances(cls, robot: Robot) -> tuple[Effect, ...]:
        """At every elastic joint: elsewhere it is the friction of the motor."""
        return tuple(cls(joint=joint.name) for joint in robot.joints if joint.elastic)

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """Viscous, then Coulomb."""
        torque, position = self.units_of(robot)
        viscous, coulomb = self.parameter_name("viscous"), self.parameter_name("coulomb")
        return (
            Column(viscous, f"{torque} s/{position}", self.name, self.joint, self.side, True),
            Column(coulomb, torque, self.name, self.joint, self.side, True),
        )

    def local_columns(self, q: FloatArray, dq: FloatArray, theta: FloatArray, dtheta: FloatArray) -> FloatArray:
        """Q' and tanh(q' / v_off)."""
        return np.stack([dq, smooth_sign(dq, self.smoothing)], axis=1)

    def prior(self, robot: Robot) -> FloatArray:
        """The URDF's damping and friction."""
        joint = robot.joints[robot.index(self.required_joint)]
        values = (joint.damping, joint.friction)
        return np.array([np.nan if value is None else value for value in values])

    def is_described(self, robot: Robot) -> bool:
        """Whether the URDF gives any."""
        return bool(np.any(np.nan_to_num(self.prior(robot))))


def left_out(robot: Robot, effects: Sequence[Effect]) -> tuple[LinkFriction, ...]:
    """Friction of links that the description of a robot gives and a model does not have."""
    modelled = {effect.joint for effect in effects if isinstance(effect, LinkFriction)}
    every = (LinkFriction(joint=joint.name) for joint in robot.joints if joint.elastic)
    return tuple(one for one in every if one.joint not in modelled and one.is_described(robot))
