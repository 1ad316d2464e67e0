"""Limits of the robot that a simulated motion did not keep."""

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.motion import Motion
from sea_ident.robot import Robot

WORTH_TELLING = 0.01
"""Part of its range by which a limit may be broken untold [-]: a controller is no nearer to its reference."""


def broken_limits(robot: Robot, motion: Motion, tau_motor: FloatArray, *, settled: bool) -> list[str]:
    """Which limits a motion broke, by how much.

    Args:
        robot: the robot, with its limits.
        motion: (N, n) exact motion.
        tau_motor: (N, n) exact torques of the motors [N m].
        settled: whether the motion goes on from itself. What begins in an equilibrium that its reference is not in
            jerks at first, and its accelerations say nothing.

    Returns:
        A sentence for each joint and quantity.
    """
    limits, told = robot.limits, []
    for i, joint in enumerate(robot.joints):
        unit, name = joint.position_unit, f"joint {joint.name!r}"
        told += _outside(f"{name}: the link", unit, motion.q[:, i], float(limits.lower[i]), float(limits.upper[i]))
        told += _beyond(f"{name}: the link", f"{unit}/s", motion.dq[:, i], float(limits.velocity[i]))
        if settled:
            told += _beyond(f"{name}: the link", f"{unit}/s2", motion.ddq[:, i], float(limits.acceleration[i]))
        told += _beyond(f"{name}: the deflection", unit, motion.deflection[:, i], float(limits.deflection[i]))
        peak, most = float(np.max(np.abs(tau_motor[:, i]))), float(limits.torque[i])
        if peak > most:
            told.append(f"{name}: the motor reaches {peak:.4g} {joint.torque_unit}, its limit is {most:.4g}")
    for k, name in enumerate(limits.combination_names):
        unit = robot.joints[int(np.argmax(limits.combinations[k] != 0.0))].position_unit
        values = motion.q @ limits.combinations[k]
        told += _outside(name, unit, values, float(limits.combination_lower[k]), float(limits.combination_upper[k]))
    return told


def _outside(what: str, unit: str, values: FloatArray, lower: float, upper: float) -> list[str]:
    """Of a limit with two sides; of one that is open, the range is counted as twice the size of the other."""
    lowest, highest = float(np.min(values)), float(np.max(values))
    spread = upper - lower
    if not np.isfinite(spread):
        spread = max(1.0, *(2.0 * abs(side) for side in (lower, upper) if np.isfinite(side)), 0.0)
    told = []
    if lowest < lower - WORTH_TELLING * spread:
        told.append(f"{what} reaches {lowest:.4g} {unit}, its lower limit is {lower:.4g}")
    if highest > upper + WORTH_TELLING * spread:
        told.append(f"{what} reaches {highest:.4g} {unit}, its upper limit is {upper:.4g}")
    return told


def _beyond(what: str, unit: str, values: FloatArray, most: float) -> list[str]:
    peak = float(np.max(np.abs(values)))
    if peak <= (1.0 + 2.0 * WORTH_TELLING) * most:
        return []
    return [f"{what} reaches {peak:.4g} {unit}, its limit is {most:.4g}"]
