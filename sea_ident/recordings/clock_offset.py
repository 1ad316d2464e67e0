"""The offset between two clocks, from the motion of the joints that both have seen."""

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.exceptions import RecordingError
from sea_ident.recordings.recording import Recording

LEAST_CORRELATION = 0.8
"""Below this the two streams do not show the same motion."""

_KINDS = ("q", "theta")
_MOST_POINTS = 20_000


def estimate_offset(stream: Recording, reference: Recording, largest: float, where: str) -> tuple[float, float]:
    """Estimate what must be added to the times of a stream so that its motion falls onto the reference.

    Maximises the correlation of the velocities of q or theta of the joints that both streams have, over shifts of
    the linearly interpolated positions. The deflection of a spring between the two sides is part of the result:
    a delay that the joint really has cannot be told from one of the clocks.

    Args:
        stream: Signals by the clock in question.
        reference: Signals by the clock that counts.
        largest: Bound of the offset [s].
        where: Place for messages.

    Returns:
        Offset [s] and correlation at it.

    Raises:
        RecordingError: no joint in common, too little overlap, no motion, too little likeness, or an offset at
            the bound.
    """
    from scipy.optimize import minimize_scalar

    pairs = _pairs(stream, reference)
    if not pairs:
        raise RecordingError(
            f"{where}: the offset cannot be estimated: no joint has a position (q or theta) both here and in the "
            f"reference. Here are {', '.join(stream.columns)}; there are {', '.join(reference.columns)}"
        )
    if not (np.isfinite(largest) and largest > 0.0):
        raise RecordingError(f"{where}: largest_offset is {largest} s; it must be positive")
    start = max(stream.time[0], reference.time[0]) + largest
    stop = min(stream.time[-1], reference.time[-1]) - largest
    step = max(float(np.median(np.diff(stream.time))), float(np.median(np.diff(reference.time))))
    if stop - start < 10.0 * step:
        raise RecordingError(
            f"{where}: the offset cannot be estimated within +-{largest:g} s: with that taken off, the clocks overlap "
            f"for {max(stop - start, 0.0):g} s only. Choose a smaller largest_offset or state the offset"
        )
    grid = np.linspace(start, stop, int(min(_MOST_POINTS, (stop - start) / step)) + 1)
    wanted = [_changes(reference.time, reference.columns[there], grid) for _, there in pairs]

    def correlation(offset: float) -> float:
        found = [_changes(stream.time + offset, stream.columns[here], grid) for here, _ in pairs]
        return float(np.mean([_cosine(a, b) for a, b in zip(found, wanted, strict=True)]))

    count = int(min(2001, max(21, 2.0 * largest / step))) | 1
    shifts = np.linspace(-largest, largest, count)
    values = np.array([correlation(float(shift)) for shift in shifts])
    best = int(np.argmax(values))
    if values[best] < LEAST_CORRELATION:
        raise RecordingError(
            f"{where}: the offset cannot be estimated: the likeness of the velocities is at most {values[best]:.2f} "
            f"within +-{largest:g} s, where {LEAST_CORRELATION} is needed. State the offset"
        )
    if best in (0, count - 1):
        raise RecordingError(
            f"{where}: the offset is at the bound of {shifts[best]:g} s; choose a larger largest_offset"
        )
    refined = minimize_scalar(
        lambda offset: -correlation(float(offset)),
        bounds=(shifts[best - 1], shifts[best + 1]),
        method="bounded",
        options={"xatol": 1e-3 * step},
    )
    return float(refined.x), float(-refined.fun)


def _pairs(stream: Recording, reference: Recording) -> list[tuple[str, str]]:
    """Columns here and there that show the same joint moving."""
    found = []
    for name in stream.columns:
        kind, _, joint = name.partition("_")
        if kind in _KINDS:
            there = [f"{other}_{joint}" for other in (kind, *_KINDS) if f"{other}_{joint}" in reference.columns]
            if there:
                found.append((name, there[0]))
    return found


def _changes(time: FloatArray, values: FloatArray, grid: FloatArray) -> FloatArray:
    changes: FloatArray = np.diff(np.interp(grid, time, values))
    return changes - np.mean(changes)


def _cosine(a: FloatArray, b: FloatArray) -> float:
    length = float(np.sqrt((a @ a) * (b @ b)))
    return float(a @ b) / length if length > 0.0 else 0.0
