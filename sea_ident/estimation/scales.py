"""Whether torques have the scale that the description of the robot asks for: told from all of its springs."""

from collections.abc import Sequence

from sea_ident.estimation.spring_result import SpringResult
from sea_ident.robot import Robot

ANOTHER = 3.0
"""Factor between the stiffness of every spring and its description from which on the torque is doubted [-]."""

RECOGNISED = 0.25
"""Deviation from the gear ratio up to which it is recognised; a spring that stiffens is described otherwise [-]."""


def doubts_of_springs(robot: Robot, springs: Sequence[SpringResult]) -> list[str]:
    """Sentences about springs that come out as no spring can be, or as the description does not have them.

    Args:
        robot: the robot.
        springs: what was identified.

    Returns:
        What may be wrong with the columns or the units of a recording, or with the model.
    """
    found = [
        f"spring of {s.joint}: its stiffness comes out negative ({s.stiffness:.4g} +- {s.stiffness_std:.2g} "
        f"{j.torque_unit}/{j.position_unit}, deflection {s.largest_deflection:.3g} {j.position_unit} at most): have "
        "the encoders of link and motor different zeros (identify with unknown_zero, on the command line "
        "--unknown-zero), has one of them the wrong sign, or does the model lack friction of the link (effect "
        "link_friction)?"
        for s, j in ((s, robot.joints[robot.index(s.joint)]) for s in springs)
        if s.stiffness < -5.0 * s.stiffness_noise_std
    ]
    return [*found, *other_scale(robot, springs)]


def other_scale(robot: Robot, springs: Sequence[SpringResult]) -> list[str]:
    """A sentence where all springs differ from the description in one direction: then it is the torque that does.

    One that differs alone may be described wrong, unless it does by its gear ratio; nothing is said where a stiffness
    is not described.

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
        return [
            _by_gear(spring.joint, text, abs(robot.spring(spring.joint).gear_ratio))
            for spring, (_, text), alike in zip(springs, found, by_gear, strict=True)
            if alike and abs(robot.spring(spring.joint).gear_ratio) > ANOTHER
        ]
    if all(by_gear):
        why = "softer by the gear ratio: tau_motor is the torque at the joint, that of the motor times the ratio"
    else:
        why = "has tau_motor or current another unit, or is a gear ratio, torque constant or stiffness described wrong"
    return [
        f"no spring has the stiffness that is described ({'; '.join(text for _, text in found)}): {why}. "
        "Where it is the torque, bodies and friction are wrong by as much"
    ]


def _by_gear(joint: str, text: str, gear: float) -> str:
    """What to say of one spring that is softer than described by its gear ratio."""
    column = f"tau_motor_{joint}"
    return (
        f"spring of {text}: softer by the gear ratio. Is {column} that of the motor before the gear? Then say "
        f"ColumnSource({column!r}, gear_ratio={gear:g}), on the command line --column "
        f"'{column}={column},gear_ratio={gear:g}'; what is identified of the joints that carry it is wrong with it"
    )
