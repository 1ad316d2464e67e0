"""`load_robot`: from a URDF and its annotation to a Robot."""

import warnings as python_warnings
from collections.abc import Sequence
from dataclasses import replace
from importlib import resources
from pathlib import Path

import numpy as np
import pinocchio as pin
from lxml import etree

from sea_ident._typing import FloatArray
from sea_ident.exceptions import RobotError, SeaIdentWarning
from sea_ident.robot.actuator import Actuator
from sea_ident.robot.annotation import Annotation, parse_annotation
from sea_ident.robot.limits import Limits
from sea_ident.robot.model import Joint, Robot, rotor_body
from sea_ident.robot.urdf import MOVING_TYPES, REFUSED_TYPES, UrdfTree, parse_urdf, parse_xml

EXAMPLE_PREFIX = "example:"


def robots_folder() -> Path:
    """Folder of the robots that ship with sea_ident (inside the wheel, or beside the package in a checkout)."""
    package = Path(str(resources.files("sea_ident")))
    installed = package / "robots"
    return installed if installed.is_dir() else package.parent / "robots"


def shipped_robots() -> tuple[str, ...]:
    """Names under which `load_robot` finds the robots that ship with sea_ident."""
    return tuple(sorted(path.stem for path in robots_folder().glob("*/*.urdf")))


def example_robots_folder() -> Path:
    """Folder of example-robot-data's robots.

    Raises:
        RobotError: if example-robot-data is not installed.
    """
    # The pip package ships data only, under the prefix that its Pinocchio wheel lives in.
    for parent in Path(pin.__file__).resolve().parents:
        for prefix in (parent, parent / "cmeel.prefix"):
            folder = prefix / "share" / "example-robot-data" / "robots"
            if folder.is_dir():
                return folder
    raise RobotError("example-robot-data is not installed; run: pip install example-robot-data")


def find_urdf(source: str | Path) -> Path:
    """The file that a robot source means.

    Args:
        source: path of a URDF, name of a shipped robot, or ``example:<path inside example-robot-data>``.

    Returns:
        Path of the file.

    Raises:
        RobotError: if there is no such file; the message lists what does exist.
    """
    text = str(source)
    if text.startswith(EXAMPLE_PREFIX):
        folder, inner = example_robots_folder(), text.removeprefix(EXAMPLE_PREFIX)
        path = folder / inner
        if not path.is_file():
            known = sorted(p.name for p in folder.glob(f"{inner.split('/')[0]}/**/*.urdf"))
            hint = f"; it has {', '.join(known)}" if known else ""
            raise RobotError(f"example-robot-data has no file {inner!r}{hint}")
        return path
    path = Path(text)
    if path.is_file():
        return path
    if path.suffix == "" and path.name == text:
        shipped = list(robots_folder().glob(f"*/{text}.urdf"))
        if shipped:
            return shipped[0]
    known_names = ", ".join(shipped_robots())
    raise RobotError(f"no file {text!r}, and no shipped robot of that name; shipped robots: {known_names}")


def _read_text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise RobotError(f"{path}: cannot be read: {error}") from None


def load_robot(
    source: str | Path,
    annotation: str | Path | None = None,
    joints: Sequence[str] | None = None,
) -> Robot:
    """Load a robot from a URDF.

    Args:
        source: path of a URDF, name of a shipped robot (``exo_leg``), or ``example:<path in example-robot-data>``.
        annotation: path (or shipped name) of a URDF fragment with nothing but transmissions; without it the
            transmissions of the URDF itself are read.
        joints: joints that move; all others are locked at zero, or at their nearest limit. Default: all.

    Returns:
        The robot. Its joints are in kinematic order, whatever the order of `joints`.

    Raises:
        RobotError: a file that cannot be read or used; the message says what to change.
    """
    path = find_urdf(source)
    text = _read_text(path)
    fragment = None if annotation is None else _read_text(find_urdf(annotation))
    fragment_name = "" if annotation is None else str(annotation)
    return robot_from_text(text, str(source), fragment, joints, annotation_name=fragment_name)


