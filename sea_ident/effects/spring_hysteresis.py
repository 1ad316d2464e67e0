"""Dry friction inside the spring: loading and unloading take two ways."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects.base import Column, Shape
from sea_ident.effects.memory import OneWayEffect
from sea_ident.effects.spring import deflections
from sea_ident.effects.state import Side, State
from sea_ident.robot import Robot

WIDER = 3.0
"""How many times farther the second element bends before it slips."""


@dataclass(frozen=True)
class SpringHysteresis(OneWayEffect):
    """c_1 z_1 + c_2 z_2 in the spring: two Maxwell-slip elements that slip at w and at 3 w.

    An element is a spring in series with dry friction; z goes from -1 to 1.

    Attributes:
        joint: joint at which it acts.
        slip: w, deflection at which the first element slips [rad] or [m].
        elements: 1 without the second element, where that sticks all the time: then it is a part of the elastic law and
            a constant, and cannot be told from a constant that is there.
    """

    slip: float = 0.005
    elements: int = 2

    name: ClassVar[str] = "spring_hysteresis"
    side: ClassVar[Side] = Side.SPRING
    source: ClassVar[str] = "Iwan, A distributed-element model for hysteresis, J. Applied Mechanics 33, 1966"
    shapes: ClassVar[tuple[Shape, ...]] = (Shape("slip", "rad", 1e-5, 0.5),)
    memory_size: ClassVar[int] = 2
    depends_on: ClassVar[tuple[str, ...]] = ("q", "theta")

    @classmethod
    def instances(cls, robot: Robot) -> tuple["SpringHysteresis", ...]:
        """At every elastic joint."""
        return tuple(cls(joint=joint.name) for joint in robot.joints if joint.elastic)

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """One column per element: the torque at which it slips."""
        torque, _ = self.units_of(robot)
        return tuple(
            Column(self.parameter_name(label), torque, self.name, self.joint, self.side, True)
            for label in ("narrow", "wide")[: self.elements]
        )

    def variants(self, state: State) -> tuple["SpringHysteresis", ...]:
        """Widths within the deflections of this motion."""
        return tuple(replace(self, slip=width) for width in deflections(state, self.required_joint, 40))

    def beginnings(self) -> tuple["SpringHysteresis", ...]:
        """The first element may have been put where the second one is."""
        return (replace(self, slip=self.slip / WIDER),)

    @property
    def slips(self) -> FloatArray:
        """(k,) deflection at which each element slips [rad] or [m]."""
        return self._both[: self.elements]

    @property
    def _both(self) -> FloatArray:
        return self.slip * np.array([1.0, WIDER])

    def path(self, q: FloatArray, theta: FloatArray) -> FloatArray:
        """Theta - q."""
        return theta - q

    def advance(self, memory: tuple[float, ...], distance: float) -> tuple[float, ...]:
        """Both elements stick until they slip."""
        step = distance / self.slip
        narrow, wide = memory[0] + step, memory[1] + step / WIDER
        return (
            1.0 if narrow > 1.0 else -1.0 if narrow < -1.0 else narrow,
            1.0 if wide > 1.0 else -1.0 if wide < -1.0 else wide,
        )

    def advance_all(self, memory: FloatArray, distances: FloatArray) -> FloatArray:
        """Both elements stick until they slip."""
        return np.clip(memory + distances[:, None] / self._both, -1.0, 1.0)

    def remembered_columns(self, memory: FloatArray, dtheta: FloatArray) -> FloatArray:
        """z_1, z_2."""
        return memory[:, : self.elements]
