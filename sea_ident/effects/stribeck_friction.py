"""Friction that falls with speed: a lubricated contact that starts to float."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects.base import Anchor, Column, JointEffect, Shape, smooth_sign
from sea_ident.effects.speeds import speed_scale
from sea_ident.effects.state import Side, State
from sea_ident.robot import Robot


@dataclass(frozen=True)
class StribeckFriction(JointEffect):
    """c sgn(theta') exp(-|theta' / v_s|^a) at the motor, on top of Coulomb friction.

    Attributes:
        joint: joint at which it acts.
        speed: Stribeck speed v_s [rad/s] or [m/s].
        exponent: a [-].
        smoothing: speed around which the sign is smoothed [rad/s] or [m/s].
        scale: factor on the range of v_s that a motion of about 1 rad/s has [-].
    """

    speed: float = 0.1
    exponent: float = 2.0
    smoothing: float = 0.01
    scale: float = 1.0

    name: ClassVar[str] = "stribeck_friction"
    side: ClassVar[Side] = Side.MOTOR
    source: ClassVar[str] = "Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30(7), 1994"
    shapes: ClassVar[tuple[Shape, ...]] = (
        Shape("speed", "rad/s", 0.01, 2.0, points=8),
        Shape("exponent", "-", 0.5, 2.0, logarithmic=False, points=3),
    )

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """One column."""
        torque, _ = self.units_of(robot)
        return (Column(self.parameter_name(), torque, self.name, self.joint, self.side, True),)

    def local_columns(self, q: FloatArray, dq: FloatArray, theta: FloatArray, dtheta: FloatArray) -> FloatArray:
        """Sgn(theta') exp(-|theta' / v_s|^a)."""
        fade = np.exp(-(np.abs(dtheta / self.speed) ** self.exponent))
        return (smooth_sign(dtheta, self.smoothing) * fade)[:, None]

    @property
    def ranges(self) -> tuple[Shape, ...]:
        """With the speeds of the motion: what falls below them is not seen, and above them it is Coulomb friction."""
        speed, exponent = self.shapes
        return replace(speed, lower=self.scale * speed.lower, upper=self.scale * speed.upper), exponent

    def on(self, state: State) -> "StribeckFriction":
        """With the scale of the motor's speed."""
        return replace(self, scale=speed_scale(state, self.required_joint, state.motion.dtheta))

    def anchored(self, anchor: Anchor) -> "StribeckFriction":
        """With the smoothing of the model's Coulomb friction."""
        return replace(self, smoothing=anchor.smoothing(self.required_joint) or self.smoothing)
