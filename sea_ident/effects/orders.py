"""Orders of what repeats over the turn of a joint."""

import numpy as np

from sea_ident.effects.state import State

LEAST = 0.5
"""Lowest order of what repeats over the turn of a joint: a wave of two turns [1/rad]."""

_GEAR_MULTIPLES = (1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0)


def orders(state: State, joint: str, most: int) -> tuple[float, ...]:
    """Orders n of sin(n theta) that a search should try on a motion.

    Two orders closer than about 2 over the range of theta look alike. Orders so high that the motion passes them
    faster than four samples a period are left out. Multiples of the gear ratio (turns of the motor) are always among
    them where they are slow enough.

    Args:
        state: robot and motion.
        joint: the joint.
        most: largest number of orders in the even grid.

    Returns:
        Rising orders, at least one [1/rad] or [1/m].
    """
    robot = state.robot
    i = robot.index(joint)
    span = max(float(np.ptp(state.motion.theta[:, i])), 1e-9)
    highest = highest_order(state, joint)
    spacing = 2.0 / span
    lowest = min(1.0, spacing) if not robot.joints[i].prismatic else spacing
    grid = lowest + spacing * np.arange(most)
    gear = float(robot.gear_ratios[i]) * np.array(_GEAR_MULTIPLES) if robot.gear_ratios[i] > 1.0 else np.zeros(0)
    found = np.unique(np.concatenate([grid, gear]))
    found = found[found <= highest]
    return tuple(float(order) for order in found) if len(found) else (float(lowest),)


def least_order(state: State, joint: str) -> float:
    """Order of the longest wave that counts as one, and not as a straight line over the way that a joint goes.

    Args:
        state: robot and motion.
        joint: the joint.

    Returns:
        `LEAST` where the joint turns. A slide has no turns: half the lowest order that is tried there, to two digits,
        so that columns are found again in the next search [1/rad] or [1/m].
    """
    if not state.robot.joints[state.robot.index(joint)].prismatic:
        return LEAST
    return float(f"{0.5 * orders(state, joint, 1)[0]:.2g}")


def highest_order(state: State, joint: str) -> float:
    """Order of a ripple that this motion passes with four samples a period [1/rad] or [1/m].

    Args:
        state: robot and motion.
        joint: the joint.
    """
    motion = state.motion
    speed = np.abs(motion.dtheta[:, state.robot.index(joint)])
    step = float(motion.time[-1] - motion.time[0]) / max(len(motion) - 1, 1)
    return float(2.0 * np.pi / (4.0 * step * max(float(np.quantile(speed, 0.9)), 1e-9)))


def motors_too_fast(state: State) -> tuple[str, ...]:
    """Joints of which no ripple of a whole turn of the motor is looked for: the samples are too few for it.

    Args:
        state: robot and motion.
    """
    ratios = zip(state.robot.joint_names, state.robot.gear_ratios, strict=True)
    return tuple(joint for joint, ratio in ratios if ratio > 1.0 and ratio > highest_order(state, joint))
