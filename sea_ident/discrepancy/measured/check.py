"""Checks at the border: recordings that prove nothing, clipped channels, spikes, pauses."""

import warnings as python_warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.measured.closing import mean_of_periods
from sea_ident.discrepancy.measured.data import EquationKind, PeriodData
from sea_ident.discrepancy.measured.odd_periods import odd_periods
from sea_ident.effects import Effect
from sea_ident.estimation import Model
from sea_ident.estimation.identify import visible_parameters
from sea_ident.estimation.misplaced import misplaced_columns
from sea_ident.estimation.observations import Observations
from sea_ident.estimation.signs import turned_torques
from sea_ident.exceptions import DiagnosisError, SeaIdentWarning
from sea_ident.processing import ProcessedRecording, process
from sea_ident.recordings import Recording
from sea_ident.recordings.recording import slower_than_any
from sea_ident.robot import Robot

CLIPPED_RUN = 4
"""Equal extreme samples in a row, in every period, that count as clipped."""

PILED_UP = 5.0
"""Samples at the largest value over those at the value next to it from which on it is a limit [-]."""

CLIPPED_SHARE = 0.05
"""Share of clipped samples beyond which nothing can be told."""

NOTHING_IN_COMMON = 0.5
"""Spread between periods, as a share of the motion, from which on they are not periods of one motion [-]."""


@dataclass(frozen=True)
class Findings:
    """What was found at the border.

    Attributes:
        warnings: what a user should know.
        fatal: whether no conclusion can be drawn.
        doubtful: whether the positions may not be those of the model, so that a disagreement proves nothing.
        limited: whether what has no name may be what the sensors cannot show.
        apart: whether zeros of encoders that differ explain springs that fit badly; what has no name beside them is no
            effect.
    """

    warnings: tuple[str, ...] = ()
    fatal: bool = False
    doubtful: bool = False
    limited: bool = False
    apart: bool = False


def models_match(model: Model, reference: Model | None) -> None:
    """Refuse a reference of another robot.

    Raises:
        DiagnosisError: its joints differ.
    """
    if reference is not None and reference.robot.joint_names != model.robot.joint_names:
        raise DiagnosisError(
            f"the reference is a model of {reference.robot.name} ({', '.join(reference.robot.joint_names)}), the model "
            f"is one of {model.robot.name} ({', '.join(model.robot.joint_names)}); give an earlier model of the same "
            "robot"
        )


def columns_match(robot: Robot, recording: Recording | ProcessedRecording) -> None:
    """Refuse a recording of another robot.

    Raises:
        DiagnosisError: it does not have the joints of the robot.
    """
    if isinstance(recording, ProcessedRecording):
        have: tuple[str, ...] = recording.joint_names
        matches = have == robot.joint_names
    else:
        have = recording.joints
        matches = all(name in have for name in robot.joint_names)
    if not matches:
        raise DiagnosisError(
            f"{recording.source} holds the joints {', '.join(have) or 'none'}; the model is one of {robot.name} with "
            f"{', '.join(robot.joint_names)}. Is it a recording of another robot?"
        )


def torque_units(robot: Robot) -> dict[str, str]:
    """Unit of the torque of each joint."""
    return {joint.name: joint.torque_unit for joint in robot.joints}


def channels_move(robot: Robot, recording: Recording | ProcessedRecording) -> None:
    """Refuse a recording in which a joint does not move or its torque is not measured: it spoils what is said of all.

    Raises:
        DiagnosisError: a column stays at one value.
    """
    if isinstance(recording, ProcessedRecording):
        return
    for joint in robot.joints:
        name = joint.name
        kinds = ["q", *(["theta"] if joint.elastic else []), "tau_motor"]
        if not recording.has("tau_motor", name):
            kinds[-1] = "current"
        for kind in kinds:
            if not recording.has(kind, name) or recording.samples < 2:
                continue
            values = recording.columns[f"{kind}_{name}"]
            if np.ptp(values) > 0.0:
                continue
            what = "no torque is measured"
            if kind in ("q", "theta"):
                what = "the sensor is dead, or the joint does not move"
            raise DiagnosisError(
                f"{recording.source}: column {kind}_{name} is constant, {values[0]:g}: {what}, and nothing can be "
                f"told. Record it, or identify and diagnose a model without {name!r} (joints, on the command "
                "line --joints)"
            )


