"""A wrong zero of the link encoder."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from sea_ident.effects.base import Shape
from sea_ident.effects.offset import Offset
from sea_ident.robot import Robot

USUAL = 0.5
"""An offset is looked for up to here, ... [rad]"""

TURNED = (0.5 * np.pi, -0.5 * np.pi, np.pi)
"""... and about these: a joint whose zero is another posture, as a convention has it [rad]."""


@dataclass(frozen=True)
class EncoderOffset(Offset):
    """The link encoder shows q + offset; at a rigid joint the only encoder does."""

    name: ClassVar[str] = "encoder_offset"
    source: ClassVar[str] = "Hollerbach, Khalil, Gautier, Model identification, Springer Handbook of Robotics, 2008"
    amounts: ClassVar[tuple[Shape, ...]] = (Shape("offset", "rad", -USUAL, USUAL, logarithmic=False),)

    @property
    def ranges(self) -> tuple[Shape, ...]:
        """Half a turn to either side where it is large."""
        if abs(self.offset) <= USUAL:
            return self.amounts
        return (Shape("offset", "rad", -float(np.pi), float(np.pi), logarithmic=False),)

    def beginnings(self) -> tuple["EncoderOffset", ...]:
        """To either side, for a stiffening spring bends the derivative at zero; and turned."""
        return tuple(replace(self, offset=float(offset)) for offset in (-0.01, 0.01, *TURNED))

    def shown(self, robot: Robot) -> tuple[str, ...]:
        """Q; at a rigid joint theta is the same."""
        return ("q",) if robot.joints[self.required_index(robot)].elastic else ("q", "theta")
