"""Friction of links that the description of a robot gives and the model does not have."""

from collections.abc import Sequence

from sea_ident.effects import Effect
from sea_ident.effects.link_friction import left_out
from sea_ident.estimation.spring_result import SpringResult
from sea_ident.robot import Robot


def described_friction(robot: Robot, effects: Sequence[Effect], springs: Sequence[SpringResult]) -> list[str]:
    """A sentence where springs fit badly and the links beside them have friction that was described, but not modelled.

    Args:
        robot: the robot, with the damping and friction of its joints.
        effects: the model.
        springs: what was identified.

    Returns:
        One sentence, or none.
    """
    lacking = {friction.joint for friction in left_out(robot, effects)}
    found = []
    for spring in springs:
        joint = robot.joints[robot.index(spring.joint)]
        if spring.joint in lacking and spring.doubt() is not None:
            found.append(f"{spring.joint} (damping {joint.damping or 0.0:g}, friction {joint.friction or 0.0:g})")
    if not found:
        return []
    return [
        f"the description gives friction of the link at {', '.join(found)}, which the model does not have, and springs "
        "take its place: add the effect link_friction (effects, on the command line --add link_friction)"
    ]
