"""Pushes from outside in a recording: what happens once, where everything that a model lacks happens in every pass."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation, uniform_filter1d

from sea_ident._typing import FloatArray

WINDOW = 0.005
"""A push is looked for in means over this time [s]."""

SIGNIFICANT = 10.0
"""Robust standard deviations that the mean over a window must be away from the usual."""

LAST_SHARE = 0.2
"""A push lasts while the residual is beyond this share of the threshold ..."""

APART = 0.1
"""... and with gaps of no more than this within [s]."""

FEWEST_PASSES = 3
"""Passes of the same motion from which on what repeats is told from what does not."""

REVERSAL = 0.05
"""Time around a reversal in which no push is looked for where nothing repeats [s]."""

AT_AN_END = 0.05
"""Time at the beginning and at the end of a recording in which no push is looked for: what is filtered and
differentiated has data on one side only not far from there [s]."""

SHORTEST = 0.01
"""What departs for less than this is a spike of a sensor or the instant of a jump of friction, no push [s]."""

CLEAR_AT_REVERSAL = 0.06
"""Around a reversal friction that differs from pass to pass departs while the joint hardly moves, and for up to this
beyond [s]: what is shorter counts only beside pushes that are clear, ..."""

AS_LONG = 0.5
"""... and where it lasts at least for this share of the shortest of them [-]."""

SLOW = 0.02
"""Share of the rms speed of a joint below which it hardly moves."""

DEPARTURE_LEVEL = 1e-3
"""Probability below which the strongest departure at a joint is none of the usual ones, with tails as heavy as
exponential ones."""

MANY, MOST = 5, 0.5
"""Of so many departures at a joint no more than this share may peak beside reversals: else friction there differs from
pass to pass, and some of it lasts."""

LONGEST = 0.25
"""Share of the recording that pushes at a joint may take; beyond it the residual is no push but a poor model."""


@dataclass(frozen=True)
class Push:
    """A push at a joint.

    Attributes:
        joint: index of the joint.
        start: [s].
        stop: [s].
        force: largest mean over a window, with its sign [N m] or [N].
        impulse: integral over the push [N m s] or [N s].
        z: the force in robust standard deviations of the residual elsewhere.
    """

    joint: int
    start: float
    stop: float
    force: float
    impulse: float
    z: float


def find_pushes(
    time: FloatArray,
    residual: FloatArray,
    speed: FloatArray,
    pass_samples: int = 0,
    least: FloatArray | float = 0.0,
) -> tuple[Push, ...]:
    """Find where a residual departs for a short time from what it is otherwise.

    Where the motion repeats itself, the median over the passes is taken off first: friction at reversals and whatever
    else the model lacks comes again in every pass, a push does not. Around reversals, where friction differs from pass
    to pass, only what lasts is a push by itself. Where the motion does not repeat itself, the time around
    reversals is left aside instead.

    Args:
        time: (N,) evenly spaced [s].
        residual: (N, n) measured less modelled torque.
        speed: (N, n) of the joints.
        pass_samples: samples of one pass of a motion that repeats itself, 0 where it does not.
        least: (n,) force that matters; what is smaller is none, however quiet the residual is else [N m] or [N].

    Returns:
        Pushes in the order of time.
    """
    least = np.broadcast_to(least, residual.shape[1:])
    interval = float(time[1] - time[0])
    window = max(1, round(WINDOW / interval))
    repeats = pass_samples > 0 and len(time) >= FEWEST_PASSES * pass_samples
    own = residual - repeated(residual, pass_samples) if repeats else residual
    found: list[Push] = []
    for i in range(residual.shape[1]):
        smooth = uniform_filter1d(own[:, i], window)
        usable = (time - time[0] >= AT_AN_END) & (time[-1] - time >= AT_AN_END)
        slow = np.abs(speed[:, i]) < SLOW * float(np.sqrt(np.mean(speed[:, i] ** 2)))
        reversing = _near_reversal(speed[:, i], slow, round(REVERSAL / interval))
        if not repeats:
            usable &= ~reversing
            # slow misfit is not a push
            smooth = smooth - _slow(smooth, usable, max(window, round(0.5 / interval)))
        found.extend(_runs(i, time, own[:, i], smooth, usable, slow, reversing, float(least[i])))
    return tuple(sorted(found, key=lambda p: p.start))


def repeated(values: FloatArray, pass_samples: int) -> FloatArray:
    """(N, n) median over all passes at the same phase."""
    count = len(values)
    passes = -(-count // pass_samples)
    padded = np.full((passes * pass_samples, values.shape[1]), np.nan)
    padded[:count] = values
    middle = np.nanmedian(padded.reshape(passes, pass_samples, -1), axis=0)
    out: FloatArray = np.tile(middle, (passes, 1))[:count]
    return out


def pushed(pushes: tuple[Push, ...], time: FloatArray, joint: int, margin: float) -> NDArray[np.bool_]:
    """(N,) whether a joint is pushed, or was within `margin` [s]."""
    out = np.zeros(len(time), dtype=np.bool_)
    for push in pushes:
        if push.joint == joint:
            out |= (time >= push.start - margin) & (time <= push.stop + margin)
    return out


def _slow(values: FloatArray, usable: NDArray[np.bool_], around: int) -> FloatArray:
    """(N,) running mean of what is usual: without reversals, and in a second round without what stands out of it."""
    slow, quiet = np.zeros_like(values), usable
    for _ in range(2):
        share = uniform_filter1d(quiet.astype(np.float64), around)
        slow = uniform_filter1d(np.where(quiet, values, 0.0), around) / np.maximum(share, 1.0 / around)
        away = np.abs(values - slow)
        quiet = usable & (away < LAST_SHARE * SIGNIFICANT * np.median(away[usable]) / 0.6745)
    return np.asarray(slow, dtype=np.float64)


def departure_p(z: float, samples: int) -> float:
    """Probability of such a departure in so many samples if its tails are as heavy as exponential ones."""
    return float(min(1.0, samples * np.exp(-z * np.log(2.0) / 0.6745)))


def _near_reversal(speed: FloatArray, slow: NDArray[np.bool_], reach: int) -> NDArray[np.bool_]:
    crossing = np.sign(speed) != np.sign(np.roll(speed, 1))
    return np.asarray(binary_dilation(slow | crossing, iterations=max(reach, 1)), dtype=np.bool_)


def _runs(
    joint: int,
    time: FloatArray,
    own: FloatArray,
    smooth: FloatArray,
    usable: NDArray[np.bool_],
    slow: NDArray[np.bool_],
    reversing: NDArray[np.bool_],
    least: float,
) -> list[Push]:
    interval = float(time[1] - time[0])
    if np.count_nonzero(usable) < 16:
        return []
    spread = max(float(np.median(np.abs(smooth[usable])) / 0.6745), least / SIGNIFICANT)
    if spread <= 0.0:
        return []
    high = usable & (np.abs(smooth) > SIGNIFICANT * spread)
    if not np.any(high):
        return []
    gap = max(1, round(APART / interval / 2.0))
    low = usable & (np.abs(smooth) > LAST_SHARE * SIGNIFICANT * spread)
    near = binary_dilation(high, iterations=gap)
    joined = binary_dilation(low & near, iterations=max(1, gap // 4))
    edges = np.flatnonzero(np.diff(np.concatenate([[0], joined.astype(int), [0]])))
    found: list[Push] = []
    doubtful: list[Push] = []
    shortest, beside = np.inf, 0
    for first, last in zip(edges[::2], edges[1::2], strict=True):
        inside = np.flatnonzero((low & near)[first:last]) + first
        if not np.any(high[first:last]):
            continue
        peak = int(inside[np.argmax(np.abs(smooth[inside]))])
        # from where it clearly pushes, as far as it does without a break
        begin = int(first + np.argmax(high[first:last]))
        while begin > 0 and low[begin - 1]:
            begin -= 1
        end = int(last - 1 - np.argmax(high[first:last][::-1]))
        while end + 1 < len(low) and low[end + 1]:
            end += 1
        length = float(time[end] - time[begin]) + 0.5 * interval
        if length < SHORTEST:
            continue
        span = slice(begin, end + 1)
        z = float(abs(smooth[peak]) / spread)
        moving = length - interval * np.count_nonzero(slow[span])
        beside += int(reversing[peak])
        impulse = float(own[span].sum() * interval)
        found.append(Push(joint, float(time[begin]), float(time[end]), float(smooth[peak]), impulse, z))
        at_friction = reversing[peak] and moving < CLEAR_AT_REVERSAL
        if at_friction:
            doubtful.append(found[-1])
        elif departure_p(z, len(time)) < DEPARTURE_LEVEL:
            shortest = min(shortest, found[-1].stop - found[-1].start)
    friction = len(found) >= MANY and beside > MOST * len(found)
    if friction or shortest == np.inf or sum(p.stop - p.start for p in found) > LONGEST * (time[-1] - time[0]):
        return []
    return [p for p in found if p not in doubtful or p.stop - p.start >= AS_LONG * shortest]
