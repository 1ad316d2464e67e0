"""Stamps of samples that were taken evenly and stamped late, as by a logger beside a controller."""

import numpy as np
from numpy.typing import NDArray

from sea_ident._typing import FloatArray
from sea_ident.exceptions import RecordingError

ROUNDS = 5
"""Times that the grid is fitted to the stamps, at most."""

LAG = 50
"""Samples over which the interval is measured, between losses."""

LOST = 0.8
"""Spread of the stamps with samples lost, over that with none lost, from which on none are [-]."""

WITHIN = 1e-3
"""Share by which the fitted interval may differ from the one said: clocks do by less, rows that repeat by more."""

FARTHEST = 200.0
"""Intervals that a stamp may be off the grid: a logger that is busy writes late, but not that late."""


def even_stamps(time: FloatArray, interval: float, name: str) -> FloatArray:
    """Stamps moved to the even grid that lies closest to them; samples that were lost leave their place empty.

    Args:
        time: Stamps, shape (N,) [any unit].
        interval: Between samples, within a thousandth of it [the same unit]; the exact one is fitted.
        name: Of the column, for messages.

    Returns:
        Shape (N,) [the same unit].

    Raises:
        RecordingError: the stamps lie on no such grid.
    """
    places, start, exact = _grid(time, interval)
    grid: FloatArray = np.asarray(start + exact * places, dtype=np.float64)
    falls = np.flatnonzero(np.diff(time) < 0.0)
    k = int(falls[0]) if falls.size else int(np.argmax(np.abs(time - grid)))
    if falls.size or abs(exact / interval - 1.0) > WITHIN or abs(time[k] - grid[k]) > FARTHEST * exact:
        raise RecordingError(
            f"columns: time from {name!r} with interval {interval:g}: the stamps are on no even grid of that interval: "
            f"the closest has {exact:.6g}, and sample {k} at {float(time[k]):.12g} is {abs(time[k] - grid[k]):.3g} off "
            f"{'and before the one ahead of it' if falls.size else 'it'}. Give the interval in the unit of the file, "
            "or leave it out; look for rows that repeat"
        )
    return grid


def spread_of_stamps(time: FloatArray) -> tuple[NDArray[np.int64], FloatArray, float]:
    """How stamps lie around the even grid of their median interval.

    Args:
        time: Stamps, shape (N,) [s].

    Returns:
        Places on the grid, shape (N,); distances from it, shape (N,)
        [s]; the fitted interval [s].
    """
    places, start, exact = _grid(time, float(np.median(np.diff(time))))
    return places, time - (start + exact * places), exact


def _grid(time: FloatArray, interval: float) -> tuple[NDArray[np.int64], float, float]:
    """Places of samples, the first time, and the interval of the grid closest to the stamps.

    Places rise by one, or by more where samples were lost: what they are beyond the number of the sample never falls.
    Which interval it is that the clock of the stamps has is tried from several sides: one that is off by little makes
    the stamps drift off their places over a long log, which looks as if samples were lost.
    """
    from scipy.optimize import isotonic_regression

    since, number = time - time[0], np.arange(len(time), dtype=np.float64)
    lag = min(LAG, len(time) - 1)
    tried = (interval, float(np.median(since[lag:] - since[:-lag])) / lag, float(since[-1]) / (len(time) - 1))
    exact, start = (float(value) for value in np.polyfit(number, since, 1))
    spread = float(np.std(since - start - exact * number)) / exact if exact > 0.0 else np.inf
    # at both ends scatter looks like losses as well: these take evidence
    best = (LOST * spread, number, start, exact)
    for exact in tried:
        start, places = 0.0, number
        for _ in range(ROUNDS if exact > 0.0 else 0):
            beyond = isotonic_regression((since - start) / exact - number).x
            better = number + np.round(beyond)
            exact, start = (float(value) for value in np.polyfit(better, since, 1))
            if np.array_equal(better, places) or not exact > 0.0:
                break
            places = better
        spread = float(np.std(since - start - exact * places)) / exact if exact > 0.0 else np.inf
        if spread < best[0]:
            best = (spread, places, start, exact)
    _, places, start, exact = best
    return places.astype(np.int64), float(time[0]) + start, exact
