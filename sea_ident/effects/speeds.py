"""Speeds at which a search should look for friction that changes with the speed of a joint."""

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects.state import State

SLOW = 0.2
"""Largest speed of a turning joint below which a range from 0.01 rad/s on begins too late, as v_off does there."""


def speed_scale(state: State, joint: str, speeds: FloatArray) -> float:
    """Factor on ranges of speed that suit a joint whose largest is about 1 rad/s [-].

    Args:
        state: robot and motion.
        joint: the joint.
        speeds: (N, n) of all links or motors [rad/s] or [m/s].

    Returns:
        The largest speed of a slow joint, and of any slide, to two digits, so that columns are found again in the next
        search; 1 for all others.
    """
    i = state.robot.index(joint)
    fastest = float(np.abs(speeds[:, i]).max())
    if fastest == 0.0 or (fastest >= SLOW and not state.robot.joints[i].prismatic):
        return 1.0
    return float(f"{fastest:.2g}")
