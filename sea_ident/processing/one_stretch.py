"""A recording that is not averaged over periods: one stretch, every sample with its own torque."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sea_ident._typing import FloatArray
from sea_ident.exceptions import RecordingError
from sea_ident.motion import Motion
from sea_ident.processing import filtering, torque, variance
from sea_ident.processing.doubt import Doubt
from sea_ident.processing.periods import usual_interval
from sea_ident.processing.processed import ProcessedRecording
from sea_ident.processing.signals import Signals
from sea_ident.recordings import Recording
from sea_ident.recordings.alignment import between, in_gap
from sea_ident.recordings.recording import GAP_FACTOR
from sea_ident.robot import Robot

RUN = 64
"""Samples without gaps at least that a spectrum is taken of."""

FEWEST_SAMPLES = 16
"""Samples outside gaps at least."""


def one_stretch(
    source: str,
    robot: Robot,
    motion: Motion,
    tau_motor: FloatArray,
    channels: dict[str, FloatArray],
    notes: Sequence[str] = (),
    warnings: Sequence[str] = (),
    doubts: Sequence[Doubt] = (),
) -> ProcessedRecording:
    """What was not averaged over periods; its torque noise is that of its fast part.

    Args:
        source: where it comes from, for messages.
        robot: the robot.
        motion: (N, n) motion.
        tau_motor: (N, n) motor torque at the joint side [N m] or [N].
        channels: (N, n) further signals by kind.
        notes: what was done.
        warnings: what is doubtful.
        doubts: those of them that what is concluded depends on.

    Returns:
        One stretch.
    """
    spread = np.broadcast_to(variance.noise_from_curvature(tau_motor), tau_motor.shape)
    return ProcessedRecording(
        source=source,
        joint_names=robot.joint_names,
        motion=motion,
        tau_motor=tau_motor,
        tau_variance=spread,
        raw_tau_variance=spread,
        periods=1,
        period=None,
        period_motions=(),
        period_tau_motor=tau_motor[None],
        channels=channels,
        places=(0,),
        link_harmonics=0,
        motor_harmonics=0,
        notes=tuple(notes),
        warnings=tuple(warnings),
        doubts=tuple(doubts),
    )


def not_periodic(
    recording: Recording, robot: Robot, signals: Signals, uniform: bool, cutoff: float | None
) -> ProcessedRecording:
    """A recording as one stretch, its positions filtered forwards and backwards; what lies in gaps of time is left out.

    Args:
        recording: the recording.
        robot: the robot.
        signals: its columns.
        uniform: whether its samples are evenly spaced.
        cutoff: of the filter [Hz]; chosen from the data where None.

    Returns:
        The processed recording, every sample with its own torque.

    Raises:
        RecordingError: it is too short for a filter, or has a gap everywhere.
    """
    found, notes = list(signals.warnings), list(signals.notes)
    source, elastic = recording.source, robot.elastic_indices
    interval = recording.duration / (recording.samples - 1)
    time, lost = recording.time, np.zeros(recording.samples, dtype=np.bool_)
    values = {"q": signals.q, "theta": signals.theta, "torque": signals.torque.values, **signals.others}
    if not uniform:
        gap = GAP_FACTOR * float(np.median(np.diff(time)))
        interval = usual_interval(time)
        grid: FloatArray = time[0] + np.arange(int((time[-1] - time[0]) / interval) + 1) * interval
        values = {
            name: np.stack(
                [between(grid, time, column, gap if name in ("q", "theta") else None) for column in table.T], axis=1
            )
            for name, table in values.items()
        }
        time, lost = grid, in_gap(grid, time, gap)
        notes.append("samples are not evenly spaced: interpolated to an even grid, positions by cubic splines")
    positions = np.concatenate([values["q"], values["theta"][:, elastic]], axis=1)
    frequency = cutoff or filtering.choose_cutoff(positions[_longest(lost)], interval)
    smooth = filtering.zero_phase(positions, interval, frequency, source)
    rate = filtering.central_difference(smooth, interval)
    acceleration = filtering.central_difference(rate, interval)
    found.append(
        f"{source}: no period: positions filtered forwards and backwards at {frequency:.3g} Hz and differentiated; "
        "without periods there is no scatter to judge the torque noise by. If the motion repeats, give its period "
        "(--period on the command line); else record one that does, ten times or more"
    )
    edge = min(int(np.ceil(1.0 / (frequency * interval))), len(time) // 8)
    inside = np.ones(len(time), dtype=np.bool_)
    inside[:edge] = inside[len(time) - edge :] = False
    if np.any(lost):
        reached = np.convolve(lost, np.ones(2 * edge + 1), mode="same") > 0.5
        found.append(
            f"{source}: samples in {np.count_nonzero(np.diff(lost.astype(int)) > 0)} gaps in time and within "
            f"{edge * interval:.3g} s of them, {100.0 * np.mean(reached):.3g} % of the recording, were left out"
        )
        inside &= ~reached
        if np.count_nonzero(inside) < FEWEST_SAMPLES:
            raise RecordingError(
                f"{source}: gaps in time everywhere: {np.count_nonzero(inside)} samples are outside them and farther "
                f"than {edge * interval:.3g} s, which the filter of the positions takes. Nothing is filled in: record "
                "without gaps"
            )
    notes.append(f"{edge} samples at both ends were left out, where the filter has no data on one side")
    parts = []
    for table in (smooth, rate, acceleration):
        motor = table[:, : robot.n].copy()
        motor[:, elastic] = table[:, robot.n :]
        parts.append((table[inside, : robot.n].copy(), motor[inside]))
    motion = Motion(time[inside], *(p[0] for p in parts), *(p[1] for p in parts))
    load = values["torque"][inside]
    tau = load * torque.transmitted(load, signals.torque.efficiency, motion.dtheta)
    channels = {name: values[name][inside] for name in signals.others}
    return one_stretch(source, robot, motion, tau, channels, notes, found, signals.doubts)


def _longest(lost: NDArray[np.bool_]) -> slice:
    """The longest run of samples without gaps: what is put into gaps has corners, which look like fast motion."""
    edges = np.flatnonzero(np.diff(np.concatenate([[True], lost, [True]]).astype(int)))
    starts, stops = edges[::2], edges[1::2]
    if not starts.size:
        return slice(None)
    best = int(np.argmax(stops - starts))
    return slice(int(starts[best]), int(stops[best])) if stops[best] - starts[best] >= RUN else slice(None)
