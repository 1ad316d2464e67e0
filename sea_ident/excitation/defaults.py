"""What bounds the motion of a joint whose description does not."""

import numpy as np

from sea_ident.excitation.limit_checks import checked_limits
from sea_ident.robot import Limits, Robot


def default_limits(robot: Robot, limits: Limits, notes: list[str]) -> Limits:
    """Limits with stated defaults where a joint has none that bound its motion.

    Without position limits a joint is kept within half a turn (1 m) of zero, without a velocity limit below half a turn
    (1 m) per second.

    Args:
        robot: the robot.
        limits: its limits.
        notes: every default that is used is added here.

    Raises:
        ExcitationError: limits that do not fit the robot.
    """
    limits = checked_limits(robot, limits)
    lower, upper, velocity = limits.lower.copy(), limits.upper.copy(), limits.velocity.copy()
    for i, joint in enumerate(robot.joints):
        reach, unit = (1.0, "m") if joint.prismatic else (np.pi, "rad")
        if np.isneginf(lower[i]) and np.isposinf(upper[i]):
            lower[i], upper[i] = -reach, reach
            notes.append(f"joint {joint.name!r} has no position limits; it is kept within +-{reach:.4g} {unit}")
        elif np.isneginf(lower[i]):
            lower[i] = upper[i] - 2.0 * reach
            notes.append(f"joint {joint.name!r} has no lower limit; it is kept above {lower[i]:.4g} {unit}")
        elif np.isposinf(upper[i]):
            upper[i] = lower[i] + 2.0 * reach
            notes.append(f"joint {joint.name!r} has no upper limit; it is kept below {upper[i]:.4g} {unit}")
        if np.isposinf(velocity[i]):
            velocity[i] = reach
            notes.append(f"joint {joint.name!r} has no velocity limit; it is kept within +-{reach:.4g} {unit}/s")
    return limits.replace(lower=lower, upper=upper, velocity=velocity)
