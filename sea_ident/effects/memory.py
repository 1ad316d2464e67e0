"""Effects with memory: what they do depends on the path, not only on the present state."""

from abc import abstractmethod
from typing import ClassVar

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects.acting import Action, JointAction, SimulationState
from sea_ident.effects.base import JointEffect
from sea_ident.effects.signal import is_closed
from sea_ident.robot import Robot


class MemoryEffect(JointEffect):
    """An effect at a single joint whose columns depend on the path of that joint.

    The memory is a tuple of numbers that moves on with the distance travelled, so that it does not depend on the
    rate of the samples. Over one period of a periodic motion it is evaluated twice around: the second time it is in
    its steady state.
    """

    memory_size: ClassVar[int] = 1

    @abstractmethod
    def path(self, q: FloatArray, theta: FloatArray) -> FloatArray:
        """(N,) coordinate that drives the memory: theta for friction, theta - q for a spring."""

    @abstractmethod
    def advance(self, memory: tuple[float, ...], distance: float) -> tuple[float, ...]:
        """Memory after travelling a distance."""

    def trace(self, memory: tuple[float, ...], steps: FloatArray) -> FloatArray:
        """(N, m) memory after each of N steps along a path, one after the other."""
        out = np.empty((len(steps), self.memory_size))
        for k, distance in enumerate(steps.tolist()):
            memory = self.advance(memory, distance)
            out[k] = memory
        return out

    @abstractmethod
    def remembered_columns(self, memory: FloatArray, dtheta: FloatArray) -> FloatArray:
        """(N, k) columns from the memory (N, m) and the motor velocity (N,)."""

    def local_columns(self, q: FloatArray, dq: FloatArray, theta: FloatArray, dtheta: FloatArray) -> FloatArray:
        """(N, k) columns; a closed path is in its steady state, any other starts without memory."""
        path = self.path(q, theta)
        memory: tuple[float, ...] = (0.0,) * self.memory_size
        if is_closed(path):
            steps = np.diff(path, prepend=path[-1])
            memory = tuple(self.trace(memory, steps)[-1].tolist())
        else:
            steps = np.diff(path, prepend=path[0])
        return self.remembered_columns(self.trace(memory, steps), dtheta)

    def torque(self, robot: Robot, values: FloatArray) -> Action:
        """An action that keeps its memory; the simulator tells it by `accept` which states count."""
        return MemoryAction(self, robot, values)


class OneWayEffect(MemoryEffect):
    """An effect whose memory depends only on how far the path went one way, in however many steps.

    So it need only be followed from one reversal of the path to the next.
    """

    @abstractmethod
    def advance_all(self, memory: FloatArray, distances: FloatArray) -> FloatArray:
        """(N, m) memory after travelling distances (N,), each from a memory (N, m) of its own: `advance` for many."""

    def trace(self, memory: tuple[float, ...], steps: FloatArray) -> FloatArray:
        """(N, m) memory after each of N steps along a path."""
        begins = np.concatenate([[0], np.flatnonzero(np.diff(steps > 0.0)) + 1])
        lengths = np.diff(begins, append=len(steps))
        befores = []
        for distance in np.add.reduceat(steps, begins).tolist():
            befores.append(memory)
            memory = self.advance(memory, distance)
        travelled = np.cumsum(steps)
        since = travelled - np.repeat(travelled[begins] - steps[begins], lengths)
        return self.advance_all(np.repeat(np.array(befores), lengths, axis=0), since)


class MemoryAction(JointAction):
    """A `MemoryEffect` at work in a simulation.

    Args:
        effect: the effect.
        robot: the robot.
        values: (k,) values of its parameters.
    """

    def __init__(self, effect: MemoryEffect, robot: Robot, values: FloatArray) -> None:
        at, shares = robot.index(effect.required_joint), effect.side.shares
        super().__init__(at, shares, self._remembered, values, of_speed=effect.of_speed)
        self._effect = effect
        self._memory: tuple[float, ...] = (0.0,) * effect.memory_size
        self._position: float | None = None

    def _at(self, position: float) -> tuple[float, ...]:
        if self._position is None:
            self._position = position
        return self._effect.advance(self._memory, position - self._position)

    def _remembered(self, state: SimulationState) -> FloatArray:
        """(N, k) columns in trial states of the joint."""
        memory = np.array([self._at(position) for position in self._effect.path(state.q, state.theta).tolist()])
        return self._effect.remembered_columns(memory, state.dtheta)

    def accept(self, state: SimulationState) -> None:
        """Move the memory on to a state that is kept."""
        own = state.at(self.index)
        position = float(self._effect.path(own.q, own.theta)[0])
        self._memory = self._at(position)
        self._position = position
