"""Steps through the passes of a reference, and keeps what is recorded."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import ceil, sqrt

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.exceptions import DivergenceError, SimulationError
from sea_ident.motion import Motion
from sea_ident.simulation.controller import Drive
from sea_ident.simulation.dynamics import ClosedLoop
from sea_ident.simulation.reference import Reference

FASTEST = 1e4
"""A speed beyond this [rad/s or m/s] is a divergence."""

SMALL_ERROR = 1e-6
"""Error of the positions that a long step may estimate of itself [rad] or [m], ..."""

SMALL_RATE_ERROR = 5e-5
"""... and of the speeds [rad/s] or [m/s]: what turns over quickly shows there first. Positions of legs and of arms are
then as near to those of steps of a twentieth as they are with short steps alone, within 1e-5 rad."""

LONGEST_WAIT = 7
"""Long steps that are not tried at most after as many as that were too long in turn."""


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

    @staticmethod
    def short_and_long(reference: Reference, rate: float, short: float, long: float) -> tuple["Clock", ...]:
        """The clock of short steps [s], and that of long ones, made of several short ones, where these differ."""
        longer, shorter = (Clock.build(reference, rate, step) for step in (max(short, long), short))
        parts = ceil(shorter.substeps / longer.substeps)
        return (longer,) if parts == 1 else (replace(longer, substeps=parts * longer.substeps), longer)

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


class _Track:
    """Steps of one length through a pass, and what drives the motors at each.

    Args:
        system: the closed loop.
        clock: of the steps.
        bias: (steps + 1, stages, n) of the drive [N m].
        later: time of the second stage within a step, as a part of it.
    """

    def __init__(self, system: ClosedLoop, clock: Clock, bias: FloatArray, later: float) -> None:
        self.step, self.clock = system.steps(clock.step), clock
        self.biases: list[list[list[float]]] = bias.tolist()
        self.rates = np.zeros((len(bias), system.size))
        self.rates[:, system.motor] = (bias[:, 1] - bias[:, 0]) / (later * clock.step)


class Passes:
    """A closed loop on its way through time.

    Args:
        system: the closed loop.
        drive: at the stages of all steps of a pass; of the short ones first, then of the long ones.
        clocks: of the short steps; and of the long ones where there are any, each made of as many short ones.
        nodes: of the method.
        begin: of the recording [s].
    """

    def __init__(
        self,
        system: ClosedLoop,
        drive: Drive,
        clocks: Sequence[Clock],
        nodes: FloatArray,
        begin: float,
    ) -> None:
        bias = drive.bias.reshape(-1, len(nodes), system.n)
        clock = clocks[0]
        count = clock.samples * clock.substeps + 1
        self._system, self._clock, self._begin = system, clock, begin
        self._short = _Track(system, clock, bias[:count], float(nodes[1]))
        self._long = _Track(system, clocks[1], bias[count:], float(nodes[1])) if len(clocks) > 1 else None
        self._states: list[FloatArray] = []
        self._accelerations: list[FloatArray] = []
        self._tau_motor: list[list[float]] = []
        self._tau_spring: list[list[float]] = []
        self._waits = self._patience = 0
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
        self._keep(self._begin + self._clock.duration, self._clock.samples, state)

    def _run(self, state: FloatArray, begin: float, first: int = 0, *, keep: bool) -> FloatArray:
        interval = self._clock.interval
        with np.errstate(over="ignore", invalid="ignore"):  # what diverges is told as such
            for sample in range(first, self._clock.samples):
                if keep:
                    self._keep(begin + sample * interval, sample, state)
                state = self._sampled(state, begin, sample)
                self._check(state, begin + (sample + 1) * interval)
        return state

    def _sampled(self, state: FloatArray, begin: float, sample: int) -> FloatArray:
        """The state one sample later: by long steps where these see what happens, else by short ones."""
        long, substeps = self._long, self._clock.substeps
        if long is None:
            return self._stepped(state, begin, range(sample * substeps, (sample + 1) * substeps))
        parts = substeps // long.clock.substeps
        for k in range(sample * long.clock.substeps, (sample + 1) * long.clock.substeps):
            self._waits -= 1
            after = self._strode(long, state, begin, k) if self._waits < 0 else None
            if after is not None:
                state, self._patience = after, 0
                continue
            if self._waits < 0:  # in vain: where one is too long, the next ones mostly are
                self._waits = self._patience = min(2 * self._patience + 1, LONGEST_WAIT)
            state = self._stepped(state, begin, range(k * parts, (k + 1) * parts))
        return state

    def _strode(self, long: _Track, state: FloatArray, begin: float, k: int) -> FloatArray | None:
        """The state one long step later; None where a joint reverses meanwhile, or too much may be wrong with it."""
        system, h = self._system, long.step.length
        self.steps += 1
        try:
            after = system.step(long.step, begin + k * h, long.biases[k], long.rates[k], state)
        except (SimulationError, OverflowError):
            return None
        size = system.size
        error = long.step.error.dot(system.increments)
        small = _norm(error[:size]) < SMALL_ERROR and _norm(error[size:]) < SMALL_RATE_ERROR  # not what is not finite
        if not small or float((state[size:] * after[size:]).min()) < 0.0:
            return None
        system.accept(begin + (k + 1) * h, after)
        return after

    def _stepped(self, state: FloatArray, begin: float, numbers: range) -> FloatArray:
        """The state some short steps later."""
        system, short, h = self._system, self._short, self._clock.step
        for k in numbers:
            try:
                state = system.step(short.step, begin + k * h, short.biases[k], short.rates[k], state)
            except (SimulationError, OverflowError) as error:
                raise SimulationError(f"the simulation diverged {self._at(begin + k * h)}: {error}") from None
            system.accept(begin + (k + 1) * h, state)
        self.steps += len(numbers)
        return state

    def _keep(self, time: float, sample: int, state: FloatArray) -> None:
        system = self._system
        system.evaluate(time, self._short.biases[sample * self._clock.substeps][0], state)
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


def _norm(values: FloatArray) -> float:
    return sqrt(float(values.dot(values)))
