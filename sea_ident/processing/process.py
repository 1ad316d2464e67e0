"""`process`: from a recording to mean motion, derivatives, motor torque and its variance."""

import warnings as python_warnings
from dataclasses import replace

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.arguments import expect, expect_number, expect_whole
from sea_ident.exceptions import RecordingError, SeaIdentWarning
from sea_ident.motion import Motion
from sea_ident.one_thread import one_thread
from sea_ident.processing import harmonics, periods, rest, torque, variance
from sea_ident.processing.doubt import Doubt, DoubtKind
from sea_ident.processing.encoder_steps import encoder_steps
from sea_ident.processing.one_stretch import not_periodic, one_stretch
from sea_ident.processing.processed import ProcessedRecording
from sea_ident.processing.signals import Signals, read_signals
from sea_ident.recordings import Recording
from sea_ident.recordings.alignment import in_gap
from sea_ident.recordings.recording import GAP_FACTOR
from sea_ident.robot import Robot

SMOOTHING = 0.5
"""Width [s] of the window over which the torque variance is smoothed."""

DIFFERS = 0.1
"""Share of the motion of a joint by which its periods must differ for the period to be doubted, ..."""

MOVES = 1e-3
"""... and share of that of the joint that turns, or slides, most which it must have [-]."""


@one_thread
def process(
    recording: Recording,
    robot: Robot,
    *,
    period: float | None = None,
    link_harmonics: int | None = None,
    motor_harmonics: int | None = None,
    smoothing: float = SMOOTHING,
    cutoff: float | None = None,
) -> ProcessedRecording:
    """Process a recording for identification or validation.

    A periodic recording is cut to its last whole periods, averaged, and q and theta are fitted by Fourier series that
    are differentiated analytically (paper, II.C and III.D). The torque is averaged and not filtered: the regressor
    lacks what the fit of q leaves out, which is noise by the choice of the harmonics; a filter on the torque would
    take from it what the Coulomb columns, not band-limited, still hold. A recording that is not periodic is filtered
    forwards and backwards, positions only, for the same reason.

    Args:
        recording: the recording.
        robot: the robot; every joint needs q, an elastic one theta, and each tau_motor or current.
        period: [s]; found from the data where it is None and the data repeat themselves unambiguously.
        link_harmonics: harmonics of q; chosen from the data where None.
        motor_harmonics: harmonics of theta; chosen from the data where None.
        smoothing: width of the window for the torque variance [s].
        cutoff: of the filter for recordings without a period [Hz]; chosen from the data where None.

    Returns:
        The processed recording; what was found and done is in its notes and warnings.

    Raises:
        RecordingError: a column is missing, the recording is shorter than one period, or nothing moves.
    """
    expect(recording, "process: recording", Recording)
    expect(robot, "process: robot", Robot)
    expect_number(period, "process: period", "s")
    for name, number in (("link_harmonics", link_harmonics), ("motor_harmonics", motor_harmonics)):
        if number is not None:
            expect_whole(number, f"process: {name}", least=1)
    moving, signals, period = _in_motion(recording, robot, period)
    uniform = moving.is_uniform
    if period is None:
        result = not_periodic(moving, robot, signals, uniform, cutoff)
    else:
        result = _periodic(moving, robot, signals, uniform, period, link_harmonics, motor_harmonics, smoothing)
    if moving is not recording:
        result = _told_of_rest(result, recording, moving)
    for text in result.warnings:
        python_warnings.warn(text, SeaIdentWarning, stacklevel=3)
    return result


@one_thread
def filter_recording(recording: Recording, robot: Robot, *, cutoff: float | None = None) -> ProcessedRecording:
    """Process a recording as one stretch, whether it repeats itself or not.

    Args:
        recording: the recording.
        robot: the robot.
        cutoff: of the zero-phase filter of the positions [Hz]; chosen from the data where None.

    Returns:
        The processed recording, every sample with its own torque.

    Raises:
        RecordingError: as `process`.
    """
    result = not_periodic(recording, robot, read_signals(recording, robot), recording.is_uniform, cutoff)
    for text in result.warnings:
        python_warnings.warn(text, SeaIdentWarning, stacklevel=3)
    return result


def from_states(
    robot: Robot, motion: Motion, tau_motor: FloatArray, source: str = "exact states"
) -> ProcessedRecording:
    """States that are known with their derivatives, as from a simulation, in the form that identification takes.

    Args:
        robot: the robot.
        motion: (N, n) motion.
        tau_motor: (N, n) motor torque at the joint side [N m] or [N].
        source: where they come from, for messages.

    Returns:
        One stretch; nothing is filtered or averaged.

    Raises:
        RecordingError: the sizes do not fit the robot.
    """
    if motion.n != robot.n or tau_motor.shape != motion.q.shape:
        raise RecordingError(
            f"{source}: motion of {motion.n} joints and torque of shape {tau_motor.shape} for {robot.name}, which has "
            f"{robot.n} joints"
        )
    return one_stretch(source, robot, motion, tau_motor, {})


