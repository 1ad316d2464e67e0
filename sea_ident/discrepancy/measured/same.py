"""Whether a held-out recording is the recording itself, under another name or start, or the same motion again."""

import numpy as np
from scipy.signal import resample

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.measured.data import PeriodData
from sea_ident.exceptions import DiagnosisError
from sea_ident.processing import ProcessedRecording
from sea_ident.processing.variance import noise_from_curvature
from sea_ident.recordings import Recording

SHARED = 0.5
"""Share of the samples of the shorter recording in common from which on it is part of the other."""

NOISE = 0.3
"""Times the noise within which two signals are copies of each other; the noise of two measurements differs by 1.4."""

FEWEST = 64
"""Samples that two recordings must have in common to be compared one beside the other."""

RUNS_DIFFER = 0.1
"""Part of the motion of a motor by which two runs of one motion may differ [-]."""

SAME_PERIOD = 0.01
"""Part of a period by which those of two runs of one motion may differ [-]."""


def same_motion(recording: PeriodData, holdout: PeriodData) -> bool:
    """Whether the periods of two recordings are those of one motion, wherever in it they begin."""
    if abs(holdout.period - recording.period) > SAME_PERIOD * recording.period:
        return False
    samples = max(recording.samples, holdout.samples)
    first, second = (resample(data.motion.theta, samples) for data in (recording, holdout))
    ranges = np.maximum(np.std(first, axis=0), 1e-300)
    one, other = (np.fft.rfft((theta - theta.mean(axis=0)) / ranges, axis=0) for theta in (first, second))
    alike = np.fft.irfft(one * np.conj(other), samples, axis=0)
    apart = np.sqrt(np.mean((first - np.roll(second, int(np.argmax(alike.sum(axis=1))), axis=0)) ** 2, axis=0))
    return bool(np.all(apart < RUNS_DIFFER * ranges))


def not_the_same(recording: Recording | ProcessedRecording, holdout: Recording | ProcessedRecording) -> None:
    """Refuse the same data given twice.

    Equal samples show it in any order; samples that are equal but for their last digits (a file that was written once
    more) show it where the noise of the two is the same.

    Raises:
        DiagnosisError: they are the same, or one holds the other.
    """
    first, second = _signals(recording, holdout)
    shorter = min(len(first), len(second))
    if not shorter or not first.shape[1]:
        return
    common = max(_equal_samples(first, second), _copied_samples(first, second))
    if common > SHARED * shorter:
        raise DiagnosisError(
            f"the held-out recording {holdout.source} is the recording {recording.source} itself ({common} of "
            f"{shorter} samples are the same): it proves nothing. Record another motion, or leave it out"
        )


def _signals(
    recording: Recording | ProcessedRecording, holdout: Recording | ProcessedRecording
) -> tuple[FloatArray, FloatArray]:
    """(M, k) and (L, k) of what both hold, in the same order; the torque first."""
    if isinstance(recording, Recording) and isinstance(holdout, Recording):
        kinds = ("tau_motor_", "current_", "q_", "theta_")
        names = [n for kind in kinds for n in sorted(recording.columns) if n.startswith(kind) and n in holdout.columns]
        names = [n for n in names if "_reference_" not in n]
        if not names:
            return np.empty((0, 0)), np.empty((0, 0))
        first, second = (np.stack([part.columns[n] for n in names], axis=1) for part in (recording, holdout))
        return first, second
    if isinstance(recording, ProcessedRecording) and isinstance(holdout, ProcessedRecording):
        first, second = (
            np.asarray(part.period_tau_motor).reshape(-1, len(part.joint_names)) for part in (recording, holdout)
        )
        return first, second
    return np.empty((0, 0)), np.empty((0, 0))


def _equal_samples(first: FloatArray, second: FloatArray) -> int:
    """How many samples of the shorter one are samples of the longer one, wherever they are."""
    short, long = sorted((first, second), key=len)
    rows = {row.tobytes() for row in np.ascontiguousarray(long)}
    return sum(row.tobytes() in rows for row in np.ascontiguousarray(short))


def _copied_samples(first: FloatArray, second: FloatArray) -> int:
    """How many samples differ by less than the noise, side by side at the lag at which the noise is most alike."""
    moving = (np.ptp(first, axis=0) > 0.0) & (np.ptp(second, axis=0) > 0.0)
    first, second = first[:, moving], second[:, moving]
    if min(len(first), len(second)) < FEWEST or not first.shape[1]:
        return 0
    lag = _lag(np.diff(first, 2, axis=0), np.diff(second, 2, axis=0))
    begin = max(0, lag)
    length = min(len(first) - begin, len(second) - max(0, -lag))
    if length < FEWEST:
        return 0
    a, b = first[begin : begin + length], second[max(0, -lag) :][:length]
    apart = np.mean((a - b) ** 2, axis=0)
    return length if np.all(apart < NOISE**2 * noise_from_curvature(a)) else 0


def _lag(first: FloatArray, second: FloatArray) -> int:
    """Sample of the first at which the second begins, by the largest correlation of what is fast in all signals."""
    size = 1 << int(np.ceil(np.log2(len(first) + len(second))))
    total = np.zeros(size)
    for a, b in zip(first.T, second.T, strict=True):
        scale = float(np.linalg.norm(a) * np.linalg.norm(b))
        if scale > 0.0:
            total += np.fft.irfft(np.fft.rfft(a, size) * np.conj(np.fft.rfft(b, size)), size) / scale
    best = int(np.argmax(total))
    return best if best < len(first) else best - size