def robot_from_text(
    urdf: str,
    source: str,
    annotation: str | None = None,
    joints: Sequence[str] | None = None,
    *,
    annotation_name: str = "annotation",
) -> Robot:
    """Build a robot from the text of a URDF, as `load_robot` does from a file.

    Args:
        urdf: text of the URDF.
        source: where it came from, for messages and for saved models.
        annotation: text of the annotation fragment.
        joints: joints that move; all others are locked.
        annotation_name: where the annotation came from, for messages.

    Returns:
        The robot.

    Raises:
        RobotError: as `load_robot`.
    """
    tree = parse_urdf(urdf, source)
    if annotation is None:
        parsed = parse_annotation(tree.root, source, tree)
    else:
        fragment = parse_xml(annotation, annotation_name)
        if fragment.tag != "robot":
            raise RobotError(f"{annotation_name}: the root element is <{fragment.tag}>, not <robot>")
        if fragment.find("transmission") is None:
            raise RobotError(f"{annotation_name}: has no <transmission>; is it an annotation?")
        parsed = parse_annotation(fragment, annotation_name, tree)
    moving = _moving_joints(tree, joints)
    full_model = _pinocchio_model(tree, moving)
    model, locked = _lock(full_model, tree, moving)
    masters = [name for name in model.names[1:] if tree.joints[name].mimic is None]
    by_master = {name: [f for f in model.names[1:] if _root_master(tree, f)[0] == name] for name in masters}
    joint_list = tuple(
        Joint(
            name=name,
            type=tree.joints[name].type,
            child=tree.joints[name].child,
            damping=tree.joints[name].damping,
            friction=tree.joints[name].friction,
            actuator=parsed.actuators.get(name),
            followers=tuple(f for f in by_master[name] if f != name),
        )
        for name in masters
    )
    notes = _warnings(tree, parsed, joint_list, model)
    robot = _extend(tree, source, annotation, joint_list, model, locked, parsed)
    for note in notes:
        python_warnings.warn(f"{source}: {note}", SeaIdentWarning, stacklevel=3)
    return replace(robot, warnings=tuple(notes))


def _root_master(tree: UrdfTree, name: str) -> tuple[str, float, float]:
    """The joint that finally drives `name`, with multiplier and offset (mimics may be chained)."""
    multiplier, offset, seen = 1.0, 0.0, {name}
    mimic = tree.joints[name].mimic
    while mimic is not None:
        if mimic.joint in seen:
            raise RobotError(f"{tree.file}: the joints {', '.join(sorted(seen))} mimic each other in a circle")
        seen.add(mimic.joint)
        multiplier, offset = multiplier * mimic.multiplier, offset + multiplier * mimic.offset
        name, mimic = mimic.joint, tree.joints[mimic.joint].mimic
    return name, multiplier, offset


def _moving_joints(tree: UrdfTree, chosen: Sequence[str] | None) -> set[str]:
    """Names of the joints that move, mimic joints of moving ones included."""
    independent = [j.name for j in tree.joints.values() if j.type in MOVING_TYPES and j.mimic is None]
    if chosen is None:
        for joint in tree.joints.values():
            if joint.type in REFUSED_TYPES:
                raise RobotError(
                    f"{tree.file}: joint {joint.name!r} is {joint.type}, which cannot be identified as a joint; name "
                    f"the joints that move (joints=..., --joints a,b,c) to hold it fixed. "
                    f"Joints that can move: {', '.join(independent) or 'none'}"
                )
        chosen = independent
    for name in chosen:
        if name not in tree.joints:
            raise RobotError(f"{tree.file}: has no joint {name!r}; joints that can move: {', '.join(independent)}")
        joint = tree.joints[name]
        if joint.type not in MOVING_TYPES:
            raise RobotError(f"{tree.file}: joint {name!r} is {joint.type}; it cannot be chosen to move")
        if joint.mimic is not None:
            raise RobotError(f"{tree.file}: joint {name!r} mimics {joint.mimic.joint!r}; choose that one")
    if not chosen:
        raise RobotError(f"{tree.file}: no joint moves; there is nothing to identify")
    wanted = set(chosen)
    followers = {
        j.name
        for j in tree.joints.values()
        if j.mimic is not None and j.type in MOVING_TYPES and _root_master(tree, j.name)[0] in wanted
    }
    return wanted | followers


