"""How an effect acts in a simulation."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Protocol

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
            bodies need, where a `LoadEffect` asks for it [N m].
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


class Action(Protocol):
    """How an effect acts in a simulation.

    An effect with memory gives an action that also has a method ``accept(state)``: the simulator calls it with every
    state that it keeps, and then only does the memory move on (trial steps and steps back leave it as it is). A trial
    state lies `elapsed` after the last one that was kept. Each simulation asks for a new action.
    """

    def __call__(self, state: SimulationState, link: FloatArray, motor: FloatArray) -> None:
        """Add its torque to the link rows (n,) and the motor rows (n,), with the sign of `Effect.evaluate`."""


class JointAction(ABC):
    """An action at a single joint that depends on the time and the state of that joint and on nothing else.

    A simulator asks for it at several speeds at once, and without the state of the rest of the robot.

    Attributes:
        index: of the joint.
        on_link: share of its torque in the link row, with its sign [-].
        on_motor: share of its torque in the motor row, with its sign [-].
    """

    def __init__(self, index: int, on_link: float, on_motor: float) -> None:
        self.index, self.on_link, self.on_motor = index, on_link, on_motor

    @abstractmethod
    def amounts(self, time: float, q: FloatArray, dq: FloatArray, theta: FloatArray, dtheta: FloatArray) -> FloatArray:
        """(N,) torques [N m] at a time [s], in the states (N,) of the joint."""

    def __call__(self, state: SimulationState, link: FloatArray, motor: FloatArray) -> None:
        """Add its torque to the link rows (n,) and the motor rows (n,), with the sign of `Effect.evaluate`."""
        one = slice(self.index, self.index + 1)
        amount = self.amounts(state.time, state.q[one], state.dq[one], state.theta[one], state.dtheta[one])[0]
        link[self.index] += self.on_link * amount
        motor[self.index] += self.on_motor * amount
