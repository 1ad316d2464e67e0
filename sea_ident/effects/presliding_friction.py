"""Friction that builds up over a distance: the contact bends before it slides."""

from dataclasses import dataclass, replace
from math import exp
from typing import ClassVar

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects.base import Anchor, Column, Shape, smooth_sign
from sea_ident.effects.memory import OneWayEffect
from sea_ident.effects.state import Side
from sea_ident.robot import Robot


@dataclass(frozen=True)
class PreslidingFriction(OneWayEffect):
    """c (z - sgn(theta')) at the motor: c sgn(theta') of the Coulomb friction becomes c z where c is the same.

    z follows Dahl's law dz/dtheta = (1 - z sgn(theta')) / x_s and takes the place of the sign after a reversal.

    Attributes:
        joint: joint at which it acts.
        displacement: x_s, distance over which it builds up [rad] or [m].
        smoothing: speed around which the sign is smoothed [rad/s] or [m/s].
    """

    displacement: float = 0.005
    smoothing: float = 0.01

    name: ClassVar[str] = "presliding_friction"
    side: ClassVar[Side] = Side.MOTOR
    source: ClassVar[str] = "Dahl, A solid friction model, Aerospace Corp., 1968"
    shapes: ClassVar[tuple[Shape, ...]] = (Shape("displacement", "rad", 1e-6, 0.2, points=11),)

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """One column."""
        torque, _ = self.units_of(robot)
        return (Column(self.parameter_name(), torque, self.name, self.joint, self.side, True),)

    def path(self, q: FloatArray, theta: FloatArray) -> FloatArray:
        """Theta."""
        return theta

    def advance(self, memory: tuple[float, ...], distance: float) -> tuple[float, ...]:
        """Dahl's law, exact over the distance."""
        if distance > 0.0:
            return (1.0 + (memory[0] - 1.0) * exp(-distance / self.displacement),)
        return (-1.0 + (memory[0] + 1.0) * exp(distance / self.displacement),)

    def advance_all(self, memory: FloatArray, distances: FloatArray) -> FloatArray:
        """Dahl's law, exact over the distances."""
        end = np.where(distances > 0.0, 1.0, -1.0)[:, None]
        return np.asarray(end + (memory - end) * np.exp(-np.abs(distances) / self.displacement)[:, None])

    def remembered_columns(self, memory: FloatArray, dtheta: FloatArray) -> FloatArray:
        """Z - sgn(theta')."""
        return memory - smooth_sign(dtheta, self.smoothing)[:, None]

    def anchored(self, anchor: Anchor) -> "PreslidingFriction":
        """With the smoothing of the model's Coulomb friction, in the place of which it stands."""
        return replace(self, smoothing=anchor.smoothing(self.required_joint) or self.smoothing)
