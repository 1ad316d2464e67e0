"""Checks of the bodies that move: what cannot be worked with is an error, the rest a note."""

from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from sea_ident.exceptions import RobotError
from sea_ident.robot.actuator import Actuator
from sea_ident.robot.annotation import Annotation
from sea_ident.robot.model import Joint
from sea_ident.robot.urdf import UrdfTree

FEW_TURNS, MANY_TURNS = 4.0, 200.0
"""Range of a revolute joint [turns] that looks like degrees; what is larger stands for no limit."""


def check_bodies(tree: UrdfTree, model: pin.Model) -> list[str]:
    """Check mass and inertia of the bodies that move.

    A link that states no <inertial> is a massless frame between two joints, as many URDFs have it: that is a note, as
    long as its joint moves something. A stated mass of zero is an error, because no moving link weighs nothing.

    Args:
        tree: the kinematic tree.
        model: its links with the locked joints merged.

    Returns:
        Notes for the user.

    Raises:
        RobotError: zero mass, a negative moment of inertia, or a joint that moves nothing.
    """
    notes: list[str] = []
    massless: list[str] = []
    data = model.createData()
    mass = pin.crba(model, data, np.random.default_rng(0).uniform(-1.0, 1.0, model.nq))
    for k in range(1, model.njoints):
        joint, inertia = model.names[k], model.inertias[k]
        name = tree.joints[joint].child
        where = f"{tree.file}: link {name!r}"
        index = model.joints[k].idx_v
        if mass[index, index] <= 0.0:
            raise RobotError(
                f"{tree.file}: joint {joint!r} moves no mass: link {name!r} and what it carries have zero mass and "
                f"inertia; give their <inertial>, or hold the joint fixed by naming those that move (joints=..., "
                f"--joints a,b,c)"
            )
        if inertia.mass <= 0.0:
            if tree.links[name] is not None:
                raise RobotError(
                    f"{where}: its mass is 0 kg, and joint {joint!r} moves it; give its mass, or remove its <inertial> "
                    f"if it is only a frame between two joints"
                )
            massless.append(name)
            continue
        moments = np.linalg.eigvalsh(inertia.inertia)
        if moments[0] < -1e-9 * max(moments[2], 1e-3):
            raise RobotError(
                f"{where}: its inertia tensor has the negative principal moment {moments[0]:.4g} kg m2; correct its "
                f"<inertia>, or hold joint {joint!r} fixed by naming those that move (joints=..., --joints a,b,c)"
            )
        if moments[0] + moments[1] < moments[2] * (1.0 - 1e-6) - 1e-12:
            notes.append(
                f"link {name!r}: no body has the principal moments {moments[0]:.4g}, {moments[1]:.4g}, "
                f"{moments[2]:.4g} kg m2 (the largest exceeds the sum of the others)"
            )
    if massless:
        notes.append(f"links without <inertial> have zero mass: {', '.join(massless)}")
    return notes


def check_annotation(tree: UrdfTree, annotation: Annotation, joints: Sequence[Joint]) -> list[str]:
    """Notes on what the annotation says and what of it goes unused.

    Args:
        tree: the kinematic tree.
        annotation: what the transmissions say.
        joints: the joints that move.

    Returns:
        Notes for the user.
    """
    notes = []
    unlimited = [
        joint.name for joint in joints if joint.type != "continuous" and np.isinf(tree.joints[joint.name].lower)
    ]
    if unlimited:
        notes.append(
            f"no range is stated for {', '.join(unlimited)} (no <limit>, or lower = upper = 0): taken as unlimited"
        )
    for joint in joints:
        stated = tree.joints[joint.name]
        turns = (stated.upper - stated.lower) / (2.0 * np.pi)
        if joint.type == "revolute" and FEW_TURNS < turns < MANY_TURNS:
            notes.append(
                f"the range of {joint.name!r} is {stated.lower:g} to {stated.upper:g} rad, {turns:.3g} turns: "
                "URDF takes radians; if these are degrees, change them"
            )
    if annotation.ignored:
        kinds = ", ".join(annotation.ignored)
        notes.append(f"transmissions of these types are not read, their joints count as rigid: {kinds}")
    if not any(joint.actuator is not None for joint in joints):
        notes.append("no transmission annotates its joints: it is treated as a rigid robot without motor inertia")
    for name in annotation.actuators:
        mimic = tree.joints[name].mimic
        if mimic is not None:
            notes.append(f"transmission on {name!r} is ignored: that joint mimics {mimic.joint!r}")
    return notes


def check_groups(tree: UrdfTree, actuators: Sequence[Actuator]) -> None:
    """Refuse motors of one group that state different rotor inertias: they share one parameter.

    Args:
        tree: the kinematic tree.
        actuators: those of the joints that move.

    Raises:
        RobotError: if two of a group state different ones.
    """
    stated: dict[str, Actuator] = {}
    for actuator in actuators:
        if actuator.rotor_inertia is None:
            continue
        first = stated.setdefault(actuator.rotor_group, actuator)
        if first.rotor_inertia != actuator.rotor_inertia:
            raise RobotError(
                f"{tree.file}: the motors of {first.joint!r} and {actuator.joint!r} are of one group "
                f"{actuator.rotor_group!r}, and state {first.rotor_inertia:g} and {actuator.rotor_inertia:g} kg m2 as "
                "<rotorInertia>; state the same for both, or give them groups of their own"
            )
