"""Friction that varies over the turn: a bent shaft, a worn tooth."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects.base import Anchor, Column, JointEffect, Shape, smooth_sign
from sea_ident.effects.orders import LEAST, least_order, orders
from sea_ident.effects.state import Side, State
from sea_ident.robot import Robot


@dataclass(frozen=True)
class PositionDependentFriction(JointEffect):
    """sgn(theta') (a sin(n theta) + b cos(n theta)) at the motor.

    Attributes:
        joint: joint at which it acts.
        order: n, periods per turn of the joint [-].
        smoothing: speed around which the sign is smoothed [rad/s] or [m/s].
        least: lowest order that counts as one [-].
    """

    order: float = 1.0
    smoothing: float = 0.01
    least: float = LEAST

    name: ClassVar[str] = "position_dependent_friction"
    side: ClassVar[Side] = Side.MOTOR
    source: ClassVar[str] = "Armstrong-Helouvry, Control of Machines with Friction, 1991"
    shapes: ClassVar[tuple[Shape, ...]] = (Shape("order", "1/rad", LEAST, 1e5),)

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """Sine and cosine."""
        torque, _ = self.units_of(robot)
        return tuple(
            Column(self.parameter_name(label), torque, self.name, self.joint, self.side) for label in ("sine", "cosine")
        )

    def local_columns(self, q: FloatArray, dq: FloatArray, theta: FloatArray, dtheta: FloatArray) -> FloatArray:
        """Sine and cosine of n theta, times the sign of the velocity."""
        waves = np.stack([np.sin(self.order * theta), np.cos(self.order * theta)], axis=1)
        columns: FloatArray = smooth_sign(dtheta, self.smoothing)[:, None] * waves
        return columns

    def variants(self, state: State) -> tuple["PositionDependentFriction", ...]:
        """Low orders that this motion tells apart, and those of the gear."""
        own = self.on(state)
        return tuple(replace(own, order=order) for order in orders(state, self.required_joint, 40))

    @property
    def ranges(self) -> tuple[Shape, ...]:
        """From the lowest order that counts as one on the motion."""
        return tuple(replace(order, lower=self.least) for order in self.shapes)

    def on(self, state: State) -> "PositionDependentFriction":
        """With the lowest order that counts as one: less is a straight line over the way of a slide."""
        return replace(self, least=least_order(state, self.required_joint))

    def anchored(self, anchor: Anchor) -> "PositionDependentFriction":
        """With the smoothing of the model's Coulomb friction."""
        return replace(self, smoothing=anchor.smoothing(self.required_joint) or self.smoothing)
