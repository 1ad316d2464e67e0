"""The gap in forward simulation: what a model makes of the same command, and what the robot made of it.

A drive is a torque that depends on time alone and two gains per motor (see `sea_ident.simulation.controller`):

    tau_motor = bias(t) - position_gain theta - velocity_gain theta'

With the reference that was recorded and the controller that followed it, the bias is known. Where either is not, the
measured motion and torque of the motors stand in for it: bias = tau + position_gain theta + velocity_gain theta'. A
model that is right then moves exactly as the robot did, whatever the gains; with the gains of the robot's own
controller, one that is wrong also goes wrong by as much as it would in the robot's place.
"""

import warnings as python_warnings
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.findings import Gap
from sea_ident.estimation import Model
from sea_ident.exceptions import DiagnosisError, SeaIdentError, SeaIdentWarning
from sea_ident.motion import FourierSeries, Motion
from sea_ident.processing import ProcessedRecording
from sea_ident.recordings import Recording
from sea_ident.robot import Robot
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

LEAD_PERIODS = 2
"""Periods that are simulated from the measured state; the last one is compared."""

REPRODUCED = 0.05
"""Share of the torque up to which a controller that is only assumed must give the torque that was measured."""

REFERENCE_HARMONICS = 100
"""Harmonics of a recorded reference."""


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
        gains = self.like.drive(robot, reference, time)
        motion, period = self.motion, reference.duration
        bias = self.tau_motor + gains.position_gain * motion.theta + gains.velocity_gain * motion.dtheta
        knots = np.arange(len(bias) + 1) * (period / len(bias))
        curve = CubicSpline(knots, np.concatenate([bias, bias[:1]]), bc_type="periodic")
        at_time = np.asarray(curve(time % period), dtype=np.float64)
        return Drive(at_time, gains.position_gain, gains.velocity_gain, gains.reference)


@dataclass(frozen=True, eq=False)
class Command:
    """What the motors were told to do in a recording.

    Attributes:
        controller: how they were driven.
        reference: what they followed.
        note: what stands in for them, in words; empty where the reference was recorded and the controller gives the
            measured torque.
    """

    controller: Controller
    reference: FourierSeries
    note: str


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
    command = command_of(before.robot, recording, processed, controller)
    notes = [command.note] if command.note else []
    measured = {"q": processed.motion.q, "theta": processed.motion.theta, "tau": processed.tau_motor}
    periods = {
        "q": np.stack([m.q for m in processed.period_motions]),
        "theta": np.stack([m.theta for m in processed.period_motions]),
        "tau": processed.period_tau_motor,
    }
    runs = []
    for label, model in (("before", before), ("after", after)):
        try:
            runs.append(simulated(model, command, processed))
        except SeaIdentError as error:
            notes.append(f"no forward simulation of the model {label} the repair: {error}")
            return SimulationGap({}, tuple(notes))
    names = before.robot.joint_names
    gaps = {}
    for kind, mean in measured.items():
        noise = np.sqrt(np.mean(np.var(periods[kind], axis=0, ddof=1), axis=0) / len(periods[kind]))
        rms = [np.sqrt(np.maximum(np.mean((run[kind] - mean) ** 2, axis=0) - noise**2, 0.0)) for run in runs]
        gaps[kind] = Gap(*(dict(zip(names, map(float, values), strict=True)) for values in (*rms, noise)))
    return SimulationGap(gaps, tuple(notes))


def simulated(model: Model, command: Command, processed: ProcessedRecording) -> dict[str, FloatArray]:
    """One period (N, n) of q, theta and tau as sensors without noise see them, after a lead from the measured state.

    Raises:
        SeaIdentError: the model cannot be simulated, or its motion diverges.
    """
    built = plant_from_identified(model)
    samples = processed.samples
    with python_warnings.catch_warnings():
        python_warnings.simplefilter("ignore", SeaIdentWarning)
        run = simulate(
            model.robot,
            command.reference,
            periods=LEAD_PERIODS,
            sensors=SensorNoise.none(),
            jitter=FrictionJitter.none(),
            controller=command.controller,
            friction=built.friction,
            plant=built.plant,
            effects=built.effects,
            rate=samples / command.reference.period,
            start=processed.motion[0:1],
        )
    recorded, robot = run.recording, model.robot
    last = slice(-samples, None)
    q = recorded.channel("q", robot.joint_names)[last]
    theta = q.copy()
    for i in robot.elastic_indices:
        theta[:, i] = recorded.columns[f"theta_{robot.joint_names[i]}"][last]
    torque = run.tau_motor[last]
    if all(recorded.has("tau_motor", name) for name in robot.joint_names):
        torque = recorded.channel("tau_motor", robot.joint_names)[last]
    return {"q": q, "theta": theta, "tau": torque}


def command_of(
    robot: Robot,
    recording: Recording | ProcessedRecording,
    processed: ProcessedRecording,
    controller: Controller | None,
) -> Command:
    """What the motors were told to do, from the reference that was recorded where there is one.

    A controller that is only assumed is held against the measured torque.

    Raises:
        DiagnosisError: the recording is not periodic.
    """
    if processed.period is None:
        raise DiagnosisError(f"{processed.source} is not periodic: forward simulation cannot be compared with it")
    frequency, motion = 1.0 / processed.period, processed.motion
    time = np.asarray(np.arange(len(motion)) * (processed.period / len(motion)), dtype=np.float64)
    like = VelocityController() if controller is None else controller
    recorded = recorded_reference(robot, recording, processed)
    harmonics = min(REFERENCE_HARMONICS, (len(motion) - 1) // 2)
    stand_in = FourierSeries.fit(time, motion.theta, frequency, harmonics)
    own_way = Command(MeasuredDrive(motion, processed.tau_motor, like), stand_in, "")
    gains = " by the gains of the velocity controller of `simulate`" if controller is None else ""
    if recorded is None:
        text = (
            "the recording has no reference: in forward simulation the measured motion and torque of the motors stand "
            f"in for it, held{gains}"
        )
        return Command(own_way.controller, stand_in, text)
    reference = FourierSeries.fit(time, recorded, frequency, harmonics)
    drive = like.drive(robot, PeriodicReference(reference), time)
    torque = drive.bias - drive.position_gain * motion.theta - drive.velocity_gain * motion.dtheta
    size = np.sqrt(np.mean(processed.tau_motor**2, axis=0))
    wrong = np.sqrt(np.mean((torque - processed.tau_motor) ** 2, axis=0)) / np.where(size > 0.0, size, 1.0)
    worst = int(np.argmax(wrong))
    if wrong[worst] <= REPRODUCED:
        return Command(like, reference, "")
    which = "the given controller" if controller is not None else "the velocity controller of `simulate`"
    text = (
        f"from the recorded reference {which} gives a torque that is {100 * wrong[worst]:.2g} % off the measured one "
        f"at {robot.joint_names[worst]!r}: in forward simulation the measured motion and torque of the motors stand in "
        f"for the reference, held{gains}"
    )
    return Command(own_way.controller, stand_in, text)


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
