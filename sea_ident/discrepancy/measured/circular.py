"""Torque channels that are computed from the deflection: they cannot speak for or against a spring."""

import numpy as np

from sea_ident.estimation.circularity import circular_factor
from sea_ident.recordings import Recording
from sea_ident.robot import Robot


def circular_springs(robot: Robot, recording: object) -> tuple[str, ...]:
    """What the spring torques of a recording are worth, one sentence per joint that has such a channel.

    Args:
        robot: the robot.
        recording: a recording; anything else has no such channels.

    Returns:
        Warnings.
    """
    if not isinstance(recording, Recording):
        return ()
    found = []
    for i in robot.elastic_indices:
        name = robot.joint_names[int(i)]
        if not all(recording.has(kind, name) for kind in ("q", "theta", "tau_spring")):
            continue
        q, theta, torque = (recording.channel(kind, [name])[:, 0] for kind in ("q", "theta", "tau_spring"))
        factor = circular_factor([theta - q], [torque])
        if factor is not None:
            found.append(
                f"tau_spring_{name} is {factor:.6g} times the recorded deflection in every sample: it was computed "
                "from it and is circular. A spring fitted to it returns that number and proves nothing; it was not used"
            )
            continue
        columns = np.column_stack([theta - q, np.ones(len(q))])
        left = torque - columns @ np.linalg.lstsq(columns, torque, rcond=None)[0]
        share = float(np.mean(left**2) / max(float(np.var(torque)), 1e-300))
        found.append(
            f"tau_spring_{name} was not used: few drives measure it, most compute it from a deflection of their own, "
            f"and then a spring fitted to it is circular and proves nothing. The recorded theta - q leaves "
            f"{100 * share:.0f} % of its variance, so these data can neither show nor exclude it"
        )
    return tuple(found)
