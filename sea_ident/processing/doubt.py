"""What may be wrong with a recording, and of what kind: what is concluded from it depends on that."""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum


class DoubtKind(StrEnum):
    """What is doubted."""

    PERIOD = "period"
    POSITION = "position"
    """A position is in another unit, of another joint or another side of the gear, or a joint that the model holds is
    not held: the model then moves another way than the robot did."""
    SPRING = "spring"
    """Motor and link of a joint move as a stiff spring would not let them."""
    TORQUE = "torque"
    SENSOR = "sensor"
    """An encoder stood still or lost counts for a while."""


@dataclass(frozen=True)
class Doubt:
    """Something that may be wrong with a recording.

    Attributes:
        kind: what is doubted.
        text: what is wrong, where, and what to do.
    """

    kind: DoubtKind
    text: str


def texts_of(doubts: Iterable[Doubt], kind: DoubtKind) -> tuple[str, ...]:
    """What is said of one kind."""
    return tuple(doubt.text for doubt in doubts if doubt.kind is kind)


def say_column(column: str, setting: str) -> str:
    """How a user says what a column of a file is, in Python and on the command line."""
    key, _, value = setting.partition("=")
    quoted = repr(value) if key == "unit" else value
    return f"say ColumnSource({column!r}, {key}={quoted}), on the command line --column '{column}={column},{setting}'"
