"""The gap in forward simulation: what a model makes of the same command, and what the robot made of it.

A drive is a torque that depends on time alone and two gains per motor (see `sea_ident.simulation.controller`):

    tau_motor = bias(t) - position_gain theta - velocity_gain theta'

With the reference that was recorded and the controller that followed it, the bias is known. Where either is not, the
measured motion and torque of the motors stand in for it: bias = tau + position_gain theta + velocity_gain theta'. A
model that is right then moves exactly as the robot did, whatever the gains; with the gains of the robot's own
controller, one that is wrong also goes wrong by as much as it would in the robot's place.

What is measured is noisy. Its noise cancels in the product of deviations that have none of it in common: those of
different periods from a simulation that is driven by a reference, or those of two simulations, each driven by one half
of the periods and compared with that half.

Where a spring with dry friction rests follows from how it was loaded before the recording began: a constant deflection
that no periodic motion tells. At joints with such a spring the mean of q is not compared, before nor after.
"""

import warnings as python_warnings
from dataclasses import dataclass, field, replace
from math import ceil

import numpy as np
from scipy.interpolate import CubicSpline

from sea_ident._typing import FloatArray
from sea_ident.discrepancy import words
from sea_ident.discrepancy.check import torque_units
from sea_ident.discrepancy.findings import Gap
from sea_ident.effects import corrected_motion
from sea_ident.effects.memory import MemoryEffect
from sea_ident.effects.signal import SignalEffect
from sea_ident.effects.spring_hysteresis import SpringHysteresis
from sea_ident.estimation import Model
from sea_ident.exceptions import DiagnosisError, SeaIdentError, SeaIdentWarning
from sea_ident.motion import FourierSeries, Motion
from sea_ident.processing import ProcessedRecording
from sea_ident.recordings import Recording
from sea_ident.robot import Robot
from sea_ident.side_by_side import side_by_side
from sea_ident.simulation import (
    Controller,
    Drive,
    FrictionJitter,
    SensorNoise,
    VelocityController,
    plant_from_identified,
    simulate,
)
from sea_ident.simulation.reference import PeriodicReference, Reference

LEAD = 1.0
"""Time that a motion without memory runs in from the measured state before it is compared [s]; one with memory runs in
for a period, at the end of which it has passed all reversals."""

REPRODUCED = 0.05
"""Share of the torque up to which a controller that is only assumed must give the torque that was measured."""

REFERENCE_HARMONICS = 100
"""Harmonics of a recorded reference."""

FEWEST_TO_HALVE = 4
"""Periods from which on two simulations are driven by half of them each."""

SIGNALS = ("q", "theta", "tau")
"""What is compared."""

SEEN = 2.0
"""Standard deviations of its noise beyond which the mean square of a deviation is more than noise."""


@dataclass(frozen=True, eq=False)
class SameDrive(Controller):
    """A controller that follows a reference again and again: what is simulated differs, its drive does not.

    Attributes:
        like: the controller.
    """

    like: Controller
    _kept: list[tuple[Robot, object, FloatArray, Drive]] = field(default_factory=list)

    def drive(self, robot: Robot, reference: Reference, time: FloatArray) -> Drive:
        """The drive at the times (N,) [s]."""
        # every simulation wraps the series that it follows anew
        followed = reference.series if isinstance(reference, PeriodicReference) else reference
        for known, series, times, drive in self._kept:
            if known is robot and series is followed and np.array_equal(times, time):
                return drive
        drive = self.like.drive(robot, reference, time)
        self._kept.append((robot, followed, time, drive))
        return drive


@dataclass(frozen=True, eq=False)
class MeasuredDrive(Controller):
    """A drive that gives the measured torque on the measured motion, and holds the motors to that motion.

    Attributes:
        motion: (N, n) one period of the measured motion.
        tau_motor: (N, n) the measured torque [N m].
        like: the controller whose gains are taken.
    """

    motion: Motion
    tau_motor: FloatArray
    like: Controller

    def drive(self, robot: Robot, reference: Reference, time: FloatArray) -> Drive:
        """The drive at the times (N,) [s]."""
        motion, period, count = self.motion, reference.duration, len(self.motion)
        knots = np.asarray(np.arange(count + 1) * (period / count), dtype=np.float64)
        gains = self.like.drive(robot, reference, knots[:-1])
        bias = self.tau_motor + gains.position_gain * motion.theta + gains.velocity_gain * motion.dtheta
        curve = CubicSpline(knots, np.concatenate([bias, bias[:1]]), bc_type="periodic")
        at_time = np.asarray(curve(time % period), dtype=np.float64)
        # of what is followed only the samples are recorded
        followed = gains.reference[np.round(time * (count / period)).astype(int) % count]
        return Drive(at_time, gains.position_gain, gains.velocity_gain, followed)


