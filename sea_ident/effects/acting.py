"""How an effect acts in a simulation."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from sea_ident._typing import FloatArray


@dataclass(frozen=True, eq=False)
class SimulationState:
    """State of the robot at one instant of a simulation.

    Attributes:
        time: from the start of the recording; its start while the motion settles [s].
        q: (n,) link positions.
        dq: (n,) link velocities.
        theta: (n,) motor positions after the gear.
        dtheta: (n,) motor velocities after the gear.
        tau_spring: (n,) torques from the motor side onto the links: of the springs, or at a rigid joint what the
            bodies and all else that acts on the links need, where a `LoadEffect` asks for it [N m].
        tau_motor: (n,) commanded motor torques at the joint side [N m].
        elapsed: time since the last step that was accepted [s].
    """

    time: float
    q: FloatArray
    dq: FloatArray
    theta: FloatArray
    dtheta: FloatArray
    tau_spring: FloatArray
    tau_motor: FloatArray
    elapsed: float = 0.0

    def at(self, index: int) -> "SimulationState":
        """The state of one joint alone, with arrays (1,); several states of it at one time have arrays (N,)."""
        i = slice(index, index + 1)
        q, dq, theta, dtheta = self.q[i], self.dq[i], self.theta[i], self.dtheta[i]
        return SimulationState(self.time, q, dq, theta, dtheta, self.tau_spring[i], self.tau_motor[i], self.elapsed)


class Action(Protocol):
    """How an effect acts in a simulation.

    An effect with memory gives an action that also has a method ``accept(state)``: the simulator calls it with every
    state that it keeps, and then only does the memory move on (trial steps and steps back leave it as it is). A trial
    state lies `elapsed` after the last one that was kept. Each simulation asks for a new action.
    """

    def __call__(self, state: SimulationState, link: FloatArray, motor: FloatArray) -> None:
        """Add its torque to the link rows (n,) and the motor rows (n,), with the sign of `Effect.evaluate`."""


def no_torque(state: SimulationState, link: FloatArray, motor: FloatArray) -> None:
    """Add nothing: what acts otherwise, in bodies or in a sensor, gives this action, and is not asked for torques."""


class JointAction:
    """An action at a single joint: columns that depend on the time and the state of that joint alone, times values.

    A simulator asks for it at several speeds at once, and without the state of the rest of the robot.

    Args:
        index: of the joint.
        shares: of its torque in the link row and in the motor row, with their signs [-].
        columns: (N, k) columns from N states of the joint (`SimulationState.at`).
        values: (k,) values of its parameters.
        of_speed: whether its torque depends on a speed; one that does not damps nothing, and is not asked for slopes.
    """

    def __init__(
        self,
        index: int,
        shares: tuple[float, float],
        columns: Callable[[SimulationState], FloatArray],
        values: FloatArray,
        *,
        of_speed: bool = True,
    ) -> None:
        self.index, (self.on_link, self.on_motor), self.of_speed = index, shares, of_speed
        self._columns, self._values = columns, np.asarray(values, dtype=np.float64)

    def amounts(self, state: SimulationState) -> FloatArray:
        """(N,) torques [N m] in N states of the joint."""
        amounts: FloatArray = self._columns(state).dot(self._values)
        return amounts

    def __call__(self, state: SimulationState, link: FloatArray, motor: FloatArray) -> None:
        """Add its torque to the link rows (n,) and the motor rows (n,), with the sign of `Effect.evaluate`."""
        amount = self.amounts(state.at(self.index))[0]
        link[self.index] += self.on_link * amount
        motor[self.index] += self.on_motor * amount
