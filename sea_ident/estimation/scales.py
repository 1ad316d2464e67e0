"""Whether torques have the scale that the description of the robot asks for: told from all of its springs."""

from collections.abc import Sequence

from sea_ident.estimation.spring_result import SpringResult
from sea_ident.robot import Robot

ANOTHER = 3.0
"""Factor between the stiffness of every spring and its description from which on the torque is doubted [-]."""

RECOGNISED = 0.25
"""Deviation from the gear ratio up to which it is recognised; a spring that stiffens is described otherwise [-]."""


def other_scale(robot: Robot, springs: Sequence[SpringResult]) -> list[str]:
    """A sentence where all springs differ from the description in one direction: then it is the torque that does.

    One that differs alone may be described wrong; nothing is said where a stiffness is not described.

    Args:
        robot: the robot.
        springs: what was identified.

    Returns:
        One sentence, or none.
    """
    found, by_gear = [], []
    for spring in springs:
        described = robot.spring(spring.joint)
        if not described.stiffness or not spring.linear_stiffness > 0.0:
            return []
        ratio = spring.linear_stiffness / described.stiffness
        found.append((ratio, f"{spring.joint} {spring.linear_stiffness:.3g}, described as {described.stiffness:.3g}"))
        by_gear.append(abs(ratio * abs(described.gear_ratio) - 1.0) < RECOGNISED)
    if not found or not (min(r for r, _ in found) > ANOTHER or max(r for r, _ in found) < 1.0 / ANOTHER):
        return []
    if all(by_gear):
        why = "softer by the gear ratio: tau_motor is the torque at the joint, that of the motor times the ratio"
    else:
        why = "has tau_motor or current another unit, or is a gear ratio, torque constant or stiffness described wrong"
    return [
        f"no spring has the stiffness that is described ({'; '.join(text for _, text in found)}): {why}. "
        "Where it is the torque, bodies and friction are wrong by as much"
    ]
