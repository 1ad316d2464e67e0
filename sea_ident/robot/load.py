"""`load_robot`: from a URDF and its annotation to a Robot."""

import warnings as python_warnings
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin

from sea_ident._typing import FloatArray
from sea_ident.arguments import as_path
from sea_ident.exceptions import RobotError, SeaIdentWarning
from sea_ident.robot.annotation import Annotation, parse_annotation
from sea_ident.robot.assemble import add_rotors, link_model
from sea_ident.robot.checks import check_annotation, check_bodies, check_groups
from sea_ident.robot.joints import moving_joints, root_master
from sea_ident.robot.limits import Limits
from sea_ident.robot.model import Joint, Robot
from sea_ident.robot.sources import find_urdf, read_text
from sea_ident.robot.urdf import UrdfTree, parse_urdf
from sea_ident.robot.xml import parse_xml


def load_robot(
    source: str | Path,
    annotation: str | Path | None = None,
    joints: Sequence[str] | None = None,
    gravity: Sequence[float] | None = None,
) -> Robot:
    """Load a robot from a URDF.

    Args:
        source: path of a URDF, name of a shipped robot (``exo_leg``), or ``example:<path in example-robot-data>``.
        annotation: path (or shipped name) of a URDF fragment with nothing but transmissions; without it the
            transmissions of the URDF itself are read.
        joints: joints that move; all others are locked at zero, or at their nearest limit. Default: all.
        gravity: (3,) as the root link of the URDF feels it, for a robot that hangs or is mounted on a wall [m/s2].
            Default: (0, 0, -9.81).

    Returns:
        The robot. Its joints are in kinematic order, whatever the order of `joints`.

    Raises:
        RobotError: a file that cannot be read or used; the message says what to change.
    """
    as_path(source, "load_robot: source")
    if annotation is not None:
        as_path(annotation, "load_robot: annotation")
    text = read_text(find_urdf(source))
    fragment = None if annotation is None else read_text(find_urdf(annotation))
    return robot_from_text(text, str(source), fragment, joints, gravity, annotation_name=str(annotation or ""))


def robot_from_text(
    urdf: str,
    source: str,
    annotation: str | None = None,
    joints: Sequence[str] | None = None,
    gravity: Sequence[float] | None = None,
    *,
    annotation_name: str = "annotation",
) -> Robot:
    """Build a robot from the text of a URDF, as `load_robot` does from a file.

    Args:
        urdf: text of the URDF.
        source: where it came from, for messages and for saved models.
        annotation: text of the annotation fragment.
        joints: joints that move; all others are locked.
        gravity: (3,) in the root link [m/s2]; (0, 0, -9.81) by default.
        annotation_name: where the annotation came from, for messages.

    Returns:
        The robot.

    Raises:
        RobotError: as `load_robot`.
    """
    tree = parse_urdf(urdf, source)
    parsed = _annotation(tree, source, annotation, annotation_name)
    model, locked = link_model(tree, moving_joints(tree, joints))
    joint_list = _joints(tree, model, parsed)
    limits, notes = _limits(tree, parsed, joint_list, locked)
    notes += check_bodies(tree, model) + check_annotation(tree, parsed, joint_list)
    actuators = [joint.actuator for joint in joint_list if joint.actuator is not None]
    check_groups(tree, actuators)
    extended = add_rotors(tree, model, [joint.name for joint in joint_list], actuators)
    robot = Robot(
        name=tree.name,
        source=source,
        urdf=tree.text,
        annotation=annotation,
        joints=joint_list,
        limits=limits,
        bodies=tuple(tree.joints[name].child for name in list(model.names)[1:]),
        rotors=tuple(actuators),
        model=model,
        extended_model=extended.model,
        body_indices=extended.body_indices,
        rotor_indices=extended.rotor_indices,
        link_map=extended.link_map,
        motor_map=extended.motor_map,
        offset=extended.offset,
        locked=locked,
    )
    for note in notes:
        python_warnings.warn(f"{source}: {note}", SeaIdentWarning, stacklevel=3)
    robot = replace(robot, warnings=tuple(notes))
    return robot if gravity is None else robot.with_gravity(gravity)


