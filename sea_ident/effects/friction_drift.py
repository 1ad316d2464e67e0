"""Friction that changes in the course of the recording, as grease warms."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects.base import Anchor, Column, Effect, Shape, smooth_sign
from sea_ident.effects.drift import DriftEffect, friction_throughout
from sea_ident.effects.state import Side
from sea_ident.robot import Robot


@dataclass(frozen=True)
class FrictionDrift(DriftEffect):
    """Viscous and Coulomb friction of the motor, times the drift.

    Attributes:
        joint: joint at which it acts.
        time_constant: of the drift [s].
        reference: time at which it is none [s].
        smoothing: speed around which the sign is smoothed [rad/s] or [m/s].
    """

    smoothing: float = 0.01

    name: ClassVar[str] = "friction_drift"
    side: ClassVar[Side] = Side.MOTOR
    source: ClassVar[str] = "Bittencourt, Gunnarsson, Static friction in a robot joint, ASME J. Dyn. Sys. 134, 2012"
    shapes: ClassVar[tuple[Shape, ...]] = DriftEffect.shapes

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """Initial rates of the viscous and of the Coulomb friction."""
        torque, position = self.units_of(robot)
        units = (f"{torque} s/{position}/min", f"{torque}/min")
        return tuple(
            Column(self.parameter_name(label), unit, self.name, self.joint, self.side)
            for label, unit in zip(("viscous", "coulomb"), units, strict=True)
        )

    def local_columns(self, q: FloatArray, dq: FloatArray, theta: FloatArray, dtheta: FloatArray) -> FloatArray:
        """Theta' and its sign."""
        return np.stack([dtheta, smooth_sign(dtheta, self.smoothing)], axis=1)

    def throughout(self, values: FloatArray, change: float) -> tuple[tuple[Effect, FloatArray], ...]:
        """So much more friction."""
        return friction_throughout(self.required_joint, self.smoothing, change * values)

    def anchored(self, anchor: Anchor) -> "FrictionDrift":
        """With the smoothing of the model's Coulomb friction."""
        return replace(self, smoothing=anchor.smoothing(str(self.joint)) or self.smoothing)
