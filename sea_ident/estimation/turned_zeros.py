"""Joints whose zero is another posture than the description says: told by a better fit, before anything is searched.

A search begins at zero and follows a derivative, which near a right angle leads astray.
"""

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np

from sea_ident.effects import Effect
from sea_ident.effects.encoder_offset import EncoderOffset
from sea_ident.effects.joint_offset import JointOffset
from sea_ident.effects.offset import TurnedOffset
from sea_ident.estimation.put_right import Trial, as_they_say
from sea_ident.processing import ProcessedRecording
from sea_ident.robot import Robot

LARGE = 5e-4
"""Share of the power of the torque, the mean of the joints, from which on what is left asks for a reason [-]."""

GROSS = 2e-3
"""The same from which on two joints are turned at once where one alone is no step towards all [-]."""

STEP = 0.7
"""What is left with one joint turned, or two, over what was left, up to which they may be, ... [-]"""

BETTER = 0.3
"""... and with all of them [-]."""


def turned_zeros(robot: Robot, effects: Sequence[Effect], processed: ProcessedRecording) -> tuple[TurnedOffset, ...]:
    """Zeros that are off by about a right angle or two, joint after joint, the one that explains most first.

    Args:
        robot: the robot.
        effects: the model.
        processed: the recording.

    Returns:
        From where a search may follow them; none where they do not explain most of what the model leaves.
    """
    trial = Trial.of(robot, effects, processed)
    if trial is None:
        return ()
    known = {effect.joint for effect in effects if isinstance(effect, TurnedOffset)}
    turns = [zero for zero in _turned(robot) if zero.joint not in known]
    found: tuple[TurnedOffset, ...] = ()
    before, _ = trial(as_they_say(robot))
    now = before
    while before >= LARGE:
        left, better = _best(trial, found, [(turn,) for turn in turns])
        if left > STEP * now and now >= (LARGE if found else GROSS):
            pairs = [pair for pair in combinations(turns, 2) if pair[0].joint != pair[1].joint]
            left, better = _best(trial, found, pairs)
        if left > STEP * now:
            break
        now, found = left, better
    return found if now < BETTER * before else ()


def _best(
    trial: Trial, found: Sequence[TurnedOffset], changes: Sequence[tuple[TurnedOffset, ...]]
) -> tuple[float, tuple[TurnedOffset, ...]]:
    """What is left with the best of some changes of what was found, and that; infinity where none is possible."""
    best: tuple[float, tuple[TurnedOffset, ...]] = np.inf, ()
    for change in changes:
        joints = {turn.joint for turn in change}
        zeros = (*(zero for zero in found if zero.joint not in joints), *change)
        left, positive = trial(as_they_say(trial.robot, zeros))
        if positive and left < best[0]:
            best = left, zeros
    return best


def _turned(robot: Robot) -> Iterator[TurnedOffset]:
    """Every joint turned by every angle."""
    behind = {robot.joint_names[i] for i in robot.parents if i >= 0}  # the last one turns a body that is free
    rigid = [zero for zero in EncoderOffset.instances(robot) if not robot.joints[robot.index(str(zero.joint))].elastic]
    for zero in (*rigid, *JointOffset.instances(robot)):
        joint = robot.joints[robot.index(str(zero.joint))]
        if isinstance(zero, TurnedOffset) and zero.joint in behind and not joint.prismatic:
            yield from TurnedOffset.beginnings(zero)
