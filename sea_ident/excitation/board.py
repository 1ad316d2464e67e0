"""Where the starts of a design stand: what progress displays see, and where an interrupted design takes up."""

from collections.abc import Callable
from dataclasses import dataclass, field
from threading import Event, Lock

import numpy as np

from sea_ident._typing import FloatArray


@dataclass(frozen=True)
class Progress:
    """Where a design stands, for progress displays.

    Attributes:
        start: which start reports.
        starts: how many there are.
        step: how many steps it has made.
        value: its criterion; of different meaning in the short climbs, on few samples, and in the long ones.
        best: best criterion of all starts so far.
        criterion: name of what is raised at present; every design begins with log det.
    """

    start: int
    starts: int
    step: int
    value: float
    best: float
    criterion: str


@dataclass(eq=False)
class Board:
    """The latest trajectory of every start, shared by the threads that climb; also where they are told to stop."""

    starts: int
    criterion: str
    progress: Callable[[Progress], None] | None
    stop: Event = field(default_factory=Event)
    lock: Lock = field(default_factory=Lock)
    latest: dict[int, FloatArray] = field(default_factory=dict)
    steps: dict[int, int] = field(default_factory=dict)
    values: dict[int, float] = field(default_factory=dict)
    best: float = -np.inf

    def note(self, start: int, value: float, coefficients: FloatArray) -> bool:
        """Take over what a start has reached and tell; whether it is to stop."""
        with self.lock:
            self.latest[start] = coefficients
            self.steps[start] = self.steps.get(start, 0) + 1
            self.best = max(self.best, value)
            if self.progress is not None:
                self.progress(Progress(start, self.starts, self.steps[start], value, self.best, self.criterion))
        return self.stop.is_set()
