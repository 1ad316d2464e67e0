"""Joints whose zero is another posture than the description says: told by a better fit, before anything is searched.

A search begins at zero and follows a derivative, which near a right angle leads astray.
"""

from collections.abc import Iterator, Sequence

from sea_ident.effects import Effect
from sea_ident.effects.encoder_offset import EncoderOffset
from sea_ident.effects.joint_offset import JointOffset
from sea_ident.effects.offset import TurnedOffset
from sea_ident.estimation.put_right import Trial, as_they_say
from sea_ident.processing import ProcessedRecording
from sea_ident.robot import Robot

LARGE = 5e-4
"""Share of the power of the torque, the mean of the joints, from which on what is left asks for a reason [-]."""

STEP = 0.7
"""What is left with one more joint turned, over what was left, up to which it may be, ... [-]"""

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
    found: tuple[TurnedOffset, ...] = ()
    before, _ = trial(as_they_say(robot))
    now = before
    while before >= LARGE:
        done = known | {zero.joint for zero in found}
        tried = [(trial(as_they_say(robot, (*found, each))), each) for each in _turned(robot) if each.joint not in done]
        possible = [(left, each) for (left, positive), each in tried if positive]
        if not possible:
            break
        left, best = min(possible, key=lambda pair: pair[0])
        if left > STEP * now:
            break
        now, found = left, (*found, best)
    return found if now < BETTER * before else ()


def _turned(robot: Robot) -> Iterator[TurnedOffset]:
    """Every joint turned by every angle."""
    rigid = [zero for zero in EncoderOffset.instances(robot) if not robot.joints[robot.index(str(zero.joint))].elastic]
    for zero in (*rigid, *JointOffset.instances(robot)):
        joint = robot.joints[robot.index(str(zero.joint))]
        if isinstance(zero, TurnedOffset) and not joint.prismatic:
            yield from TurnedOffset.beginnings(zero)
