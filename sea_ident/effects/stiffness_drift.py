"""A spring whose stiffness changes in the course of the recording."""

from dataclasses import dataclass
from typing import ClassVar

from sea_ident._typing import FloatArray
from sea_ident.effects.base import Column, Effect, Shape
from sea_ident.effects.drift import DriftEffect
from sea_ident.effects.spring_stiffness import SpringStiffness
from sea_ident.effects.state import Side
from sea_ident.robot import Robot


@dataclass(frozen=True)
class StiffnessDrift(DriftEffect):
    """Theta - q in the spring, times the drift.

    Attributes:
        joint: joint at which it acts.
        time_constant: of the drift [s].
        reference: time at which it is none [s].
    """

    name: ClassVar[str] = "stiffness_drift"
    side: ClassVar[Side] = Side.SPRING
    source: ClassVar[str] = (
        "Flacco, De Luca, Residual-based stiffness estimation in robots with flexible transmissions, 2011"
    )
    shapes: ClassVar[tuple[Shape, ...]] = DriftEffect.shapes
    depends_on: ClassVar[tuple[str, ...]] = ("q", "theta")

    @classmethod
    def instances(cls, robot: Robot) -> tuple[Effect, ...]:
        """At every elastic joint."""
        return tuple(cls(joint=joint.name) for joint in robot.joints if joint.elastic)

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """Initial rate of the stiffness."""
        torque, position = self.units_of(robot)
        return (Column(self.parameter_name(), f"{torque}/{position}/min", self.name, self.joint, self.side),)

    def local_columns(self, q: FloatArray, dq: FloatArray, theta: FloatArray, dtheta: FloatArray) -> FloatArray:
        """Theta - q."""
        return (theta - q)[:, None]

    def throughout(self, values: FloatArray, change: float) -> tuple[tuple[Effect, FloatArray], ...]:
        """A spring that is so much stiffer."""
        return ((SpringStiffness(self.required_joint), change * values),)