def clock_in_seconds(recording: Recording | ProcessedRecording) -> None:
    """Refuse a recording whose time cannot be in seconds: no effect of its inertia shows, and any search is long.

    Raises:
        DiagnosisError: no robot that is to be identified moves as slowly.
    """
    slow = None if isinstance(recording, ProcessedRecording) else slower_than_any(recording.time, recording.columns)
    if slow is not None:
        raise DiagnosisError(
            f"{recording.source}: {slow}. If it is in seconds, record a faster motion: nothing shows here"
        )


def as_identified(
    recording: Recording | ProcessedRecording, processed: ProcessedRecording, robot: Robot
) -> ProcessedRecording:
    """The recording as `identify` processes it: with the harmonics that the data ask for, not those compared here."""
    if isinstance(recording, ProcessedRecording):
        return recording
    with python_warnings.catch_warnings():
        python_warnings.simplefilter("ignore", SeaIdentWarning)
        return process(recording, robot, period=processed.period)


def wrong_columns(robot: Robot, effects: Sequence[Effect], processed: ProcessedRecording) -> tuple[str, ...]:
    """What is wrong with the columns of a recording beyond doubt: nothing can be concluded from it.

    Args:
        robot: the robot.
        effects: the model.
        processed: the recording, of two periods or more, as `identify` processes it: of more harmonics accelerations
            are noise, and signs are what that makes of them.

    Returns:
        Sentences; none where the columns may be as they say.
    """
    misplaced = misplaced_columns(robot, effects, processed)
    if misplaced is not None:
        return (misplaced,)
    base, _ = visible_parameters(robot, tuple(effects), processed)
    return turned_torques(Observations(robot, tuple(effects), base, processed))


def temperatures(recording: Recording | ProcessedRecording, data: PeriodData) -> FloatArray | None:
    """(P, n) mean temperature of every period [degC], NaN at joints where it was not measured; None without any."""
    if isinstance(recording, ProcessedRecording):
        return None
    names = data.robot.joint_names
    samples = round(data.period * recording.sample_rate)
    # the last whole periods, as the processing takes them
    count = recording.samples // samples
    places = list(data.places or range(data.periods))
    out = np.full((data.periods, len(names)), np.nan)
    for i, name in enumerate(names):
        if recording.has("temperature", name) and count > max(places):
            values = recording.channel("temperature", [name])[recording.samples - count * samples :, 0]
            out[:, i] = values.reshape(count, samples).mean(axis=1)[places]
    return out if np.any(np.isfinite(out)) else None


def _one_motion(data: PeriodData) -> bool:
    """Whether the periods are about the same in one joint at least."""
    theta = np.stack([motion.theta for motion in data.period_motions])
    between = np.sqrt(np.mean(theta.var(axis=0, ddof=1), axis=0))
    return bool(np.any(between < NOTHING_IN_COMMON * theta.std(axis=(0, 1))))


