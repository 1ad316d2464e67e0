"""The gap in forward simulation: what a model makes of the same command, and what the robot made of it.

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

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.bench.gap import Gap
from sea_ident.discrepancy.measured.check import torque_units
from sea_ident.discrepancy.simulated.command import Command, actual, command_of
from sea_ident.discrepancy.simulated.deviations import common_power, noise_power, spread_of_power
from sea_ident.effects.memory import MemoryEffect
from sea_ident.effects.spring_hysteresis import SpringHysteresis
from sea_ident.estimation import Model
from sea_ident.estimation.unknown_zeros import unknown_zeros
from sea_ident.exceptions import DivergenceError, SeaIdentError, SeaIdentWarning
from sea_ident.processing import ProcessedRecording
from sea_ident.recordings import Recording
from sea_ident.robot import Robot
from sea_ident.side_by_side import side_by_side
from sea_ident.simulation import (
    Controller,
    Drive,
    FrictionJitter,
    PlantedEffect,
    SensorNoise,
    plant_from_identified,
    simulate,
)
from sea_ident.simulation.reference import PeriodicReference, Reference

LEAD = 1.0
"""Time that a motion without memory runs in from the measured state before it is compared [s]; one with memory runs in
for a period, at the end of which it has passed all reversals."""

RATE = 200.0
"""Samples a second of a simulation, at least [Hz]: of a recording that has many more, so many are compared."""

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
class ScaledDrive(Controller):
    """A controller of motors of which each gives a share of the torque that is recorded.

    Attributes:
        like: the controller.
        shares: (n,) [-].
    """

    like: Controller
    shares: FloatArray

    def drive(self, robot: Robot, reference: Reference, time: FloatArray) -> Drive:
        """The drive at the times (N,) [s]."""
        told, shares = self.like.drive(robot, reference, time), self.shares
        return Drive(shares * told.bias, shares * told.position_gain, shares * told.velocity_gain, told.reference)


@dataclass(frozen=True, eq=False)
class Present:
    """What has changed in the mean of a recording, for a model of the mean of another.

    Attributes:
        effects: that act beside the model.
        delivered_share: (n,) of the recorded torque, that each motor gives [-].
    """

    effects: tuple[PlantedEffect, ...]
    delivered_share: FloatArray

    @property
    def differs(self) -> bool:
        """Whether anything has."""
        return bool(self.effects) or bool(np.any(self.delivered_share != 1.0))


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
    present: Present | None = None,
) -> SimulationGap:
    """Simulate two models under the command of a recording, and compare both with it.

    Args:
        before: the model as it was.
        after: the repaired model.
        recording: what was measured, on motion that the models were not fitted to where there is any.
        processed: the same, processed.
        controller: the controller of the robot; the velocity controller of `simulate` where None, if it is found to
            give the measured torque.
        present: what has changed in that recording, for the repaired model.

    Returns:
        The gaps; none where a model cannot be simulated, with the reason in the notes.
    """
    command = command_of(after, recording, processed, controller)
    command = replace(command, controller=SameDrive(command.controller))
    notes = [command.note] if command.note else []
    parts = command.parts(processed)
    deviations = []
    driven = [(model, part, own) for model, own in ((before, None), (after, present)) for part in parts]
    simulations = side_by_side(lambda one: simulated(one[0], command, one[1], one[2]), driven)
    for label in ("before", "after"):
        try:
            runs = [next(simulations) for _ in parts]
        except SeaIdentError as error:
            notes.append(_not_simulated(label, error))
            return SimulationGap({}, tuple(notes))
        deviations.append([deviations_of(run, part, len(parts) > 1) for run, part in zip(runs, parts, strict=True)])
    names = before.robot.joint_names
    slipping = {e.required_joint for e in after.spring_effects if isinstance(e, SpringHysteresis)}
    remembering = [names.index(joint) for joint in sorted(slipping | set(unknown_zeros(after)))]
    for part in (part for model in deviations for part in model):
        part["q"][..., remembering] -= part["q"][..., remembering].mean(axis=1, keepdims=True)
    gaps, unseen = {}, {}
    for kind in SIGNALS:
        both = [np.concatenate([part[kind] for part in model]) for model in deviations]
        floor = SEEN * spread_of_power(_of_periods(processed, kind)[:, :: stride_of(processed)])
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
    """Deviations (k, N', n) of a simulation, by signal: from every period, or from the mean of periods of its own."""
    stride = stride_of(part)
    found = {kind: run[kind] - _of_periods(part, kind)[:, ::stride] for kind in SIGNALS}
    return {kind: values.mean(axis=0, keepdims=True) for kind, values in found.items()} if own else found


def stride_of(processed: ProcessedRecording) -> int:
    """Stride from one simulated sample of a period to the next: as long as `RATE` allows."""
    samples = processed.samples
    most = max(int(samples / (RATE * (processed.period or np.inf))), 1)
    return max(k for k in range(1, most + 1) if samples % k == 0)


def simulated(
    model: Model,
    command: Command,
    processed: ProcessedRecording,
    present: Present | None = None,
) -> dict[str, FloatArray]:
    """Samples (N', n) of one period of q, theta and tau as sensors without noise see them.

    After a lead from the measured state; at every so many samples of the recording (`stride_of`).

    Raises:
        SeaIdentError: the model cannot be simulated, or its motion diverges.
    """
    present = present or Present((), np.ones(model.robot.n))
    built = plant_from_identified(model, present.effects)
    stride, period = stride_of(processed), command.reference.period
    samples = processed.samples // stride
    remembers = any(isinstance(planted.effect, MemoryEffect) for planted in built.effects)
    lead = samples if remembers else min(ceil(LEAD / period * samples), samples)
    first = samples - lead
    # torques as the record has them, by what the model says of the drives, and no currents
    plant = replace(built.plant, torque_constant=np.full(model.robot.n, np.nan))
    with python_warnings.catch_warnings():
        python_warnings.simplefilter("ignore", SeaIdentWarning)
        run = simulate(
            model.robot,
            command.reference,
            periods=1,
            sensors=SensorNoise.none(),
            jitter=FrictionJitter.none(),
            controller=ScaledDrive(command.driving(model, processed), present.delivered_share),
            friction=built.friction,
            plant=plant,
            effects=built.effects,
            rate=samples / period,
            start=actual(model, processed)[0][first * stride : first * stride + 1],
            lead=lead * period / samples,
        )
    recorded, robot = run.recording, model.robot
    q = recorded.channel("q", robot.joint_names)
    theta = q.copy()
    for i in robot.elastic_indices:
        theta[:, i] = recorded.columns[f"theta_{robot.joint_names[i]}"]
    tau = recorded.channel("tau_motor", robot.joint_names) / present.delivered_share
    return {"q": q, "theta": theta, "tau": tau}


def _not_simulated(label: str, error: SeaIdentError) -> str:
    """Why the model before or after the repair has no forward simulation, and what to do.

    `simulate` advises on its own arguments, of which a diagnosis has but the controller.
    """
    why = str(error)
    if isinstance(error, DivergenceError):
        why = (
            f"{error.what}; in Python, give `diagnose` the controller of the robot, or one with softer gains "
            "(controller=). What was found does not rest on this simulation"
        )
    return f"no forward simulation of the model {label} the repair: {why}"
