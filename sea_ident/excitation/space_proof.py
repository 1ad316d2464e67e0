"""Proof that rooms in space stay open at all times, by interval bisection.

Between two times h apart a room that changes no faster than s stays above ``(first + last - s h) / 2``. Intervals in
which that is not enough are halved, so that the proof is fine where a limit is nearly reached and coarse elsewhere.
"""

from collections.abc import Callable

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.excitation.curvature_bounds import MotionBounds
from sea_ident.excitation.space_limits import SpaceLimits
from sea_ident.motion import Motion

# of the size of the robot: what the proof may take of a room that is nearly used up
TOLERANCE = 3e-4
_FAR = 0.02  # of the size: rooms above it need not be known better
_FEWEST = 128
_MOST = 60_000  # times
_CHUNK = 2000


def proven_rooms(
    limits: SpaceLimits, motion: Callable[[FloatArray], Motion], duration: float, bounds: MotionBounds
) -> FloatArray:
    """Rooms that are kept at all times.

    Args:
        limits: half-spaces and self-collision.
        motion: the motion at given times.
        duration: from 0 to this time [s].
        bounds: of the motion.

    Returns:
        (r,) room that is not undercut [m]; of links that stay far apart at least so much.
    """
    count = len(limits)
    if not count:
        return np.zeros(0)
    levers = limits.levers(bounds.derivatives[0]) @ np.abs(limits.chain.map)  # (r, n)
    steepest = bounds.derivatives[2]
    tolerance, far = TOLERANCE * limits.size, _FAR * limits.size

    def at(time: FloatArray, wanted: FloatArray | None) -> tuple[FloatArray, FloatArray]:
        rooms, speeds = [], []
        for start in range(0, len(time), _CHUNK):
            part = motion(time[start : start + _CHUNK])
            rooms.append(limits.rooms(part.q, None if wanted is None else wanted[start : start + _CHUNK]))
            speeds.append(np.abs(part.dq))
        return np.concatenate(rooms), np.concatenate(speeds)

    time = np.linspace(0.0, duration, _FEWEST + 1)
    rooms, speeds = at(time, None)
    seen, proven, used = rooms.min(axis=0), np.full(count, np.inf), len(time)
    begin, step = time[:-1], duration / _FEWEST
    first, last, slow, fast = rooms[:-1], rooms[1:], speeds[:-1], speeds[1:]
    live = np.ones(first.shape, dtype=bool)
    while True:
        # no joint is faster in between than when it speeds up as hard as it can from both ends
        change = (0.5 * (slow + fast + step * steepest)) @ levers.T
        floor = 0.5 * (first + last - step * change)
        enough = ~live | (floor >= np.minimum(seen - tolerance, far))
        split = ~np.all(enough, axis=1)
        out_of_time = used + np.count_nonzero(split) > _MOST
        closed = live if out_of_time else live & enough
        proven = np.minimum(proven, np.where(closed, floor, np.inf).min(axis=0))
        if out_of_time or not np.any(split):
            rooms_kept: FloatArray = np.minimum(proven, seen)
            return rooms_kept
        begin, first, last = begin[split], first[split], last[split]
        slow, fast, live = slow[split], fast[split], (live & ~enough)[split]
        middle, speed = at(begin + 0.5 * step, live)
        used += len(begin)
        seen = np.minimum(seen, np.where(live, middle, np.inf).min(axis=0))
        step *= 0.5
        begin = np.concatenate([begin, begin + step])
        first, last = np.concatenate([first, middle]), np.concatenate([middle, last])
        slow, fast = np.concatenate([slow, speed]), np.concatenate([speed, fast])
        live = np.concatenate([live, live])
