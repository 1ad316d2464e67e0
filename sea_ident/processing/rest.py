"""Rest before and after a motion: found, so that no period holds it."""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from sea_ident._typing import FloatArray
from sea_ident.processing.encoder_steps import step_of
from sea_ident.recordings import Recording
from sea_ident.robot import Robot

SHORTEST = 0.5
"""Duration of rest that is looked for [s]: what stands still for less does not hide a period."""

FEWEST = 20
"""Samples of such rest at least."""

STILL = 0.02
"""Share of the range of its motion by which a position at rest varies in that time: more than its noise and steps, for
what has stopped creeps on for seconds where friction and gravity move the springs."""

LONGER = 1.5
"""Duration of rest over that of the longest standstill within the motion: dwells of every period belong to it."""

REPEATS = 3.0
"""Difference to the period before, over the usual one, up to which a motion has not begun to stop ..."""

STEPS = 2.0
"""... and in steps of the encoder, of which usual differences may have none."""


def without_rest(recording: Recording, robot: Robot) -> Recording:
    """The part of a recording from where its motion begins to where it ends.

    A robot rests where all positions stand still, and their references too.

    Args:
        recording: the recording, with q of every joint and theta of every elastic one.
        robot: the robot.

    Returns:
        The part; the recording itself where it rests at neither end.
    """
    values, window = _positions(recording, robot), _window(recording)
    samples = len(values)
    largest = STILL * np.ptp(values, axis=0)
    ends = values[:window], values[-window:]
    if samples < 4 * window or not any(np.all(np.ptp(end, axis=0) <= largest) for end in ends):
        return recording
    still = _within(values, largest, window)
    if np.all(still):
        return recording
    moving = np.flatnonzero(~still)
    # of samples that only windows at rest hold, the last at the beginning and the first at the end belong to the motion
    head, tail = int(moving[0]), len(still) - 1 - int(moving[-1])
    inside = np.diff(moving).max(initial=1) - 1
    dwell = LONGER * (inside + window - 1) if inside else 0.0
    first = head - 1 + window - 1 if head and head + window - 1 > dwell else 0
    last = samples - (tail - 1 + window - 1) if tail and tail + window - 1 > dwell else samples
    if (first, last) == (0, samples):
        return recording
    return recording.crop(float(recording.time[first]), float(recording.time[last - 1]))


def without_stop(moving: Recording, robot: Robot, period: float) -> Recording:
    """The part of a motion before it slows down to rest: what does not repeat any more is no part of a period.

    Args:
        moving: a recording that ends where the motion does.
        robot: the robot.
        period: [s].

    Returns:
        The part; the recording itself where it has less than four periods, or where no end of it repeats.
    """
    values, window = _positions(moving, robot), _window(moving)
    lag = round(period * (moving.samples - 1) / moving.duration)
    if lag < 1 or moving.samples < 4 * lag:
        return moving
    if not moving.is_uniform:
        grid = np.linspace(moving.time[0], moving.time[-1], moving.samples)
        values = np.stack([np.interp(grid, moving.time, column) for column in values.T], axis=1)
    difference = np.abs(values[lag:] - values[:-lag])
    # the first period is where motions begin, the last where they stop
    usual = REPEATS * np.percentile(difference[lag:-lag], 99.0, axis=0)
    usual = np.maximum(usual, [STEPS * step_of(column) for column in values.T])
    late = np.flatnonzero(np.any(difference > usual, axis=1))
    edges = np.concatenate([[-1], late, [len(difference)]])
    long = np.flatnonzero(np.diff(edges) > window)
    return moving.crop(None, float(moving.time[lag + int(edges[long[-1] + 1]) - 1])) if long.size else moving


def _positions(recording: Recording, robot: Robot) -> FloatArray:
    """(M, k) positions of all encoders and references."""
    columns = [recording.channel("q", robot.joint_names)]
    columns.append(recording.channel("theta", [robot.joint_names[i] for i in robot.elastic_indices]))
    for kind in ("q_reference", "theta_reference"):
        columns.append(recording.channel(kind, [name for name in robot.joint_names if recording.has(kind, name)]))
    return np.concatenate(columns, axis=1)


def _window(recording: Recording) -> int:
    """Samples of the shortest rest."""
    return max(round(SHORTEST * recording.sample_rate), FEWEST)


def _within(values: FloatArray, largest: FloatArray, window: int) -> NDArray[np.bool_]:
    """(M - window + 1,) whether all signals (M, k) stay within a range (k,) over the window that begins there."""
    begin = window // 2
    stop = begin + len(values) - window + 1
    still = np.ones(stop - begin, dtype=np.bool_)
    for column, width in zip(values.T, largest, strict=True):
        spread = maximum_filter1d(column, window)[begin:stop] - minimum_filter1d(column, window)[begin:stop]
        still &= spread <= width
    return still
