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
then within 1e-5 rad of those with steps of a twentieth; torques at reversals are what suffers first."""

MOST_PARTS = 4
"""Short steps in a long one up to which there are none between."""

LARGE_RATE_ERROR = 0.1
"""Error of the speeds [rad/s] or [m/s] in a step, by its own estimate, that is told: friction that is as steep as is
usual stays far below. A spring that nothing damps may swing faster than a step can follow that suits friction."""

LONGEST_WAIT = 7
"""Steps of a length that are not tried at most, after as many in turn that were too long."""


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
    def from_short_to_long(reference: Reference, rate: float, short: float, long: float) -> tuple["Clock", ...]:
        """Clocks of steps up to `short` [s], perhaps of some between, and up to `long`, each of which is several."""
        longest, shortest = (Clock.build(reference, rate, step) for step in (max(short, long), short))
        parts = ceil(shortest.substeps / longest.substeps)
        between = round(sqrt(parts)) if parts > MOST_PARTS else 1
        parts = ceil(parts / between)
        counts = dict.fromkeys((parts * between * longest.substeps, between * longest.substeps, longest.substeps))
        return tuple(replace(longest, substeps=count) for count in counts)

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
        self.waits = self.patience = 0
        self.biases: list[list[list[float]]] = bias.tolist()
        self.rates = np.zeros((len(bias), system.size))
        self.rates[:, system.motor] = (bias[:, 1] - bias[:, 0]) / (later * clock.step)


class Passes:
    """A closed loop on its way through time.

    Args:
        system: the closed loop.
        drive: at the stages of all steps of a pass, for one clock after the other.
        clocks: of the steps from short to long, each made of several of those before.
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
        bias, end = drive.bias.reshape(-1, len(nodes), system.n), 0
        self._system, self._clock, self._begin = system, clocks[0], begin
        self._tracks: list[_Track] = []  # from long to short
        for clock in clocks:
            start, end = end, end + clock.samples * clock.substeps + 1
            self._tracks.insert(0, _Track(system, clock, bias[start:end], float(nodes[1])))
        self._states: list[FloatArray] = []
        self._accelerations: list[FloatArray] = []
        self._tau_motor: list[list[float]] = []
        self._tau_spring: list[list[float]] = []
        self._rate_errors, self._largest_at = np.zeros(system.size), begin
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
        interval, longest = self._clock.interval, self._tracks[0].clock.substeps
        with np.errstate(over="ignore", invalid="ignore"):  # what diverges is told as such
            for sample in range(first, self._clock.samples):
                if keep:
                    self._keep(begin + sample * interval, sample, state)
                for k in range(sample * longest, (sample + 1) * longest):
                    state = self._advanced(state, begin, k, 0)
                self._check(state, begin + (sample + 1) * interval)
        return state

    def _advanced(self, state: FloatArray, begin: float, k: int, level: int) -> FloatArray:
        """The state after step k of a length: by this step where it sees what happens, else by those it is made of."""
        track = self._tracks[level]
        if level == len(self._tracks) - 1:
            return self._stepped(track, state, begin, k)
        track.waits -= 1
        if track.waits < 0:
            after = self._strode(track, state, begin, k)
            if after is not None:
                track.patience = 0
                return after
            # where one is too long, the next ones mostly are
            track.waits = track.patience = min(2 * track.patience + 1, LONGEST_WAIT)
        parts = self._tracks[level + 1].clock.substeps // track.clock.substeps
        for part in range(k * parts, (k + 1) * parts):
            state = self._advanced(state, begin, part, level + 1)
        return state

    def _strode(self, track: _Track, state: FloatArray, begin: float, k: int) -> FloatArray | None:
        """The state one step later; None where a joint reverses meanwhile, or too much may be wrong with it."""
        size = self._system.size
        try:
            after = self._step(track, state, begin, k)
        except (SimulationError, OverflowError):
            return None
        error = track.step.error.dot(self._system.increments)
        small = _norm(error[:size]) < SMALL_ERROR and _norm(error[size:]) < SMALL_RATE_ERROR  # not what is not finite
        if not small or float((state[size:] * after[size:]).min()) < 0.0:
            return None
        self._system.accept(begin + (k + 1) * track.step.length, after)
        return after

    def _stepped(self, track: _Track, state: FloatArray, begin: float, k: int) -> FloatArray:
        """The state one step later, whatever that brings."""
        h = track.step.length
        try:
            state = self._step(track, state, begin, k)
        except (SimulationError, OverflowError) as error:
            raise SimulationError(f"the simulation diverged {self._at(begin + k * h)}: {error}") from None
        errors = np.abs(track.step.error.dot(self._system.increments)[self._system.size :])
        if float(errors.max()) > float(self._rate_errors.max()):
            self._rate_errors, self._largest_at = errors, begin + k * h
        self._system.accept(begin + (k + 1) * h, state)
        return state

    def _step(self, track: _Track, state: FloatArray, begin: float, k: int) -> FloatArray:
        self.steps += 1
        return self._system.step(track.step, begin + k * track.step.length, track.biases[k], track.rates[k], state)

    def _keep(self, time: float, sample: int, state: FloatArray) -> None:
        system = self._system
        system.evaluate(time, self._tracks[-1].biases[sample * self._clock.substeps][0], state)
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
        i, side = self._place(k)
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

    def notes(self) -> list[str]:
        """Whether the steps were too long for what happened, in a sentence."""
        k = int(np.argmax(self._rate_errors))
        error = float(self._rate_errors[k])
        if error < LARGE_RATE_ERROR:
            return []
        i, side = self._place(k)
        joint, step = self._system.plant.robot.joints[i], self._clock.step
        return [
            f"a step of {step:.3g} s is long for the {side} of joint {joint.name!r}: it errs by up to {error:.2g} "
            f"{joint.position_unit}/s there, {self._at(self._largest_at)}, and the recording is not quite what the "
            f"robot would do. Take a shorter step, as {0.25 * step:.2g} s; where a spring swings freely, describe its "
            "damping"
        ]

    def _place(self, k: int) -> tuple[int, str]:
        """Joint and side of a coordinate."""
        robot = self._system.plant.robot
        return (k, "link") if k < robot.n else (int(robot.elastic_indices[k - robot.n]), "motor")

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