def _pinocchio_model(tree: UrdfTree, moving: set[str]) -> pin.Model:
    """Pinocchio's model of all joints, with one scalar coordinate for each."""
    root = etree.fromstring(tree.text.encode(), etree.XMLParser(resolve_entities=False, no_network=True))
    for tag in ("transmission", "gazebo", "visual", "collision"):
        for element in list(root.iter(tag)):
            element.getparent().remove(element)
    for element in root.findall("joint"):
        for mimic in element.findall("mimic"):
            element.remove(mimic)
        kind = element.get("type")
        if kind == "continuous":  # Pinocchio would take (cos, sin); one angle keeps nq = nv
            element.set("type", "revolute")
            for limit in element.findall("limit"):
                element.remove(limit)
            etree.SubElement(element, "limit", lower="-1e9", upper="1e9", velocity="1e9", effort="1e9")
        elif kind in REFUSED_TYPES:
            element.set("type", "fixed")
        if element.get("type") != "fixed":
            joint = tree.joints[element.get("name")]
            axis = element.find("axis")
            if axis is None:
                axis = etree.SubElement(element, "axis")
            axis.set("xyz", " ".join(repr(float(v)) for v in joint.axis))
            if element.find("limit") is None:
                etree.SubElement(element, "limit", lower="-1e9", upper="1e9", velocity="1e9", effort="1e9")
    try:
        model = pin.buildModelFromXML(etree.tostring(root).decode())
    except Exception as error:  # Pinocchio raises several kinds; all mean that it could not use the file
        raise RobotError(f"{tree.file}: Pinocchio cannot use it: {error}") from None
    model.name = tree.name
    missing = moving - set(model.names)
    if missing:
        raise RobotError(f"{tree.file}: Pinocchio does not see the joints {', '.join(sorted(missing))}")
    model.armature[:] = 0.0
    return model


def _lock(full: pin.Model, tree: UrdfTree, moving: set[str]) -> tuple[pin.Model, dict[str, float]]:
    """The model with every joint locked that does not move, and where it was locked."""
    reference = np.zeros(full.nq)
    locked: dict[str, float] = {}
    indices: list[int] = []
    for name in full.names[1:]:
        if name in moving:
            continue
        joint, index = tree.joints[name], full.getJointId(name)
        if joint.mimic is not None:
            master, multiplier, offset = _root_master(tree, name)
            value = multiplier * float(np.clip(0.0, tree.joints[master].lower, tree.joints[master].upper)) + offset
        else:
            value = float(np.clip(0.0, joint.lower, joint.upper))
        reference[full.joints[index].idx_q] = value
        locked[name] = value
        indices.append(index)
    return (pin.buildReducedModel(full, indices, reference) if indices else full), locked


def _warnings(tree: UrdfTree, parsed: Annotation, joints: tuple[Joint, ...], model: pin.Model) -> list[str]:
    """Check the bodies that move; what can be worked with becomes a warning."""
    notes: list[str] = []
    data = model.createData()
    for k in range(1, model.njoints):
        name, inertia = tree.joints[model.names[k]].child, model.inertias[k]
        moments = np.linalg.eigvalsh(inertia.inertia)
        if moments[0] < -1e-9 * max(moments[2], 1e-3):
            raise RobotError(
                f"{tree.file}: link {name!r}: its inertia tensor has the negative principal moment {moments[0]:.4g} "
                f"kg m2; correct <inertia>"
            )
        if moments[0] + moments[1] < moments[2] * (1.0 - 1e-6) - 1e-12:
            notes.append(
                f"link {name!r}: no body has the principal moments {moments[0]:.4g}, {moments[1]:.4g}, "
                f"{moments[2]:.4g} kg m2 (the largest exceeds the sum of the others)"
            )
    generator = np.random.default_rng(0)
    mass = pin.crba(model, data, generator.uniform(-1.0, 1.0, model.nq))
    for k in range(1, model.njoints):
        index = model.joints[k].idx_v
        if mass[index, index] <= 0.0:
            raise RobotError(
                f"{tree.file}: joint {model.names[k]!r} moves no mass: link {tree.joints[model.names[k]].child!r} and "
                f"what it carries have zero mass and inertia; give their <inertial>"
            )
        if model.inertias[k].mass == 0.0:
            notes.append(f"link {tree.joints[model.names[k]].child!r} has zero mass")
    if not any(joint.actuator is not None for joint in joints):
        notes.append("no transmission annotates its joints: it is treated as a rigid robot without motor inertia")
    outside = sorted(set(parsed.actuators) - {joint.name for joint in joints})
    for name in outside:
        mimic = tree.joints[name].mimic
        if mimic is not None:
            notes.append(f"transmission on {name!r} is ignored: that joint mimics {mimic.joint!r}")
    return notes