def _annotation(tree: UrdfTree, source: str, annotation: str | None, name: str) -> Annotation:
    """The transmissions of the fragment; without one, those of the URDF."""
    if annotation is None:
        return parse_annotation(tree.root, source, tree)
    fragment = parse_xml(annotation, name)
    if fragment.tag != "robot":
        raise RobotError(f"{name}: the root element is <{fragment.tag}>, not <robot>")
    if fragment.find("transmission") is None:
        raise RobotError(f"{name}: has no <transmission>; is it an annotation?")
    return parse_annotation(fragment, name, tree)


def _joints(tree: UrdfTree, model: pin.Model, parsed: Annotation) -> tuple[Joint, ...]:
    """The joints that move on their own, in kinematic order."""
    moving = list(model.names)[1:]
    followers: dict[str, list[str]] = {name: [] for name in moving if tree.joints[name].mimic is None}
    for name in moving:
        if tree.joints[name].mimic is not None:
            followers[root_master(tree, name)[0]].append(name)
    return tuple(
        Joint(
            name=name,
            type=tree.joints[name].type,
            child=tree.joints[name].child,
            damping=tree.joints[name].damping,
            friction=tree.joints[name].friction,
            actuator=parsed.actuators.get(name),
            followers=tuple(following),
        )
        for name, following in followers.items()
    )


def _limits(
    tree: UrdfTree, parsed: Annotation, joints: tuple[Joint, ...], locked: dict[str, float]
) -> tuple[Limits, list[str]]:
    """Limits of the joints, narrowed by joints that mimic them; locked joints move the bounds of combinations."""
    names = [joint.name for joint in joints]
    urdf = [tree.joints[name] for name in names]
    notes = []

    def extra(key: str) -> FloatArray:
        return np.array([parsed.limits.get(name, {}).get(key, np.inf) for name in names])

    lower, upper, velocity = (np.array([getattr(j, key) for j in urdf]) for key in ("lower", "upper", "velocity"))
    for k, joint in enumerate(joints):
        for name in joint.followers:
            follower, (_, multiplier, offset) = tree.joints[name], root_master(tree, name)
            if multiplier == 0.0:
                continue
            bounds = sorted(((follower.lower - offset) / multiplier, (follower.upper - offset) / multiplier))
            if max(lower[k], bounds[0]) >= min(upper[k], bounds[1]):
                notes.append(f"the range of {name!r} excludes that of {joint.name!r}, which it mimics; it is ignored")
                continue
            lower[k], upper[k] = max(lower[k], bounds[0]), min(upper[k], bounds[1])
            velocity[k] = min(velocity[k], follower.velocity / abs(multiplier))

    rows, least, most, labels = [], [], [], []
    for combination in parsed.combinations:
        row, shift = np.zeros(len(joints)), 0.0
        for name, coefficient in combination.coefficients.items():
            if name in locked:
                shift += coefficient * locked[name]
                continue
            master, multiplier, offset = root_master(tree, name)
            row[names.index(master)] += coefficient * multiplier
            shift += coefficient * offset
        if np.any(row):
            rows.append(row)
            least.append(combination.lower - shift)
            most.append(combination.upper - shift)
            labels.append(combination.name)
    limits = Limits.unlimited(len(joints)).replace(
        lower=lower,
        upper=upper,
        velocity=velocity,
        acceleration=extra("acceleration"),
        jerk=extra("jerk"),
        torque=np.minimum(extra("torque"), np.array([j.effort for j in urdf])),
        deflection=extra("deflection"),
        combinations=np.array(rows).reshape(len(rows), len(joints)),
        combination_lower=np.array(least),
        combination_upper=np.array(most),
        combination_names=tuple(labels),
        half_spaces=parsed.half_spaces,
        self_collision=parsed.self_collision,
    )
    return limits, notes
