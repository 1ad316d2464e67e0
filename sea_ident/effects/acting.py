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


@dataclass(eq=False, slots=True)
class JointState:
    """States of one joint at one instant of a simulation, which may differ in speed.

    Attributes:
        time: as in `SimulationState` [s].
        q: (N,) link position.
        dq: (N,) link velocity.
        theta: (N,) motor position after the gear.
        dtheta: (N,) motor velocity after the gear.
        tau_spring: (N,) torque from the motor side onto the link [N m].
        tau_motor: (N,) commanded motor torque at the joint side [N m].
    """

    time: float
    q: FloatArray
    dq: FloatArray
    theta: FloatArray
    dtheta: FloatArray
    tau_spring: FloatArray
    tau_motor: FloatArray

    @staticmethod
    def of(state: SimulationState, index: int) -> "JointState":
        """The state (1,) of one joint of a robot."""
        i = slice(index, index + 1)
        return JointState(
            state.time,
            state.q[i],
            state.dq[i],
            state.theta[i],
            state.dtheta[i],
            state.tau_spring[i],
            state.tau_motor[i],
        )


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
    def amounts(self, state: JointState) -> FloatArray:
        """(N,) torques [N m] in the states of the joint."""

    def __call__(self, state: SimulationState, link: FloatArray, motor: FloatArray) -> None:
        """Add its torque to the link rows (n,) and the motor rows (n,), with the sign of `Effect.evaluate`."""
        amount = self.amounts(JointState.of(state, self.index))[0]
        link[self.index] += self.on_link * amount
        motor[self.index] += self.on_motor * amount
