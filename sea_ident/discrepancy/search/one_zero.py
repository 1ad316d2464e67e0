"""Two wrong zeros of a joint that are one: those of its two encoders, and that of its angle.

Both encoders are off where the angle is, so that each of the three is the sum of the two others. What turns the first
joint turns gravity.
"""

from collections.abc import Mapping

from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.effects import Effect
from sea_ident.effects.base_tilt import BaseTilt
from sea_ident.effects.encoder_offset import EncoderOffset
from sea_ident.effects.joint_offset import JointOffset
from sea_ident.effects.motor_encoder_offset import MotorEncoderOffset
from sea_ident.effects.offset import Offset
from sea_ident.effects.spring_offset import SpringOffset


def one_zero(bench: Bench, one: Effect, two: Effect, parameters: Mapping[str, float]) -> Effect | None:
    """The zero that two effects may be.

    Args:
        bench: the recording.
        one: the first.
        two: the second.
        parameters: of the model that both are in, by name.

    Returns:
        The zero, about as large as it is; None where they are no zeros of one joint.
    """
    robot = bench.robot
    zeros = [effect for effect in (one, two) if isinstance(effect, Offset | SpringOffset)]
    tilted = any(isinstance(effect, BaseTilt) for effect in (one, two))
    joints = {str(effect.joint) for effect in zeros}
    if len(zeros) + tilted < 2 or len(joints) != 1:
        return None
    (joint,) = joints
    i = robot.index(joint)
    if not robot.joints[i].elastic:
        return None
    sizes = [_size(effect, parameters) for effect in zeros]
    of_q = sum(s for s, e in zip(sizes, zeros, strict=True) if isinstance(e, EncoderOffset | JointOffset))
    of_theta = sum(s for s, e in zip(sizes, zeros, strict=True) if not isinstance(e, EncoderOffset))
    kinds = {MotorEncoderOffset if isinstance(e, SpringOffset) else type(e) for e in zeros}
    if tilted:
        # the angle is off by whatever takes the zero of the one encoder away, and leaves that of the other
        if robot.parents[i] >= 0 or JointOffset in kinds:
            return None
        others = kinds == {EncoderOffset}
        return MotorEncoderOffset(joint, offset=-of_q) if others else EncoderOffset(joint, offset=-of_theta)
    if EncoderOffset in kinds:
        return MotorEncoderOffset(joint, offset=of_theta) if JointOffset in kinds else JointOffset(joint, offset=of_q)
    return EncoderOffset(joint, offset=of_q) if JointOffset in kinds else MotorEncoderOffset(joint, offset=of_theta)


def _size(effect: Offset | SpringOffset, known: Mapping[str, float]) -> float:
    """By how much a zero is off [rad] or [m]."""
    if isinstance(effect, SpringOffset):
        return -known[effect.parameter_name()] / known[f"{effect.joint}.spring_stiffness"]
    return effect.offset
