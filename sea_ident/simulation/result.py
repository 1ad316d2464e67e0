"""What a simulation gives back."""

from dataclasses import dataclass, field

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.motion import Motion
from sea_ident.recordings import Recording
from sea_ident.simulation.plant import Plant, PlantedEffect


@dataclass(frozen=True, eq=False)
class Simulation:
    """A simulated experiment.

    Attributes:
        recording: what the sensors saw.
        motion: (N, n) exact motion at the recorded instants.
        tau_motor: (N, n) exact motor torques at the joint side [N m].
        tau_spring: (N, n) exact spring torques, 0 at rigid joints [N m].
        reference: (N, n) what the motors were meant to follow.
        plant: the truth.
        effects: what was planted beside it.
        period: [s], None where the reference does not repeat.
        periods: number of recorded periods, 1 where the reference does not repeat.
        settling_periods: periods that were simulated before the recording.
        settled: largest change of a position over the last settling period [rad] or [m]; NaN without settling.
        step: step of the integrator where a joint reverses [s].
        steps: number of steps, settling included, and those that were taken again as shorter ones.
        warnings: what a user should know.
    """

    recording: Recording
    motion: Motion
    tau_motor: FloatArray
    tau_spring: FloatArray
    reference: Motion
    plant: Plant
    effects: tuple[PlantedEffect, ...]
    period: float | None
    periods: int
    settling_periods: int
    settled: float
    step: float
    steps: int
    warnings: tuple[str, ...] = field(default=())

    def summary(self) -> str:
        """Length, settling, ranges per joint."""
        robot = self.plant.robot
        lines = [
            f"simulation of {robot.name}: {self.periods} periods of {self.period:g} s"
            if self.period is not None
            else f"simulation of {robot.name}: one pass of {float(self.motion.time[-1]):g} s",
            f"  step {1e3 * self.step:g} ms, {self.steps} steps, {self.settling_periods} settling periods, "
            f"last change {self.settled:.2g}",
        ]
        error = self.motion.theta - self.reference.theta
        for i, joint in enumerate(robot.joints):
            lines.append(
                f"  {joint.name}: tracking error {np.sqrt(np.mean(error[:, i] ** 2)):.3g} {joint.position_unit} rms, "
                f"motor {np.max(np.abs(self.tau_motor[:, i])):.4g} {joint.torque_unit} at most, "
                f"deflection {np.max(np.abs(self.motion.deflection[:, i])):.3g} {joint.position_unit} at most"
            )
        lines += [f"  planted: {p.effect.name} {p.effect.joint or ''} {p.values.tolist()}" for p in self.effects]
        lines += [f"  warning: {text}" for text in self.warnings]
        return "\n".join(lines)