def _in_motion(recording: Recording, robot: Robot, period: float | None) -> tuple[Recording, Signals, float | None]:
    """What periods are cut from, without rest at its ends, its signals, and the period; else all of the recording."""
    moving = rest.without_rest(recording, robot)
    signals = read_signals(moving, robot)
    found = period or _detected(moving, robot, signals, moving.is_uniform)
    if moving is recording:
        return recording, signals, found
    if found is None or moving.duration < found:
        # what looks like rest may be a small motion, and of what has no period rest says something, too
        return recording, read_signals(recording, robot), period
    if moving.time[-1] < recording.time[-1]:
        if period is None:
            # a stop bends the period
            before = rest.without_stop(moving, robot, found)
            signals = read_signals(before, robot)
            found = _detected(before, robot, signals, before.is_uniform) or found
        moving = rest.without_stop(moving, robot, found)
        signals = replace(read_signals(moving, robot), notes=signals.notes)
    return moving, signals, found


def _told_of_rest(result: ProcessedRecording, recording: Recording, moving: Recording) -> ProcessedRecording:
    """The result with what was left out of the recording."""
    extent = float(moving.time[0]), float(moving.time[-1])
    before, after = extent[0] - float(recording.time[0]), float(recording.time[-1]) - extent[1]
    where = [f"{s:.3g} s at the {end}" for s, end in ((before, "beginning"), (after, "end")) if s > 0.0]
    text = (
        f"{recording.source}: the robot rests, or comes to rest, for {' and '.join(where)} of the recording: left out, "
        "so that no period holds rest"
    )
    return replace(result, extent=extent, warnings=(*result.warnings, text))


def _detected(recording: Recording, robot: Robot, signals: Signals, uniform: bool) -> float | None:
    """The period that the data show, with a note; the reference counts where there is one, as it has no noise."""
    kinds = ("q_reference", "theta_reference")
    reference = [
        recording.channel(kind, [name]) for name in robot.joint_names for kind in kinds if recording.has(kind, name)
    ]
    complete = all(any(recording.has(kind, name) for kind in kinds) for name in robot.joint_names)
    values = np.concatenate(reference, axis=1) if complete else signals.q
    time, measured = recording.time, None
    if not uniform:
        interval = periods.usual_interval(time)
        grid = time[0] + np.arange(int((time[-1] - time[0]) / interval) + 1) * interval
        values = np.stack([np.interp(grid, time, column) for column in values.T], axis=1)
        measured = ~in_gap(grid, time, GAP_FACTOR * float(np.median(np.diff(time))))
        time = grid
    found = periods.detect_period(time, values, measured)
    if found is not None:
        signals.notes.append(f"period {found:.6g} s found from the {'reference' if complete else 'link positions'}")
    return found


