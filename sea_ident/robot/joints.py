"""Which joints of a URDF move, and which follow others."""

from collections.abc import Sequence

import numpy as np

from sea_ident.arguments import expect_names
from sea_ident.exceptions import RobotError, SeaIdentError
from sea_ident.robot.urdf import MOVING_TYPES, REFUSED_TYPES, UrdfTree


def root_master(tree: UrdfTree, name: str) -> tuple[str, float, float]:
    """The joint that finally drives a joint (mimics may be chained).

    Args:
        tree: the kinematic tree.
        name: name of a joint.

    Returns:
        Name of the driving joint, multiplier and offset, so that position = multiplier x its position + offset;
        the joint itself, 1 and 0 where it mimics none.

    Raises:
        RobotError: if it mimics a joint that does not exist, or if joints mimic each other in a circle.
    """
    multiplier, offset, seen = 1.0, 0.0, [name]
    mimic = tree.joints[name].mimic
    while mimic is not None:
        if mimic.joint not in tree.joints:
            raise RobotError(
                f"{tree.file}: joint {seen[-1]!r} mimics {mimic.joint!r}, which does not exist; correct its <mimic>, "
                f"or name the joints that move (joints=..., --joints a,b,c) to hold it fixed"
            )
        if mimic.joint in seen:
            raise RobotError(
                f"{tree.file}: the joints {', '.join(seen)} mimic each other in a circle; remove a <mimic>"
            )
        seen.append(mimic.joint)
        multiplier, offset = multiplier * mimic.multiplier, offset + multiplier * mimic.offset
        mimic = tree.joints[mimic.joint].mimic
    return seen[-1], multiplier, offset


def moving_joints(tree: UrdfTree, chosen: Sequence[str] | None) -> set[str]:
    """Names of the joints that move, those that mimic moving ones included.

    Args:
        tree: the kinematic tree.
        chosen: names that the user gave; None for all.

    Returns:
        The names.

    Raises:
        RobotError: if a name is unknown, given twice, or not of a joint that can move on its own; if none moves.
    """
    independent = [j.name for j in tree.joints.values() if j.type in MOVING_TYPES and j.mimic is None]
    can_move = f"joints that can move: {', '.join(independent) or 'none'}"
    if chosen is not None:
        try:
            expect_names(chosen, "joints")
        except SeaIdentError as error:
            raise RobotError(f"{tree.file}: {error}; {can_move}") from None
        chosen = list(chosen)
    else:
        for joint in tree.joints.values():
            if joint.type in REFUSED_TYPES:
                raise RobotError(
                    f"{tree.file}: joint {joint.name!r} is {joint.type}, which cannot be identified as a joint; name "
                    f"the joints that move (joints=..., --joints a,b,c) to hold it fixed; {can_move}"
                )
        if not independent:
            raise RobotError(f"{tree.file}: all its joints are fixed; there is nothing to identify")
        chosen = independent
    for k, name in enumerate(chosen):
        if name not in tree.joints:
            raise RobotError(f"{tree.file}: has no joint {name!r}; {can_move}")
        joint = tree.joints[name]
        if joint.type not in MOVING_TYPES:
            raise RobotError(f"{tree.file}: joint {name!r} is {joint.type}; it cannot be chosen to move; {can_move}")
        if joint.mimic is not None:
            raise RobotError(f"{tree.file}: joint {name!r} mimics {joint.mimic.joint!r}; choose that one")
        if name in chosen[:k]:
            raise RobotError(f"{tree.file}: joint {name!r} is named twice; name it once")
    if not chosen:
        raise RobotError(f"{tree.file}: no joint was chosen to move; {can_move}")
    wanted = set(chosen)
    everything = len(wanted) == len(independent)
    followers = set()
    for joint in tree.joints.values():
        if joint.mimic is None or joint.type not in MOVING_TYPES:
            continue
        try:
            master = root_master(tree, joint.name)[0]
        except RobotError:
            if everything:
                raise
            continue  # a broken mimic holds still
        if master in wanted:
            followers.add(joint.name)
    return wanted | followers


def locked_position(tree: UrdfTree, name: str) -> float:
    """Where a joint is held that does not move: at zero, or at its nearest limit; a mimic joint where its master says.

    Args:
        tree: the kinematic tree.
        name: name of the joint.

    Returns:
        Its position [rad] or [m].
    """
    try:
        name, multiplier, offset = root_master(tree, name)
    except RobotError:  # a broken mimic is a joint of its own
        multiplier, offset = 1.0, 0.0
    joint = tree.joints[name]
    return multiplier * float(np.clip(0.0, joint.lower, joint.upper)) + offset
