"""Steps through the passes of a reference, and keeps what is recorded."""

from dataclasses import dataclass
from math import ceil

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.exceptions import DivergenceError, SimulationError
from sea_ident.motion import Motion
from sea_ident.simulation.controller import Drive
from sea_ident.simulation.dynamics import ClosedLoop
from sea_ident.simulation.reference import Reference

FASTEST = 1e4
"""A speed beyond this [rad/s or m/s] is a divergence."""


@dataclass(frozen=True)
class Clock:
    """Samples and steps of one pass of a reference.

    Attributes:
        samples: number of sampling intervals.
        substeps: steps of the integrator in each.
        duration: of the pass [s].
    """

    samples: int
    substeps: int
    duration: float

    @staticmethod
    def build(reference: Reference, rate: float, step: float) -> "Clock":
        """At most `step` [s] long steps, and about `rate` samples a second [Hz]."""
        samples = max(1, round(rate * reference.duration))
        return Clock(samples, ceil(reference.duration / samples / step - 1e-9), reference.duration)

    @property
    def interval(self) -> float:
        """Time between samples [s]."""
        return self.duration / self.samples

    @property
    def step(self) -> float:
        """Step of the integrator [s]."""
        return self.interval / self.substeps

    def stage_times(self, nodes: FloatArray) -> FloatArray:
        """(steps + 1, stages) flattened: times of all stages of a pass, and of the step after it [s]."""
        steps = np.arange(self.samples * self.substeps + 1)
        times: FloatArray = (self.step * (steps[:, None] + nodes)).ravel()
        return times


class Passes:
    """A closed loop on its way through time."""

    def __init__(self, system: ClosedLoop, drive: Drive, clock: Clock, nodes: FloatArray, begin: float) -> None:
        stages, later = len(nodes), float(nodes[1])
        self._system, self._clock, self._begin = system, clock, begin
        biases = drive.bias.reshape(-1, stages, system.n)
        self._biases: list[list[list[float]]] = biases.tolist()
        self._bias_rates = np.zeros((len(biases), system.size))
        self._bias_rates[:, system.motor] = (biases[:, 1] - biases[:, 0]) / (later * clock.step)
        self._states: list[FloatArray] = []
        self._accelerations: list[FloatArray] = []
        self._tau_motor: list[list[float]] = []
        self._tau_spring: list[list[float]] = []
        self.steps = 0

    def settle(self, state: FloatArray, samples: int | None = None) -> FloatArray:
        """State when the recording begins, from the state a number of samples before, a whole pass by default."""
        first = 0 if samples is None else self._clock.samples - samples
        return self._run(state, self._begin - self._clock.duration, first, keep=False)

    def record(self, state: FloatArray, number: int) -> FloatArray:
        """State after the recorded pass of this number."""
        return self._run(state, self._begin + number * self._clock.duration, keep=True)

    def record_end(self, state: FloatArray) -> None:
        """Record the state at the end of the only pass."""
        self._keep(self._begin + self._clock.duration, len(self._biases) - 1, state)

    def _run(self, state: FloatArray, begin: float, first: int = 0, *, keep: bool) -> FloatArray:
        system, biases, rates, h = self._system, self._biases, self._bias_rates, self._clock.step
        k = before = first * self._clock.substeps
        with np.errstate(over="ignore", invalid="ignore"):  # what diverges is told as such
            for _ in range(first, self._clock.samples):
                if keep:
                    self._keep(begin + k * h, k, state)
                for _ in range(self._clock.substeps):
                    try:
                        state = system.step(begin + k * h, biases[k], rates[k], state)
                    except (SimulationError, OverflowError) as error:
                        raise SimulationError(f"the simulation diverged {self._at(begin + k * h)}: {error}") from None
                    k += 1
                    system.accept(begin + k * h, state)
                self._check(state, begin + k * h)
        self.steps += k - before
        return state

    def _keep(self, time: float, k: int, state: FloatArray) -> None:
        system = self._system
        system.evaluate(time, self._biases[k][0], state)
        self._states.append(state)
        self._accelerations.append(system.acceleration)
        self._tau_motor.append(list(system.tau_motor))
        self._tau_spring.append(list(system.tau_spring))

    def _check(self, state: FloatArray, time: float) -> None:
        if float(state.dot(state)) < FASTEST**2:  # not so if a number is not finite
            return
        size = len(state) // 2
        if np.all(np.isfinite(state)) and float(np.abs(state[size:]).max()) < FASTEST:
            return
        robot = self._system.plant.robot
        speeds = np.where(np.isfinite(state[size:]), np.abs(state[size:]), np.inf)
        k = int(np.argmax(speeds))
        i, side = (k, "link") if k < robot.n else (int(robot.elastic_indices[k - robot.n]), "motor")
        what = (
            f"the simulation diverged {self._at(time)}: the {side} of joint {robot.joint_names[i]!r} moves at "
            f"{speeds[k]:.3g} {robot.joints[i].position_unit}/s"
        )
        softening = self._softening(i, state)
        if softening:
            raise SimulationError(f"{what}; {softening}")
        raise DivergenceError(
            what, f"take a shorter step than {self._clock.step:g} s, or softer gains of the controller"
        )

    def _softening(self, i: int, state: FloatArray) -> str:
        """Why a joint diverged where its spring softens and was bent too far; empty where it was not that."""
        plant = self._system.plant
        robot, stiffness, cubic = plant.robot, float(plant.stiffness[i]), float(plant.cubic_stiffness[i])
        if not robot.joints[i].elastic or not cubic < 0.0:
            return ""
        motor = robot.n + robot.elastic_indices.tolist().index(i)
        turns = float(np.sqrt(max(stiffness, 0.0) / -cubic))
        if abs(float(state[motor] - state[i])) < turns:
            return ""
        joint = robot.joints[i]
        units = f"{joint.torque_unit}/{joint.position_unit}"
        return (
            f"its spring (K1 {stiffness:.3g} {units}, K3 {cubic:.3g} {units}3) pushes the wrong way where it deflects "
            f"by more than {turns:.3g} {joint.position_unit}: such a law holds no farther than it was identified"
        )

    def _at(self, time: float) -> str:
        return f"at {time:.4f} s" + (" (while it settled)" if time < self._begin else "")

    def motion(self) -> Motion:
        """(N, n) recorded motion."""
        states, accelerations = np.array(self._states), np.array(self._accelerations)
        n, motors, size = self._system.n, self._system.motor, self._system.size
        position, velocity = states[:, :size], states[:, size:]
        time = self._begin + np.arange(len(states), dtype=np.float64) * self._clock.interval
        return Motion(
            time, position[:, :n], velocity[:, :n], accelerations[:, :n],
            position[:, motors], velocity[:, motors], accelerations[:, motors],
        )  # fmt: skip

    @property
    def tau_motor(self) -> FloatArray:
        """(N, n) recorded torques of the motors [N m]."""
        return np.array(self._tau_motor)

    @property
    def tau_spring(self) -> FloatArray:
        """(N, n) recorded torques of the springs, 0 at rigid joints [N m]."""
        torque: FloatArray = np.array(self._tau_spring) * self._system.plant.robot.elastic
        return torque
