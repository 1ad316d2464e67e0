"""Encoders that stand still, jump, lose counts or are held between samples: told by what they show."""

import numpy as np
from numpy.typing import NDArray

from sea_ident._typing import FloatArray
from sea_ident.processing.doubt import say_column
from sea_ident.robot import Joint

HARDLY = 0.1
"""Motion of a motor as a share of that of its link up to which it may be held [-], and its encoder stand still."""

STILL = 20
"""Equal samples in a row from which on an encoder stands still."""

MOVED = 0.1
"""Share of the range of a position by which it does not move unseen, or within a sample."""

FEW_COUNTS = 20
"""Steps of an encoder up to which a joint does not move that stands still and then makes one."""

TURNS = (2.0 * np.pi, 360.0, 400.0, 1.0, 1000.0, *(2.0**bits for bits in range(8, 33)))
"""Spans after which encoders start again, in the units of files."""

TURN_WITHIN = 0.03
"""Deviation from one of them up to which it is recognised: a motion goes on within the sample [-]."""

MOST_SLIPS = 3
"""Steps of a deflection up to which they are lost turns."""

FEWEST_CHANGES = 50
"""Changes of a signal from which on their rhythm is looked at."""

REGULAR = 0.9
"""Share of changes equally far apart from which on a signal was held between samples; an encoder's depend on speed."""

LASTING = 0.05
"""Share of a recording before and after a step of a deflection from which on it may be a lasting one [-], ..."""

STAYS = 0.5
"""... and share of the step that its levels may differ by from it, and that the deflection must move less than twice
as far as [-]."""

FASTER = 6.0
"""Speed over that of the faster tenth of the samples from which on a step is a jump."""


def held(time: FloatArray, name: str, values: FloatArray) -> list[str]:
    """Whether a signal was sampled at a lower rate, and each value held until the next."""
    changes = np.flatnonzero(np.diff(values) != 0.0)
    if changes.size < FEWEST_CHANGES:
        return []
    apart = np.diff(changes)
    usual = int(np.median(apart))
    if usual < 2 or np.mean(np.abs(apart - usual) <= (1 if usual >= 4 else 0)) < REGULAR:
        return []
    interval = float(np.median(np.diff(time)))
    return [
        f"{name} changes at every {usual}th sample only, each {1e3 * usual * interval:.3g} ms: it was sampled at "
        f"{1.0 / (usual * interval):.4g} Hz and held, so that it is late by up to that. Give the samples that it has "
        "with a time of their own (ColumnSource(..., time=...), in a format with columns of different length)"
    ]


def stands_still(
    time: FloatArray, name: str, values: FloatArray, joint: Joint, partner: tuple[str, FloatArray] | None
) -> list[str]:
    """Whether an encoder stands still while the other one of its joint moves, or jumps when it comes back."""
    steps = np.abs(np.diff(values))
    if np.ptp(values) <= FEW_COUNTS * np.min(steps[steps > 0.0], initial=np.inf):
        return []  # it is held, or constant, which is said elsewhere
    if partner is not None and np.ptp(values) < HARDLY * np.ptp(partner[1]):
        return []
    ends = np.flatnonzero(np.concatenate([np.diff(values) != 0.0, [True]]))
    starts = np.concatenate([[0], ends[:-1] + 1])
    for k in np.argsort(starts - ends, kind="stable")[:5]:
        first, last = int(starts[k]), int(ends[k])
        if last - first + 1 < STILL:
            break
        moves = None
        if partner is not None and np.ptp(partner[1][first : last + 1]) > MOVED * np.ptp(partner[1]):
            moves = f"while {partner[0]} moves by {np.ptp(partner[1][first : last + 1]):.3g} {joint.position_unit}"
        elif last + 1 < len(values) and abs(values[last + 1] - values[last]) > MOVED * np.ptp(values):
            moves = f"and then jumps by {values[last + 1] - values[last]:.3g} {joint.position_unit}"
        if moves is not None:
            return [
                f"{name} stands still at {values[first]:.6g} {joint.position_unit} for {last - first + 1} samples from "
                f"sample {first} (time {time[first]:g} s) {moves}: was the encoder dead? Leave out that part"
            ]
    return []


def jumps(time: FloatArray, name: str, values: FloatArray, joint: Joint) -> list[str]:
    """Whether a position makes steps that no motion makes."""
    steps, places = np.diff(values), _places(time, values)
    if not places.size:
        return []
    k = int(places[0])
    more = "" if places.size == 1 else f", and {places.size} times in all"
    span = float(np.median(np.abs(steps[places])))
    spans = [turn for turn in TURNS if abs(span / turn - 1.0) < TURN_WITHIN]
    wraps = say_column(name, f"wraps_at={spans[0]:.10g}") if places.size > 1 and spans else "say wraps_at=..."
    return [
        f"{name} jumps by {steps[k]:.4g} {joint.position_unit} after sample {k} (time {time[k]:g} s){more}: no motion "
        f"does that. Lost counts or a spike: leave out that part; a sensor that wraps around: {wraps}"
    ]


def slips(time: FloatArray, joint: Joint, deflection: FloatArray) -> list[str]:
    """Whether a deflection makes a step of whole turns of the motor, or one that stays, too small for the positions.

    Several steps of another size may be pushes, or play that is crossed.
    """
    if joint.actuator is None:
        return []
    places = _places(time, deflection)
    if not places.size:
        return []
    told = jumps(time, f"theta_{joint.name} - q_{joint.name}", deflection, joint)
    turn = np.inf if joint.prismatic else 2.0 * np.pi / abs(joint.actuator.gear_ratio)
    turns = np.abs(np.diff(deflection)[places]) / turn
    whole = (turns >= 0.5) & (np.abs(turns - np.round(turns)) <= TURN_WITHIN)
    if places.size <= MOST_SLIPS and np.all(whole):
        return [f"{told[0]} (a turn of the motor is {turn:.4g} {joint.position_unit} after its gear)"]
    return told if places.size == 1 and _stays(deflection, int(places[0])) else []


def _places(time: FloatArray, values: FloatArray) -> NDArray[np.intp]:
    """Samples before steps that no motion makes."""
    steps = np.diff(values)
    speed = np.abs(steps) / np.diff(time)
    usual = float(np.percentile(speed, 90.0))
    if usual == 0.0:
        return np.zeros(0, dtype=np.intp)
    return np.flatnonzero((speed > FASTER * usual) & (np.abs(steps) > MOVED * np.ptp(values)))


def _stays(deflection: FloatArray, k: int) -> bool:
    """Whether what changes after a sample changes for good, by more than anything does before or after it.

    A spring that is deflected as far, or play, comes back within a period.
    """
    before, after = deflection[: k + 1], deflection[k + 1 :]
    if min(len(before), len(after)) < LASTING * len(deflection):
        return False
    level = float(np.median(after) - np.median(before))
    step = float(after[0] - before[-1])
    widest = float(max(np.ptp(before), np.ptp(after)))
    return abs(level - step) < STAYS * abs(step) and abs(step) > STAYS * widest
