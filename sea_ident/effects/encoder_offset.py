"""A wrong zero of the link encoder."""

from dataclasses import dataclass, replace
from typing import ClassVar

from sea_ident.effects.base import Shape
from sea_ident.effects.offset import TurnedOffset
from sea_ident.robot import Robot


@dataclass(frozen=True)
class EncoderOffset(TurnedOffset):
    """The link encoder shows q + offset; at a rigid joint the only encoder does."""

    name: ClassVar[str] = "encoder_offset"
    source: ClassVar[str] = "Hollerbach, Khalil, Gautier, Model identification, Springer Handbook of Robotics, 2008"
    amounts: ClassVar[tuple[Shape, ...]] = (Shape("offset", "rad", -0.5, 0.5, logarithmic=False),)

    def beginnings(self) -> tuple["EncoderOffset", ...]:
        """To either side too, for a stiffening spring bends the derivative at zero."""
        return (*(replace(self, offset=offset) for offset in (-0.01, 0.01)), *super().beginnings())

    def shown(self, robot: Robot) -> tuple[str, ...]:
        """Q; at a rigid joint theta is the same."""
        return ("q",) if robot.joints[self.required_index(robot)].elastic else ("q", "theta")