@dataclass(frozen=True, eq=False)
class Command:
    """What the motors were told to do in a recording: a reference that a controller follows.

    Attributes:
        controller: how they were driven.
        reference: what they followed.
        note: what stands in for them, in words; empty where the reference was recorded and the controller gives the
            measured torque.
    """

    controller: Controller
    reference: FourierSeries
    note: str

    def parts(self, processed: ProcessedRecording) -> tuple[ProcessedRecording, ...]:
        """The parts of a recording that a model is driven by, one simulation each."""
        return (processed,)

    def driving(self, model: Model, part: ProcessedRecording) -> Controller:
        """What drives a model."""
        return self.controller


@dataclass(frozen=True, eq=False)
class StandIn(Command):
    """The measured motion and torque of the motors in the place of a reference, with the gains of the controller."""

    def parts(self, processed: ProcessedRecording) -> tuple[ProcessedRecording, ...]:
        """Every other period, and those between: their noises are independent."""
        if len(processed.period_motions) < FEWEST_TO_HALVE:
            return (processed,)
        return tuple(_some_periods(processed, first) for first in (0, 1))

    def driving(self, model: Model, part: ProcessedRecording) -> Controller:
        """What drives a model: motion and torque as they were by what the model says of the sensors."""
        return MeasuredDrive(*actual(model, part), self.controller)


def _some_periods(processed: ProcessedRecording, first: int) -> ProcessedRecording:
    motions = processed.period_motions[first::2]
    torques = processed.period_tau_motor[first::2]
    return replace(
        processed,
        motion=Motion.mean(motions),
        tau_motor=torques.mean(axis=0),
        periods=len(motions),
        period_motions=motions,
        period_tau_motor=torques,
        places=processed.places[first::2],
    )


def actual(model: Model, processed: ProcessedRecording) -> tuple[Motion, FloatArray]:
    """Motion, and torque (N, n) of the motors, as they were by what a model says of the sensors [N m] or [N]."""
    tau = processed.tau_motor
    for effect in model.effects:
        if isinstance(effect, SignalEffect):
            tau = effect.delivered(model.robot, processed.motion.time, tau)
    return corrected_motion(model.robot, model.effects, processed.motion), tau


@dataclass(frozen=True, eq=False)
class SimulationGap:
    """How far forward simulation is from a recording, before and after a repair.

    Attributes:
        gaps: by signal q, theta, tau [rad] or [m], [N m] or [N].
        notes: what a user should know.
    """

    gaps: dict[str, Gap]
    notes: tuple[str, ...]


