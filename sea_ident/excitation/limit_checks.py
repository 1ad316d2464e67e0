"""Limits as a user gives them: right sizes and numbers that mean something."""

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.exceptions import ExcitationError
from sea_ident.robot import Limits, Robot

_PER_JOINT = ("lower", "upper", "velocity", "acceleration", "jerk", "torque", "deflection")
_LARGEST = 1e9


def checked_limits(robot: Robot, limits: Limits) -> Limits:
    """Limits whose arrays fit a robot.

    Args:
        robot: the robot, with n joints.
        limits: what a user gave; lists are taken too.

    Returns:
        The same as arrays of numbers.

    Raises:
        ExcitationError: wrong sizes, no numbers, or numbers so large that they can only be a mistake.
    """
    n = robot.n
    found = {name: _array(name, getattr(limits, name), (n,), f"one per joint, {n}") for name in _PER_JOINT}
    names = tuple(limits.combination_names)
    c = len(names)
    found["combinations"] = _array("combinations", limits.combinations, (c, n), f"{c} names x {n} joints")
    for side in ("combination_lower", "combination_upper"):
        found[side] = _array(side, getattr(limits, side), (c,), f"one per name, {c}")
    if not np.all(np.isfinite(found["combinations"])):
        raise ExcitationError("limits.combinations: holds numbers that are not finite; give a coefficient per joint")
    return limits.replace(**found)


def as_numbers(name: str, values: object) -> FloatArray:
    """An array of numbers.

    Raises:
        ExcitationError: `values` holds something else.
    """
    try:
        return np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise ExcitationError(f"{name} is {values!r}; give an array of numbers") from None


def _array(name: str, values: object, shape: tuple[int, ...], wanted: str) -> FloatArray:
    array = as_numbers(f"limits.{name}", values)
    if array.shape != shape:
        raise ExcitationError(f"limits.{name}: has shape {array.shape}; it must be {shape} ({wanted})")
    if np.any(np.isfinite(array) & (np.abs(array) > _LARGEST)):
        raise ExcitationError(f"limits.{name}: {array.tolist()} is larger than any robot; give infinity for no limit")
    return array
