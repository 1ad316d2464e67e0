"""What the motors were told to do in a recording, for a simulation that is told the same.

A drive is a torque that depends on time alone and two gains per motor (see `sea_ident.simulation.controller`):

    tau_motor = bias(t) - position_gain theta - velocity_gain theta'

With the reference that was recorded and the controller that followed it, the bias is known. Where either is not, the
measured motion and torque of the motors stand in for it: bias = tau + position_gain theta + velocity_gain theta'. A
model that is right then moves exactly as the robot did, whatever the gains; with the gains of the robot's own
controller, one that is wrong also goes wrong by as much as it would in the robot's place.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.simulated.deviations import common_power
from sea_ident.effects import corrected_motion
from sea_ident.effects.signal import SignalEffect
from sea_ident.estimation import Model
from sea_ident.exceptions import DiagnosisError
from sea_ident.motion import FourierSeries, Motion
from sea_ident.plain import plain
from sea_ident.processing import ProcessedRecording
from sea_ident.recordings import Recording
from sea_ident.robot import Robot
from sea_ident.simulation import Controller, Drive, VelocityController
from sea_ident.simulation.reference import PeriodicReference, Reference

REPRODUCED = 0.05
"""Share of the torque up to which a controller that is only assumed must give the torque that was measured."""

REFERENCE_HARMONICS = 100
"""Harmonics of a recorded reference."""

FEWEST_TO_HALVE = 4
"""Periods from which on two simulations are driven by half of them each."""


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
    beyond = _beyond(model, like.drive(robot, PeriodicReference(reference), time), processed)
    # noise may be much of a small torque, and is no other controller
    power = common_power(beyond) if len(beyond) > 1 else np.mean(beyond[0] ** 2, axis=0)
    size = np.sqrt(np.mean(tau**2, axis=0))
    wrong = np.sqrt(np.maximum(power, 0.0)) / np.where(size > 0.0, size, 1.0)
    worst = int(np.argmax(wrong))
    if wrong[worst] <= REPRODUCED:
        return Command(like, reference, "")
    which = "the given controller" if controller is not None else "the velocity controller of `simulate`"
    text = (
        f"from the recorded reference {which} gives a torque that is {plain(100 * wrong[worst])} % off the measured "
        f"one at {robot.joint_names[worst]!r}: in forward simulation the measured motion and torque of the motors "
        f"stand in for the reference, held{gains}"
    )
    return StandIn(like, stand_in, text)


def _beyond(model: Model, drive: Drive, processed: ProcessedRecording) -> FloatArray:
    """(P, N, n) torque that a drive gives in every period beyond what was measured [N m] or [N]."""
    found = []
    for motion, tau in zip(processed.period_motions, processed.period_tau_motor, strict=True):
        own, torque = actual(model, replace(processed, motion=motion, tau_motor=tau))
        found.append(drive.bias - drive.position_gain * own.theta - drive.velocity_gain * own.dtheta - torque)
    return np.stack(found)


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