def simulation_gap(
    before: Model,
    after: Model,
    recording: Recording | ProcessedRecording,
    processed: ProcessedRecording,
    controller: Controller | None = None,
) -> SimulationGap:
    """Simulate two models under the command of a recording, and compare both with it.

    Args:
        before: the model as it was.
        after: the repaired model.
        recording: what was measured, on motion that the models were not fitted to where there is any.
        processed: the same, processed.
        controller: the controller of the robot; the velocity controller of `simulate` where None, if it is found to
            give the measured torque.

    Returns:
        The gaps; none where a model cannot be simulated, with the reason in the notes.
    """
    command = command_of(after, recording, processed, controller)
    command = replace(command, controller=SameDrive(command.controller))
    notes = [command.note] if command.note else []
    parts = command.parts(processed)
    deviations = []
    driven = [(model, part) for model in (before, after) for part in parts]
    simulations = side_by_side(lambda one: simulated(one[0], command, one[1]), driven)
    for label in ("before", "after"):
        try:
            runs = [next(simulations) for _ in parts]
        except SeaIdentError as error:
            notes.append(words.not_simulated(label, error))
            return SimulationGap({}, tuple(notes))
        deviations.append([deviations_of(run, part, len(parts) > 1) for run, part in zip(runs, parts, strict=True)])
    names = before.robot.joint_names
    remembering = [
        names.index(effect.required_joint) for effect in after.spring_effects if isinstance(effect, SpringHysteresis)
    ]
    for part in (part for model in deviations for part in model):
        part["q"][..., remembering] -= part["q"][..., remembering].mean(axis=1, keepdims=True)
    gaps, unseen = {}, {}
    for kind in SIGNALS:
        both = [np.concatenate([part[kind] for part in model]) for model in deviations]
        floor = SEEN * spread_of_power(_of_periods(processed, kind))
        powers = [common_power(values) for values in both]
        seen = np.any([power > floor for power in powers], axis=0)
        rms = [np.sqrt(np.where(seen, np.maximum(power, 0.0), 0.0)) for power in powers]
        noise = np.sqrt(noise_power(both[1]))
        had, left, unsure = (dict(zip(names, map(float, values), strict=True)) for values in (*rms, noise))
        gaps[kind] = Gap(had, left, unsure, torque_units(before.robot))
        unseen[kind] = [name for name, there in zip(names, seen, strict=True) if not there]
    if unseen["q"]:
        notes.append(
            f"forward simulation of q at {', '.join(unseen['q'])}: before and after the repair within the noise of the "
            "recording, so that nothing can be said of how much the gap shrinks there"
        )
    return SimulationGap(gaps, tuple(notes))


def _of_periods(processed: ProcessedRecording, kind: str) -> FloatArray:
    """(P, N, n) a signal in every period."""
    if kind == "tau":
        return processed.period_tau_motor
    return np.stack([getattr(motion, kind) for motion in processed.period_motions])


def deviations_of(run: dict[str, FloatArray], part: ProcessedRecording, own: bool) -> dict[str, FloatArray]:
    """Deviations (k, N, n) of a simulation, by signal: from every period, or from the mean of periods of its own."""
    found = {kind: run[kind] - _of_periods(part, kind) for kind in SIGNALS}
    return {kind: values.mean(axis=0, keepdims=True) for kind, values in found.items()} if own else found


def common_power(deviations: FloatArray) -> FloatArray:
    """(n,) mean square of what k deviations (k, N, n) with independent noise have in common; may come out negative."""
    count, samples = deviations.shape[:2]
    total = np.sum(deviations.sum(axis=0) ** 2, axis=0) - np.sum(deviations**2, axis=(0, 1))
    return np.asarray(total / (count * (count - 1) * samples), dtype=np.float64)


def noise_power(deviations: FloatArray) -> FloatArray:
    """(n,) mean square of the noise of the mean of k deviations (k, N, n)."""
    return np.asarray(np.mean(np.var(deviations, axis=0, ddof=1), axis=0) / len(deviations), dtype=np.float64)


def spread_of_power(periods: FloatArray) -> FloatArray:
    """(n,) standard deviation of `common_power` where k periods (k, N, n) have nothing but noise.

    The noise of every period may as well have the opposite sign, independently: that gives the variance.
    """
    count, samples = periods.shape[:2]
    noise = (periods - periods.mean(axis=0)) * np.sqrt(count / (count - 1.0))
    products = np.einsum("ptj,qtj->jpq", noise, noise) / samples
    squares = np.sum(products**2, axis=(1, 2)) - np.sum(np.diagonal(products, axis1=1, axis2=2) ** 2, axis=1)
    return np.asarray(np.sqrt(2.0 * squares) / (count * (count - 1)), dtype=np.float64)


