"""First moments of links that a robot does not feel where its base stands level, and feels where that is tilted."""

from functools import lru_cache

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects.state import MOMENTS, State
from sea_ident.motion import Motion
from sea_ident.robot import Robot

UNFELT = 1e-3
"""Share of the torque that a first moment needs sideways to gravity, below which what it needs in a motion is none."""

SAMPLES = 40
"""Random states in which that is seen, ..."""

KEPT = 32
"""... and robots of which it is kept."""


@lru_cache(maxsize=KEPT)
def unfelt_moments(robot: Robot) -> tuple[FloatArray, ...]:
    """First moments that no motion of a robot shows, and a tilt of its base does: about the first axis if upright.

    Args:
        robot: the robot.

    Returns:
        (10 b,) standard inertial parameters for each, of 1 kg m across the axis of a link; none without gravity.
    """
    q, dq, ddq = np.random.default_rng(0).normal(size=(3, SAMPLES, robot.n))
    state = State(robot, Motion.rigid(np.arange(SAMPLES) / 100.0, q, dq, ddq))
    ways = sideways(robot)
    if not ways:
        return ()
    found: list[FloatArray] = []
    for body in range(len(robot.bodies)):
        units = np.zeros((MOMENTS - 1, 10 * len(robot.bodies)))
        units[:, 10 * body + 1 : 10 * body + MOMENTS] = np.eye(MOMENTS - 1)
        tilted = np.stack([sideways_torque(state, unit, ways) for unit in units], axis=1)
        level = np.stack([state.body_torque(unit).ravel() for unit in units], axis=1)
        strength, across = np.linalg.svd(tilted, full_matrices=False)[1:]
        across = across[strength > UNFELT * max(float(strength[0]), 1e-300)]
        if np.any(tilted) and np.linalg.norm(level @ across.T) < UNFELT * np.linalg.norm(tilted @ across.T):
            found.extend(_along_axes(across) @ units)
    return tuple(found)


def sideways(robot: Robot) -> tuple[FloatArray, ...]:
    """Two directions (3,) at right angles to gravity and to each other, as long as it [m/s2]; none without gravity."""
    gravity = np.asarray(robot.model.gravity.linear)
    if not np.any(gravity):
        return ()
    return tuple(np.cross(axis, gravity) for axis in level_axes(gravity))


def sideways_torque(state: State, inertial: FloatArray, ways: tuple[FloatArray, ...]) -> FloatArray:
    """(2 N n,) torque that links with these parameters (10 b,) need at rest under gravity in each of these ways."""
    return np.concatenate([state.gravity_torque(way, inertial).ravel() for way in ways])


def level_axes(gravity: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Two axes at right angles to gravity: those of the base where it stands level."""
    down = gravity / np.linalg.norm(gravity)
    start = np.eye(3)[int(np.argmin(np.abs(down)))]
    first = start - (start @ down) * down
    first /= np.linalg.norm(first)
    return first, np.cross(-down, first)


def _along_axes(rows: FloatArray) -> FloatArray:
    """(k, 3) orthonormal rows that span what these do, as near to the axes of the frame as they may be."""
    onto, out = rows.T @ rows, np.zeros((0, 3))
    for axis in np.argsort(-np.diag(onto).round(9), kind="stable")[: len(rows)]:
        row = onto[axis] - out.T @ (out @ onto[axis])
        out = np.vstack([out, row / np.linalg.norm(row)])
    return out
