"""Springs of robots that measure the spring torque: no dynamic model is needed."""

import warnings as python_warnings
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sea_ident.estimation.circularity import circular_factor, circular_note
from sea_ident.estimation.spring_result import SpringResult, Verdict
from sea_ident.estimation.springs import spring_from_torque
from sea_ident.exceptions import RecordingError, SeaIdentWarning
from sea_ident.motion import Motion
from sea_ident.one_thread import one_thread
from sea_ident.processing import filtering
from sea_ident.recordings import Recording
from sea_ident.robot import Robot


@one_thread
def identify_measured_springs(
    robot: Robot,
    recording: Recording,
    *,
    unknown_zero: Sequence[str] = (),
    cutoff: float | None = None,
) -> tuple[SpringResult, ...]:
    """Identify springs from a torque channel `tau_spring_<joint>` of the recording.

    Many series-elastic drives have no torque sensor: their "torque" is a stiffness times the deflection. A fit then
    returns that stiffness and proves nothing; where the numbers show it, the verdict is `circular`.

    Args:
        robot: the robot.
        recording: with q, theta and tau_spring of at least one elastic joint.
        unknown_zero: joints whose encoders of theta and q have different, unknown zeros.
        cutoff: of the zero-phase filter of q and theta [Hz]; chosen from the data where None.

    Returns:
        One result per elastic joint with a torque channel. Standard deviations rest on the correlation of the residual.

    Raises:
        RecordingError: no elastic joint has a torque channel, or a column is missing.
    """
    names = [robot.joint_names[i] for i in robot.elastic_indices]
    measured = [name for name in names if recording.has("tau_spring", name)]
    if not measured:
        raise RecordingError(
            f"{recording.source}: no column tau_spring_<joint> of an elastic joint "
            f"({', '.join(names) or 'there is none'})"
        )
    count = len(measured)
    interval = recording.duration / (recording.samples - 1)
    grid = np.linspace(recording.time[0], recording.time[-1], recording.samples)
    raw = np.concatenate([recording.channel(kind, measured) for kind in ("q", "theta", "tau_spring")], axis=1)
    even = np.stack([np.interp(grid, recording.time, column) for column in raw.T], axis=1)
    positions, torque = even[:, : 2 * count], even[:, 2 * count :]
    frequency = cutoff or filtering.choose_cutoff(positions, interval)
    smooth = filtering.zero_phase(positions, interval, frequency, recording.source)
    rate = filtering.central_difference(smooth, interval)
    acceleration = filtering.central_difference(rate, interval)
    motion = Motion(
        grid,
        *(table[:, :count] for table in (smooth, rate, acceleration)),
        *(table[:, count:] for table in (smooth, rate, acceleration)),
    )
    results = []
    for k, name in enumerate(measured):
        result = spring_from_torque(name, k, motion, torque[:, k], name in unknown_zero)
        factor = circular_factor([raw[:, count + k] - raw[:, k], motion.deflection[:, k]], [raw[:, 2 * count + k]])
        if factor is not None:
            result = replace(result, verdict=Verdict.CIRCULAR, note=circular_note(factor))
            python_warnings.warn(f"{recording.source}: {name}: {result.note}", SeaIdentWarning, stacklevel=3)
        results.append(result)
    return tuple(results)