def cleaned(data: PeriodData, recording: Recording | ProcessedRecording) -> tuple[PeriodData, Findings]:
    """The data without periods that hold spikes and without clipped torques, with what was found.

    Args:
        data: the periods.
        recording: what they come from.

    Returns:
        Data, and findings.
    """
    warnings = list(data.warnings)
    fatal = False
    if not _one_motion(data):
        warnings.append(
            f"{data.source}: what lies {data.period:g} s apart has nothing in common in any joint: that is not the "
            "period of this motion. Give the period that was excited (period=, or --period of identify)"
        )
        fatal = True
    odd = odd_periods(data)
    if odd.periods:
        keep = [p for p in range(data.periods) if p not in odd.periods]
        few = len(keep) >= max(2, data.periods // 2)
        warnings.extend(odd.words(data, few))
        if few:
            data = subset(data, keep)
        fatal = fatal or not few
    clipped = _clipped(data.period_tau_motor)
    if not isinstance(recording, ProcessedRecording):
        # the gear's efficiency turns one limit of a current into two of the torque
        clipped |= _clipped(_currents(data, recording))
    share = clipped.mean(axis=0)
    for i in np.flatnonzero(share > 0.0):
        name = data.robot.joint_names[int(i)]
        warnings.append(
            f"{data.source}: the torque or current of {name!r} stays at its largest value for {100 * share[i]:.3g} % "
            "of the time: it is clipped. These samples were left out; record with less torque"
        )
        fatal = fatal or bool(share[i] > CLIPPED_SHARE)
    if np.any(clipped):
        left_out = data.left_out.copy()
        for e, equation in enumerate(data.equations):
            if equation.kind is not EquationKind.LINK:
                left_out[:, e] |= clipped[:, equation.index]
        data = replace(data, left_out=left_out)
    if not isinstance(recording, ProcessedRecording):
        stuck = _clipped_positions(data, recording)
        warnings.extend(stuck)
        fatal = fatal or bool(stuck)
    return data, Findings(tuple(warnings), fatal)


def subset(data: PeriodData, keep: list[int]) -> PeriodData:
    """The data with some of the periods only."""
    motions = tuple(data.period_motions[p] for p in keep)
    tau = data.period_tau_motor[keep]
    places = data.places or tuple(range(data.periods))
    kept = tuple(places[p] for p in keep)
    motion, mean = mean_of_periods(motions, tau, kept)
    return replace(data, motion=motion, tau_motor=mean, period_motions=motions, period_tau_motor=tau, places=kept)


def _currents(data: PeriodData, recording: Recording) -> FloatArray:
    """(P, N, n) currents of the last whole periods, zero where there are none of the same samples [A]."""
    samples = data.samples
    periods = recording.samples // samples
    out = np.zeros((max(periods, 1), samples, data.robot.n))
    even = recording.is_uniform and abs(data.period * recording.sample_rate - samples) < 0.01
    for i, name in enumerate(data.robot.joint_names):
        if even and periods and recording.has("current", name):
            out[:, :, i] = recording.columns[f"current_{name}"][-periods * samples :].reshape(periods, samples)
    return out


def _clipped(torque: FloatArray) -> NDArray[np.bool_]:
    """(N, n) samples at which the torque (P, N, n) stays at the largest value of its joint, in most periods."""
    out = np.zeros(torque.shape[1:], dtype=np.bool_)
    for i in range(torque.shape[2]):
        tau = torque[:, :, i]
        if not np.any(tau):
            continue
        for extreme in (tau.max(), tau.min()):
            at = np.isclose(tau, extreme, rtol=1e-9, atol=0.0)
            if np.count_nonzero(at) < PILED_UP * np.count_nonzero(_next_to(tau, extreme, at)):
                continue  # a coarse sensor is at its largest step about as long as at the one before
            often = at.mean(axis=0) > 0.5
            for run in np.split(np.arange(len(often)), np.flatnonzero(np.diff(often.astype(int))) + 1):
                if often[run[0]] and len(run) >= CLIPPED_RUN:
                    out[run, i] = True
    return out


def _next_to(tau: FloatArray, extreme: float, at: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Samples (P, N) at the value next to an extreme one."""
    others = tau[~at]
    if not others.size:
        return ~at
    nearest = float(others[np.argmin(np.abs(others - extreme))])
    return np.asarray(np.isclose(tau, nearest, rtol=1e-9, atol=0.0))


def _clipped_positions(data: PeriodData, recording: Recording) -> list[str]:
    found = []
    for name in data.robot.joint_names:
        values = recording.columns[f"q_{name}"]
        step = np.abs(np.diff(values))
        resolution = float(np.min(step[step > 0.0])) if np.any(step > 0.0) else 0.0
        for extreme in (values.max(), values.min()):
            at = values == extreme
            runs = np.diff(np.flatnonzero(np.diff(np.concatenate([[0], at.astype(int), [0]]))))[::2]
            # a coarse encoder holds its last count round a reversal; a clipped one holds it while the speed is high
            entry = np.flatnonzero(np.diff(at.astype(int)) == 1)
            speed = float(np.median(step[np.maximum(entry - 1, 0)])) if len(entry) else 0.0
            if len(runs) and np.median(runs) > 20 and speed > 5.0 * max(resolution, 1e-300) and speed > 0.0:
                found.append(
                    f"{data.source}: q_{name} runs into {extreme:.4g} and stays there: the position is clipped. "
                    "Nothing can be concluded from it"
                )
    return found