def _limits(tree: UrdfTree, parsed: Annotation, joints: tuple[Joint, ...], locked: dict[str, float]) -> Limits:
    """Limits of the moving joints; a combination's locked joints are moved to its bounds."""
    n, names = len(joints), [joint.name for joint in joints]
    limits = Limits.unlimited(n)

    def extra(key: str) -> FloatArray:
        return np.array([parsed.limits.get(name, {}).get(key, np.inf) for name in names])

    rows, lower, upper, labels = [], [], [], []
    for combination in parsed.combinations:
        row = np.zeros(n)
        shift = 0.0
        for name, coefficient in combination.coefficients.items():
            if name in names:
                row[names.index(name)] = coefficient
            else:
                shift += coefficient * locked.get(name, 0.0)
        if np.any(row):
            rows.append(row)
            lower.append(combination.lower - shift)
            upper.append(combination.upper - shift)
            labels.append(combination.name)
    urdf = [tree.joints[name] for name in names]
    return limits.replace(
        lower=np.array([j.lower for j in urdf]),
        upper=np.array([j.upper for j in urdf]),
        velocity=np.array([j.velocity for j in urdf]),
        acceleration=extra("acceleration"),
        jerk=extra("jerk"),
        torque=np.minimum(extra("torque"), np.array([j.effort for j in urdf])),
        deflection=extra("deflection"),
        combinations=np.array(rows).reshape(len(rows), n),
        combination_lower=np.array(lower),
        combination_upper=np.array(upper),
        combination_names=tuple(labels),
    )


def _extend(
    tree: UrdfTree,
    source: str,
    annotation: str | None,
    joints: tuple[Joint, ...],
    model: pin.Model,
    locked: dict[str, float],
    parsed: Annotation,
) -> Robot:
    """Add a body for every rotor, directly after its carrier: Pinocchio wants joints in depth-first order."""
    extended = pin.Model()
    extended.name = tree.name
    extended.gravity = model.gravity
    actuators = [joint.actuator for joint in joints if joint.actuator is not None]
    new_index: dict[int, int] = {}
    rotor_index: dict[str, int] = {}

    def add_rotors(carrier: int) -> None:
        for actuator in actuators:
            frame = model.frames[model.getFrameId(actuator.carrier)]
            if frame.parentJoint != carrier:
                continue
            axis = frame.placement.rotation @ actuator.rotor_axis
            rotation = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), axis).matrix()
            index = extended.addJoint(
                new_index[carrier],
                pin.JointModelRZ(),
                pin.SE3(rotation, np.zeros(3)),
                f"{actuator.joint} rotor",
            )
            extended.appendBodyToJoint(index, rotor_body(actuator.rotor_inertia or 0.0), pin.SE3.Identity())
            rotor_index[actuator.joint] = index

    new_index[0] = 0
    add_rotors(0)
    for k in range(1, model.njoints):
        parent = new_index[model.parents[k]]
        index = extended.addJoint(parent, model.joints[k], model.jointPlacements[k], model.names[k])
        extended.appendBodyToJoint(index, model.inertias[k], pin.SE3.Identity())
        new_index[k] = index
        add_rotors(k)
    extended.armature[:] = 0.0

    names = [joint.name for joint in joints]
    link_map, motor_map = np.zeros((extended.nv, len(joints))), np.zeros((extended.nv, len(joints)))
    offset = np.zeros(extended.nv)
    for k in range(1, model.njoints):
        master, multiplier, shift = _root_master(tree, model.names[k])
        row = extended.joints[new_index[k]].idx_v
        link_map[row, names.index(master)] = multiplier
        offset[row] = shift
    for actuator in actuators:
        motor_map[extended.joints[rotor_index[actuator.joint]].idx_v, names.index(actuator.joint)] = actuator.gear_ratio
    rotors: tuple[Actuator, ...] = tuple(actuators)
    return Robot(
        name=tree.name,
        source=source,
        urdf=tree.text,
        annotation=annotation,
        joints=joints,
        limits=_limits(tree, parsed, joints, locked),
        bodies=tuple(tree.joints[model.names[k]].child for k in range(1, model.njoints)),
        rotors=rotors,
        model=model,
        extended_model=extended,
        body_indices=np.array([new_index[k] for k in range(1, model.njoints)], dtype=np.intp),
        rotor_indices=np.array([rotor_index[a.joint] for a in rotors], dtype=np.intp),
        link_map=link_map,
        motor_map=motor_map,
        offset=offset,
        locked=locked,
    )
