"""Torque that repeats with every turn: cogging, gear teeth, wave generators."""

from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects.base import Column, JointEffect, Shape, titled
from sea_ident.effects.orders import LEAST, least_order, orders
from sea_ident.effects.state import Side, State
from sea_ident.exceptions import EffectError
from sea_ident.robot import Robot

MOST = 3
"""Ripples at one joint: a gear with a wave generator, or a motor whose cogging is no pure sine, has more than one."""


@dataclass(frozen=True)
class TorqueRipple(JointEffect):
    """A sin(n theta) + b cos(n theta) at the motor; several of different orders can stand side by side.

    Attributes:
        joint: joint at which it acts.
        order: n, periods per turn of the joint (of the motor: times the gear ratio) [-].
        number: which one of those at the joint it is, from 1 on; it makes the names of its parameters unique.
        least: lowest order that counts as one [-].
    """

    order: float = 1.0
    number: int = 1
    least: float = LEAST

    name: ClassVar[str] = "torque_ripple"
    side: ClassVar[Side] = Side.MOTOR
    source: ClassVar[str] = "Ghorbel, Gandhi, Alpeter, On the kinematic error in harmonic drive gears, 2001"
    shapes: ClassVar[tuple[Shape, ...]] = (Shape("order", "1/rad", LEAST, 1e5),)
    depends_on: ClassVar[tuple[str, ...]] = ("theta",)

    def __post_init__(self) -> None:
        """Refuse a number that is none."""
        if isinstance(self.number, bool) or not isinstance(self.number, int) or self.number < 1:
            raise EffectError(f"effect {self.name!r} at {self.joint!r}: number = {self.number!r} is not 1, 2, 3, ...")

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """Sine and cosine."""
        torque, _ = self.units_of(robot)
        return tuple(
            Column(self.parameter_name(label), torque, self.name, self.joint, self.side) for label in ("sine", "cosine")
        )

    def local_columns(self, q: FloatArray, dq: FloatArray, theta: FloatArray, dtheta: FloatArray) -> FloatArray:
        """Sine and cosine of n theta."""
        angle = self.order * theta
        columns = np.empty((len(angle), 2))
        np.sin(angle, out=columns[:, 0])
        np.cos(angle, out=columns[:, 1])
        return columns

    def variants(self, state: State) -> tuple[Self, ...]:
        """All orders that this motion tells apart, up to those too fast for its samples."""
        own = self.on(state)
        return tuple(replace(own, order=order) for order in orders(state, self.required_joint, 300))

    @property
    def ranges(self) -> tuple[Shape, ...]:
        """From the lowest order that counts as one on the motion."""
        return tuple(replace(order, lower=self.least) for order in self.shapes)

    def on(self, state: State) -> Self:
        """With the lowest order that counts as one: less is a straight line over the way of a slide."""
        return replace(self, least=least_order(state, self.required_joint))

    def beside(self) -> Self | None:
        """The next one, of another order."""
        return replace(self, number=self.number + 1) if self.number < MOST else None

    def parameter_name(self, label: str | None = None) -> str:
        """With its number from the second one on."""
        name = super().parameter_name(label)
        return name if self.number == 1 else f"{name}_{self.number}"

    @property
    def title(self) -> str:
        """With its number from the second one on."""
        return titled(self.name if self.number == 1 else f"{self.name} {self.number}", self.joint)