def _periodic(
    recording: Recording,
    robot: Robot,
    signals: Signals,
    uniform: bool,
    period: float,
    link_harmonics: int | None,
    motor_harmonics: int | None,
    smoothing: float,
) -> ProcessedRecording:
    found, notes = list(signals.warnings), list(signals.notes)
    cut = periods.cut_periods(recording.time, uniform, period, recording.source)
    if cut.first < 0:
        notes.append(
            f"{'samples are not evenly spaced' if not uniform else 'the period is no multiple of the sample time'}: "
            f"resampled to {cut.samples} samples a period by cubic splines"
        )
    stacks = {"q": signals.q, "theta": signals.theta, "torque": signals.torque.values, **signals.others}
    cuts = {name: cut.stack(recording.time, values) for name, values in stacks.items()}
    keep = _kept_periods(recording.source, cuts, periods.holes(recording.time, cut), found, notes)
    cuts = {name: values[keep] for name, values in cuts.items()}
    count = len(keep)
    doubted = _doubts_of_period(recording.source, robot, cuts["q"], period)
    found.extend(doubt.text for doubt in doubted)
    if count == 1:
        found.append(
            f"{recording.source}: one period only: there is no scatter between periods; the variance of the torque is "
            "estimated from its fast part, one number per joint. Record more periods"
        )

    most = max((cut.samples - 1) // 3, 1)
    elastic = robot.elastic_indices
    steps = encoder_steps(signals.q, signals.theta, cuts["q"], cuts["theta"], elastic)
    repeated = None if steps is None else steps.link_power(cuts["q"])
    links = link_harmonics or harmonics.choose_harmonics(cuts["q"], most, repeated)
    motors = links
    if elastic.size:
        theta = cuts["theta"][:, :, elastic]
        repeated = None if steps is None else steps.motor_power(theta)
        motors = motor_harmonics or harmonics.choose_motor_harmonics(theta, most, repeated)
    for label, number in (("link_harmonics", links), ("motor_harmonics", motors)):
        if not 1 <= number <= (cut.samples - 1) // 2:
            raise RecordingError(
                f"{recording.source}: {label} is {number}; {cut.samples} samples allow 1 .. {(cut.samples - 1) // 2}"
            )
    time: FloatArray = np.arange(cut.samples, dtype=np.float64) * (period / cut.samples)
    parts = _motions(time, period, cuts["q"], cuts["theta"], links, motors, elastic, keep)
    motion = Motion.mean(parts)
    factor = torque.transmitted(cuts["torque"].mean(axis=0), signals.torque.efficiency, motion.dtheta)
    tau = cuts["torque"] * factor
    if count > 1:
        raw = variance.sample_variance(tau)
        smooth = variance.smooth_over_phase(raw, period / cut.samples, smoothing)
    else:
        raw = np.broadcast_to(variance.noise_from_curvature(tau[0]), tau[0].shape).copy()
        smooth = raw
    return ProcessedRecording(
        source=recording.source,
        joint_names=robot.joint_names,
        motion=motion,
        tau_motor=tau.mean(axis=0),
        tau_variance=smooth,
        raw_tau_variance=raw,
        periods=count,
        period=float(period),
        period_motions=parts if count > 1 else (),
        period_tau_motor=tau,
        channels={name: cuts[name].mean(axis=0) for name in signals.others},
        places=tuple(keep),
        link_harmonics=int(links),
        motor_harmonics=int(motors),
        encoder_steps=steps,
        notes=tuple(notes),
        warnings=tuple(found),
        doubts=(*signals.doubts, *doubted),
    )


def _kept_periods(
    source: str, cuts: dict[str, FloatArray], holes: set[int], found: list[str], notes: list[str]
) -> list[int]:
    """Periods without transients, without gaps in time and without copies of others."""
    count = len(cuts["q"])
    if len(holes) == count:
        raise RecordingError(
            f"{source}: every one of the {count} periods has a gap in time: nothing is filled in. Record without gaps, "
            "or cut the recording to a part without any"
        )
    drop = periods.leading_transients(np.concatenate([cuts["q"], cuts["theta"]], axis=2))
    if drop:
        notes.append(f"the first {drop} of {count} periods differ from the later ones and were left out as transient")
    keep = [p for p in range(drop, count) if p not in holes]
    if not keep:
        keep = [p for p in range(count) if p not in holes]
    if holes:
        found.append(
            f"{source}: {len(holes)} of {count} periods have a gap in time and were left out: "
            f"{', '.join(str(p + 1) for p in sorted(holes)[:10])}{' and others' if len(holes) > 10 else ''}"
        )
    everything = np.concatenate([cuts[name][keep] for name in ("q", "theta", "torque")], axis=2)
    copies = [(keep[a], keep[b]) for a, b in periods.repeated_periods(everything)]
    if copies:
        found.append(
            f"{source}: periods {', '.join(f'{a + 1} and {b + 1}' for a, b in copies[:3])} "
            f"{'and others ' if len(copies) > 3 else ''}are the same numbers: measurements never are. "
            f"{len(copies)} of {count} periods are copies and were left out; look for where the file was put together, "
            "or give a simulation the noise of sensors"
        )
        dropped = {a for a, _ in copies}
        keep = [p for p in keep if p not in dropped]
    return keep


def _doubts_of_period(source: str, robot: Robot, stack: FloatArray, period: float) -> list[Doubt]:
    """Doubts where the periods differ so much that the period must be wrong.

    Of a joint that is held there is but the noise of its encoder, which is another one in every period.
    """
    if len(stack) < 2:
        return []
    found = []
    within = stack.std(axis=(0, 1))
    between = np.sqrt(np.mean(stack.var(axis=0, ddof=1), axis=0))
    slides = np.array([joint.prismatic for joint in robot.joints])
    for i, name in enumerate(robot.joint_names):
        if between[i] > DIFFERS * within[i] and within[i] > MOVES * np.max(within[slides == slides[i]]):
            text = (
                f"{source}: q_{name} differs between periods of {period:g} s by {between[i]:.3g}, "
                f"{100 * between[i] / within[i]:.0f} % of its motion: is that the period?"
            )
            found.append(Doubt(DoubtKind.PERIOD, text))
    return found


def _motions(
    time: FloatArray,
    period: float,
    q: FloatArray,
    theta: FloatArray,
    links: int,
    motors: int,
    elastic: np.typing.NDArray[np.intp],
    places: list[int],
) -> tuple[Motion, ...]:
    """Motions (P,) from positions (P, N, n) of periods, with their places (P,) in the recording."""
    link = harmonics.differentiate_periods(q, period, links, places)
    motor = [part.copy() for part in link]
    if elastic.size:
        found = harmonics.differentiate_periods(theta[:, :, elastic], period, motors, places)
        for whole, part in zip(motor, found, strict=True):
            whole[:, :, elastic] = part
    return tuple(Motion(time, *(part[p] for part in (*link, *motor))) for p in range(len(q)))
