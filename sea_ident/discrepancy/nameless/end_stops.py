"""Soft ends of the range of a joint, which the library does not have: where a joint passes one, something pushes back.

In a motion that repeats itself that is a push in every period, with a begin, an end and about a force. What tells them
apart is the form: what pushes from outside does so whatever the joint does meanwhile, what acts at a place comes and
goes with it.
"""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.effects import Column, JointEffect, Shape, Side, State
from sea_ident.robot import Robot

_SHARES = 8
"""Shares of its travel in which a joint is pushed back that a search tries."""

_EXPONENTS = (1.0, 2.0)
"""Powers of the way beyond the beginning of the stop that it tries [-]."""


@dataclass(frozen=True)
class EndStop(JointEffect):
    """t_0 (1 - (end - q) / w)^n within w = share * travel of one end of the path of a joint, at the link.

    Attributes:
        joint: the joint.
        end: where its path ends [rad] or [m].
        travel: from there to the other end, with its sign [rad] or [m].
        share: of the travel in which it is pushed back [-].
        exponent: n [-].
        unit: of the position of the joint, for words.
    """

    end: float = 1.0
    travel: float = -1.0
    share: float = 0.3
    exponent: float = 1.0
    unit: str = "rad"

    name: ClassVar[str] = "end_stop"
    side: ClassVar[Side] = Side.LINK
    source: ClassVar[str] = "Hunt, Crossley, Coefficient of restitution interpreted as damping, J. Appl. Mech. 42, 1975"
    shapes: ClassVar[tuple[Shape, ...]] = (Shape("share", "1", 0.02, 0.8), Shape("exponent", "1", 0.8, 4.0))

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """Torque at the very end."""
        return (Column(self.parameter_name(), self.units_of(robot)[0], self.name, self.joint, self.side, True),)

    def local_columns(self, q: FloatArray, dq: FloatArray, theta: FloatArray, dtheta: FloatArray) -> FloatArray:
        """(N, 1) towards the end it pushes back."""
        beyond = np.maximum(1.0 - (q - self.end) / (self.share * self.travel), 0.0)
        return np.asarray(-np.sign(self.travel) * beyond**self.exponent)[:, None]

    def variants(self, state: State) -> tuple["EndStop", ...]:
        """Shorter and longer ones, of each power."""
        shares = np.geomspace(0.05, 0.7, _SHARES)
        return tuple(
            replace(self, share=float(share), exponent=exponent) for share in shares for exponent in _EXPONENTS
        )

    @property
    def in_words(self) -> str:
        """When it acts."""
        side = "above" if self.travel < 0.0 else "below"
        place = f"{self.joint} is {side} {self.end + self.share * self.travel:.3g} {self.unit}"
        return f"in every period at the same place and not at a certain time, where {place}, as a soft stop there does"


def end_stops(bench: Bench) -> tuple[EndStop, ...]:
    """A stop at both ends of the path of every joint."""
    found: list[EndStop] = []
    for i, joint in enumerate(bench.robot.joints):
        low, high = (float(end(bench.data.motion.q[:, i])) for end in (np.min, np.max))
        if high > low:
            ends = (high, low - high), (low, high - low)
            found.extend(EndStop(joint.name, *each, unit=joint.position_unit) for each in ends)
    return tuple(found)