def simulated(model: Model, command: Command, processed: ProcessedRecording) -> dict[str, FloatArray]:
    """One period (N, n) of q, theta and tau as sensors without noise see them, after a lead from the measured state.

    Raises:
        SeaIdentError: the model cannot be simulated, or its motion diverges.
    """
    built = plant_from_identified(model)
    samples, period = processed.samples, command.reference.period
    remembers = any(isinstance(planted.effect, MemoryEffect) for planted in built.effects)
    lead = samples if remembers else min(ceil(LEAD / period * samples), samples)
    first = samples - lead
    with python_warnings.catch_warnings():
        python_warnings.simplefilter("ignore", SeaIdentWarning)
        run = simulate(
            model.robot,
            command.reference,
            periods=1,
            sensors=SensorNoise.none(),
            jitter=FrictionJitter.none(),
            controller=command.driving(model, processed),
            friction=built.friction,
            plant=built.plant,
            effects=built.effects,
            rate=samples / period,
            start=actual(model, processed)[0][first : first + 1],
            lead=lead * period / samples,
        )
    recorded, robot = run.recording, model.robot
    q = recorded.channel("q", robot.joint_names)
    theta = q.copy()
    for i in robot.elastic_indices:
        theta[:, i] = recorded.columns[f"theta_{robot.joint_names[i]}"]
    torque = run.tau_motor
    if all(recorded.has("tau_motor", name) for name in robot.joint_names):
        torque = recorded.channel("tau_motor", robot.joint_names)
    return {"q": q, "theta": theta, "tau": torque}


def command_of(
    model: Model,
    recording: Recording | ProcessedRecording,
    processed: ProcessedRecording,
    controller: Controller | None,
) -> Command:
    """What the motors were told to do, from the reference that was recorded where there is one.

    A controller that is only assumed is held against the torque that the motors gave.

    Args:
        model: what is known of the sensors.
        recording: what was measured.
        processed: the same, processed.
        controller: of the robot; the velocity controller of `simulate` where None.

    Raises:
        DiagnosisError: the recording is not periodic.
    """
    if processed.period is None:
        raise DiagnosisError(f"{processed.source} is not periodic: forward simulation cannot be compared with it")
    robot, frequency = model.robot, 1.0 / processed.period
    motion, tau = actual(model, processed)
    time = np.asarray(np.arange(len(motion)) * (processed.period / len(motion)), dtype=np.float64)
    like = VelocityController() if controller is None else controller
    recorded = recorded_reference(robot, recording, processed)
    harmonics = min(REFERENCE_HARMONICS, (len(motion) - 1) // 2)
    stand_in = FourierSeries.fit(time, motion.theta, frequency, harmonics)
    gains = " by the gains of the velocity controller of `simulate`" if controller is None else ""
    if recorded is None:
        text = (
            "the recording has no reference: in forward simulation the measured motion and torque of the motors stand "
            f"in for it, held{gains}"
        )
        return StandIn(like, stand_in, text)
    reference = FourierSeries.fit(time, recorded, frequency, harmonics)
    drive = like.drive(robot, PeriodicReference(reference), time)
    torque = drive.bias - drive.position_gain * motion.theta - drive.velocity_gain * motion.dtheta
    size = np.sqrt(np.mean(tau**2, axis=0))
    wrong = np.sqrt(np.mean((torque - tau) ** 2, axis=0)) / np.where(size > 0.0, size, 1.0)
    worst = int(np.argmax(wrong))
    if wrong[worst] <= REPRODUCED:
        return Command(like, reference, "")
    which = "the given controller" if controller is not None else "the velocity controller of `simulate`"
    text = (
        f"from the recorded reference {which} gives a torque that is {100 * wrong[worst]:.2g} % off the measured one "
        f"at {robot.joint_names[worst]!r}: in forward simulation the measured motion and torque of the motors stand in "
        f"for the reference, held{gains}"
    )
    return StandIn(like, stand_in, text)


def recorded_reference(
    robot: Robot, recording: Recording | ProcessedRecording, processed: ProcessedRecording
) -> FloatArray | None:
    """(N, n) one period of the reference of the motors, in the phase of the mean motion; None without one."""
    names, samples = robot.joint_names, processed.samples
    if isinstance(recording, ProcessedRecording):
        for kind in ("theta_reference", "q_reference"):
            if kind in processed.channels:
                return processed.channels[kind]
        return None
    columns = []
    for name in names:
        kinds = [k for k in ("theta_reference", "q_reference") if recording.has(k, name)]
        if not kinds or recording.samples < samples or not recording.is_uniform:
            return None
        columns.append(recording.columns[f"{kinds[0]}_{name}"][-samples:])
    return np.stack(columns, axis=1)
