"""How an effect acts in a simulation."""

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
