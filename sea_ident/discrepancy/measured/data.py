"""A recording as periods of equations: what every comparison of model and data starts from."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.measured.closing import SIGNALS, closing_weights, mean_of_periods
from sea_ident.effects import Contribution
from sea_ident.effects.state import Side
from sea_ident.estimation.observations import stands
from sea_ident.exceptions import DiagnosisError
from sea_ident.motion import Motion
from sea_ident.processing import ProcessedRecording, process
from sea_ident.recordings import Recording
from sea_ident.reversals import REVERSAL_SAMPLES, SLOWEST, UNCERTAIN_SIGN, around_mean_reversal
from sea_ident.robot import Robot

HIGHEST_FREQUENCY = 20.0
"""Model and data are compared up to this frequency [Hz], where the samples allow it."""

MOST_HARMONICS = 200
"""Largest number of harmonics that are compared."""

MOST_NUMBERS = 3200
"""Largest number of real coefficients that are compared, all equations together."""

REGRESSOR_MARGIN = 1.25
"""The regressor keeps at least this many times the harmonics that are compared, ..."""

WIDEST_MARGIN = 2.4
"""... and up to this many where the noise of the encoders is small: friction turns faster than what is compared."""

USED_SAMPLES = 0.8
"""Share of the harmonics that the samples have which the regressor keeps at most."""

STEP_DRAWS = 8
"""Other places of the steps of encoders that repeat in every period, for what they do to a torque."""

STEP_SEED = 1

ALIKE = 0.1
"""Combinations of samples left out that are weaker than this within the band are not freed, so that the width of a
sliding start of friction and what friction remembers of a reversal stay visible, ..."""

BARELY_SEEN = 1e-3
"""... but from this on where a model is judged: a jump of friction that falls between two samples is many times the
noise."""

MOST_LEFT_OUT = 0.6
"""Share of the samples of an equation beyond which too little is left to compare [-]."""


class EquationKind(StrEnum):
    """Which equation of a joint."""

    MOTOR = "motor"
    LINK = "link"
    SUM = "sum"


@dataclass(frozen=True)
class Equation:
    """One equation of motion: of the motor, of the link, or at a rigid joint of both together.

    Attributes:
        joint: name of the joint.
        index: its index.
        kind: which equation.
    """

    joint: str
    index: int
    kind: EquationKind


@dataclass(frozen=True, eq=False)
class PeriodData:
    """Motions and torques of P periods.

    Attributes:
        robot: the robot.
        source: where the recording came from.
        period: [s].
        motion: (N, n) mean motion.
        tau_motor: (N, n) mean motor torque [N m].
        period_motions: (P,) motion of every period.
        period_tau_motor: (P, N, n) motor torque of every period [N m].
        channels: further mean signals (N, n) by kind.
        equations: (E,) equations.
        harmonics: H, harmonics that are compared.
        reach: harmonics that the motion has.
        left_out: (N, E) samples of an equation that say nothing about a model.
        warnings: what a user should know.
        caution: how many times the usual is left out around reversals.
        alike: combinations of samples left out that are weaker than this within the band are not freed [-].
        known: (N, E) torque that is known to act beside the model, None where there is none [N m].
        places: (P,) number of every period in the recording, from 0, where some were left out; else nothing.
        step_errors: (K, 6, N, n) errors of the mean motion (q, q', q'', theta, theta', theta'') by steps of encoders
            that lie elsewhere, where these repeat in every period; None where they average out.
    """

    robot: Robot
    source: str
    period: float
    motion: Motion
    tau_motor: FloatArray
    period_motions: tuple[Motion, ...]
    period_tau_motor: FloatArray
    channels: Mapping[str, FloatArray]
    equations: tuple[Equation, ...]
    harmonics: int
    reach: int
    left_out: NDArray[np.bool_]
    warnings: tuple[str, ...] = ()
    caution: int = 1
    alike: float = ALIKE
    known: FloatArray | None = None
    places: tuple[int, ...] = ()
    step_errors: FloatArray | None = None

    @property
    def starts(self) -> FloatArray:
        """(P,) time from the start of the recording to that of every period [s]."""
        places = self.places or range(self.periods)
        return np.array(places, dtype=np.float64) * self.period

    @property
    def periods(self) -> int:
        """Number P of periods."""
        return len(self.period_tau_motor)

    @property
    def averaged(self) -> float:
        """Number of periods whose plain mean is as noisy as the mean motion and torque."""
        weights = closing_weights(self.places or range(self.periods), self.samples)
        return float(1.0 / np.mean(np.sum(weights**2, axis=1)))

    @property
    def samples(self) -> int:
        """Number N of samples of a period."""
        return len(self.motion)

    @cached_property
    def slowest(self) -> Mapping[tuple[str, Side], float]:
        """Least speed that is compared, by joint and what moves at it: the motor or the link [rad/s] or [m/s]."""
        found = {}
        for e, equation in enumerate(self.equations):
            link = equation.kind is EquationKind.LINK
            speed = np.abs((self.motion.dq if link else self.motion.dtheta)[:, equation.index])
            compared = speed[~self.left_out[:, e]]
            found[equation.joint, Side.LINK if link else Side.MOTOR] = float(compared.min(initial=np.inf))
        return found

    def rows(self, part: Contribution) -> FloatArray:
        """(N, E, ...) rows of the equations from link and motor rows (N, n, ...)."""
        return equation_rows(self.equations, part)

    def target(self, tau_motor: FloatArray) -> FloatArray:
        """(N, E) what the rows must sum up to: the motor torque, and zero in a link equation, less what is known."""
        out = np.zeros((len(tau_motor), len(self.equations)))
        if self.known is not None:
            out -= self.known
        for e, equation in enumerate(self.equations):
            if equation.kind is not EquationKind.LINK:
                out[:, e] += tau_motor[:, equation.index]
        return out


def towards(mean: Motion, motions: Sequence[Motion], share: float) -> tuple[Motion, ...]:
    """Motions with only a share of their distance from a mean of theirs."""
    return tuple(
        Motion(mean.time, *(getattr(mean, n) + share * (getattr(m, n) - getattr(mean, n)) for n in SIGNALS))
        for m in motions
    )


def equation_rows(equations: tuple[Equation, ...], part: Contribution) -> FloatArray:
    """(N, E, ...) rows of the equations from link and motor rows (N, n, ...)."""
    return np.stack([equation_row(equation, part) for equation in equations], axis=1)


def equation_row(equation: Equation, part: Contribution) -> FloatArray:
    """(N, ...) rows of one equation from link and motor rows (N, n, ...)."""
    if equation.kind is EquationKind.MOTOR:
        return part.motor[:, equation.index]
    if equation.kind is EquationKind.LINK:
        return part.link[:, equation.index]
    return part.link[:, equation.index] + part.motor[:, equation.index]


def equations_of(robot: Robot) -> tuple[Equation, ...]:
    """The equations that a recording of this robot gives."""
    found: list[Equation] = []
    for i, joint in enumerate(robot.joints):
        kinds = (EquationKind.MOTOR, EquationKind.LINK) if joint.elastic else (EquationKind.SUM,)
        found.extend(Equation(joint.name, i, kind) for kind in kinds)
    return tuple(found)


def harmonics_for(period: float, samples: int, equations: int) -> int:
    """Number of harmonics that a period of this length and this many samples is compared by."""
    by_frequency = int(HIGHEST_FREQUENCY * period)
    by_samples = int(_most(samples) / REGRESSOR_MARGIN)
    return max(min(by_frequency, by_samples, MOST_HARMONICS, MOST_NUMBERS // (2 * equations)), 1)


def _most(samples: int) -> float:
    """Harmonics of a period of this many samples that are used at most."""
    return USED_SAMPLES * (samples - 1) / 2


def wide_processing(
    recording: Recording | ProcessedRecording, robot: Robot, period: float | None
) -> ProcessedRecording:
    """The recording with a regressor that reaches beyond the harmonics that are compared.

    At a reversal friction jumps, and acceleration with it. A velocity without its high harmonics misses that corner,
    and friction with it, in all samples nearby. How many harmonics can be kept is limited by the noise of the
    encoders, which must not blur the sign of a velocity among samples that are used.

    Raises:
        RecordingError: if it lacks what is needed.
    """
    if isinstance(recording, ProcessedRecording):
        return recording
    first = process(recording, robot, period=period)
    if first.period is None:
        return first
    compared = harmonics_for(first.period, first.samples, len(equations_of(robot)))
    least = int(REGRESSOR_MARGIN * compared)
    most = max(min(int(WIDEST_MARGIN * compared), int(_most(first.samples))), least)
    wide = process(recording, robot, period=first.period, link_harmonics=most, motor_harmonics=most)
    blurred = _blur(wide)
    if blurred <= 1.0 or most == least:
        return wide
    # the power of white noise in a velocity grows with the third power of the bandwidth
    fewer = max(int(most * blurred ** (-2.0 / 3.0)), least)
    return process(recording, robot, period=first.period, link_harmonics=fewer, motor_harmonics=fewer)


def scatter_of_passes(passes: FloatArray) -> FloatArray:
    """(n,) standard deviation of a signal (P, N, n) from pass to pass, whatever drifts: the median over a period."""
    scatter: FloatArray = np.median(np.std(np.diff(passes, axis=0), axis=0), axis=0) / np.sqrt(2.0)
    return scatter


def _blur(processed: ProcessedRecording) -> float:
    """Largest error of a velocity in a period, in units of what may be uncertain of its sign [-].

    What it scatters by between periods, and what steps of encoders do to it in every period alike.
    """
    motions = processed.period_motions
    if len(motions) < 2 or processed.period is None:
        return 1.0
    largest, errors = 0.0, _step_errors(processed, processed.motion, processed.period)
    for name in ("dq", "dtheta"):
        speeds = np.stack([getattr(motion, name) for motion in motions])
        scatter = scatter_of_passes(speeds)
        if errors is not None:
            scatter = np.hypot(scatter, np.sqrt(np.mean(errors[:, SIGNALS.index(name)] ** 2, axis=(0, 1))))
        rms = np.sqrt(np.mean(speeds**2, axis=(0, 1)))
        moving = rms > 0.0
        largest = max(largest, float(np.max(UNCERTAIN_SIGN * scatter[moving] / (SLOWEST * rms[moving]), initial=0.0)))
    return largest


def period_data(processed: ProcessedRecording, robot: Robot) -> PeriodData:
    """The periods of a processed recording.

    Raises:
        DiagnosisError: if it belongs to other joints, or is not periodic.
    """
    if processed.joint_names != robot.joint_names:
        raise DiagnosisError(
            f"{processed.source} was processed for the joints {', '.join(processed.joint_names)}; "
            f"{robot.name} has {', '.join(robot.joint_names)}"
        )
    if processed.period is None:
        raise DiagnosisError(f"{processed.source} is not periodic")
    least = min(processed.link_harmonics, processed.motor_harmonics)
    motions = processed.period_motions or (processed.motion,)
    places = processed.places or tuple(range(len(motions)))
    motion, tau_motor = mean_of_periods(motions, processed.period_tau_motor, places)
    harmonics = min(
        harmonics_for(processed.period, processed.samples, len(equations_of(robot))),
        max(int(least / REGRESSOR_MARGIN), 1),
    )
    errors = _step_errors(processed, motion, processed.period)
    equations = equations_of(robot)
    left_out = around_reversals(motion, equations, processed.period_motions, errors)
    stood = stands(robot, processed)
    left_out[:, [stood[eq.index] and eq.kind is not EquationKind.LINK for eq in equations]] = True
    return PeriodData(
        robot=robot,
        source=processed.source,
        period=processed.period,
        motion=motion,
        tau_motor=tau_motor,
        period_motions=motions,
        period_tau_motor=processed.period_tau_motor,
        channels=processed.channels,
        equations=equations,
        harmonics=harmonics,
        reach=max(processed.link_harmonics, processed.motor_harmonics),
        left_out=left_out,
        warnings=processed.warnings,
        places=processed.places,
        step_errors=errors,
    )


def _step_errors(processed: ProcessedRecording, motion: Motion, period: float) -> FloatArray | None:
    """(K, 6, N, n) errors of the mean motion by steps of its encoders that lie elsewhere, where these repeat."""
    steps = processed.encoder_steps
    if steps is None:
        return None
    rng = np.random.default_rng(STEP_SEED)
    harmonics = processed.link_harmonics, processed.motor_harmonics
    return np.stack([steps.another(motion, period, harmonics, rng) for _ in range(STEP_DRAWS)])


def around_reversals(
    motion: Motion,
    equations: tuple[Equation, ...],
    periods: tuple[Motion, ...] = (),
    errors: FloatArray | None = None,
    *,
    samples: int = REVERSAL_SAMPLES,
    uncertain: float = UNCERTAIN_SIGN,
) -> NDArray[np.bool_]:
    """(N, E) whether a motor (in its own equation a link) is about to reverse: see `around_mean_reversal`.

    Errors (K, 6, N, n) of the mean are in all periods.
    """
    left_out = np.zeros((len(motion), len(equations)), dtype=np.bool_)
    for e, equation in enumerate(equations):
        kind = "dq" if equation.kind is EquationKind.LINK else "dtheta"
        speed, *each = (getattr(m, kind)[:, equation.index] for m in (motion, *periods))
        repeated = None if errors is None else errors[:, SIGNALS.index(kind), :, equation.index]
        left_out[:, e] = around_mean_reversal(speed, each, repeated, samples=samples, uncertain=uncertain)
    return left_out


def away_from_reversals(data: PeriodData, caution: int = 2) -> PeriodData:
    """The same periods with more left out around every reversal.

    What is said of a model must hold there too: at reversals, the mean of what differs from pass to pass, and the
    time of a sample within its interval, look like small effects of friction and of delay.

    Where a period has few samples, those beside its reversals are most of them: then only what is slow counts.

    Args:
        data: the periods.
        caution: how many times the usual is left out.
    """

    def wide(samples: int) -> NDArray[np.bool_]:
        """(N, E) what is left out, so many samples beside a reversal at least."""
        motion, periods, errors = data.motion, data.period_motions, data.step_errors
        slow = caution * UNCERTAIN_SIGN
        return data.left_out | around_reversals(
            motion, data.equations, periods, errors, samples=samples, uncertain=slow
        )

    left_out = wide(caution * REVERSAL_SAMPLES)
    lost = (np.mean(left_out, axis=0) > MOST_LEFT_OUT) & (np.mean(data.left_out, axis=0) <= MOST_LEFT_OUT)
    return replace(data, left_out=wide(REVERSAL_SAMPLES) if np.any(lost) else left_out, caution=caution)


def spectrum(values: FloatArray, harmonics: int) -> NDArray[np.complex128]:
    """Fourier coefficients of one period of real signals.

    Args:
        values: (N, ...) samples.
        harmonics: H.

    Returns:
        (H + 1, ...) coefficients, scaled so that the squares of their moduli sum up to the mean square of the part of
        the signal within the band.
    """
    coefficients = np.fft.rfft(values, axis=0)[: harmonics + 1] / len(values)
    coefficients[1:] *= np.sqrt(2.0)
    return np.asarray(coefficients, dtype=np.complex128)


def waveform(coefficients: NDArray[np.complex128], samples: int) -> FloatArray:
    """(N, ...) samples from the coefficients of `spectrum`: the inverse of it within the band."""
    full = np.zeros((samples // 2 + 1, *coefficients.shape[1:]), dtype=np.complex128)
    full[: len(coefficients)] = coefficients * samples
    full[1 : len(coefficients)] /= np.sqrt(2.0)
    return np.asarray(np.fft.irfft(full, samples, axis=0), dtype=np.float64)
