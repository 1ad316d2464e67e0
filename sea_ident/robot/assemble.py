"""Pinocchio's models of a robot: the links, the locked ones merged, and the rotors added."""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from lxml import etree

from sea_ident._typing import FloatArray, IntArray
from sea_ident.exceptions import RobotError
from sea_ident.robot.actuator import Actuator
from sea_ident.robot.joints import locked_position, root_master
from sea_ident.robot.model import rotor_body
from sea_ident.robot.urdf import MOVING_TYPES, UrdfTree


def _words(values: FloatArray) -> str:
    return " ".join(repr(float(value)) for value in values)


def link_model(tree: UrdfTree, moving: set[str]) -> tuple[pin.Model, dict[str, float]]:
    """Pinocchio's model of the links, with one scalar coordinate for every joint that moves.

    Pinocchio reads a URDF that is written here with nothing but what it needs, so that nothing else in a file, nor a
    strange name, can confuse it. Continuous joints get one angle (nq = nv); floating and planar joints are fixed.

    Args:
        tree: the kinematic tree.
        moving: names of the joints that move; every other one is locked.

    Returns:
        The model, its other links merged into those that carry them, and the position of each locked joint. Joints and
        frames carry the names of the URDF, their order is Pinocchio's own.

    Raises:
        RobotError: if Pinocchio cannot use it.
    """
    # Plain names that sort like the real ones: Pinocchio's order of joints follows from the names.
    links = {name: f"l{k:06d}" for k, name in enumerate(sorted(tree.links, key=str.encode))}
    joints = {name: f"j{k:06d}" for k, name in enumerate(sorted(tree.joints, key=str.encode))}
    root = etree.Element("robot", name="robot")
    for name, inertial in tree.links.items():
        link = etree.SubElement(root, "link", name=links[name])
        if inertial is not None:
            element = etree.SubElement(link, "inertial")
            etree.SubElement(element, "origin", xyz=_words(inertial.centre), rpy=_words(inertial.rpy))
            etree.SubElement(element, "mass", value=repr(inertial.mass))
            names = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}
            etree.SubElement(element, "inertia", {key: repr(float(inertial.tensor[at])) for key, at in names.items()})
    for joint in tree.joints.values():
        moves = joint.type in MOVING_TYPES
        kind = ("prismatic" if joint.type == "prismatic" else "revolute") if moves else "fixed"
        element = etree.SubElement(root, "joint", name=joints[joint.name], type=kind)
        etree.SubElement(element, "origin", xyz=_words(joint.origin), rpy=_words(joint.rpy))
        etree.SubElement(element, "parent", link=links[joint.parent])
        etree.SubElement(element, "child", link=links[joint.child])
        if moves:
            etree.SubElement(element, "axis", xyz=_words(joint.axis))
            limit = {"lower": joint.lower, "upper": joint.upper, "velocity": joint.velocity, "effort": joint.effort}
            etree.SubElement(element, "limit", {k: repr(float(np.clip(v, -1e9, 1e9))) for k, v in limit.items()})
    try:
        model = pin.buildModelFromXML(etree.tostring(root).decode())
    except Exception as error:  # Pinocchio raises several kinds; all mean that it could not use the file
        raise RobotError(f"{tree.file}: Pinocchio cannot use it: {error}") from None
    # joints are locked under the plain names: those of the URDF may be a joint's and a link's at once
    real = {short: name for names in (links, joints) for name, short in names.items()}
    held = [k for k in range(1, model.njoints) if real[model.names[k]] not in moving]
    locked = {real[model.names[k]]: locked_position(tree, real[model.names[k]]) for k in held}
    reference = np.zeros(model.nq)
    for k in held:
        reference[model.joints[k].idx_q] = locked[real[model.names[k]]]
    if held:
        model = pin.buildReducedModel(model, held, reference)
    model.name = tree.name
    for k in range(1, model.njoints):
        model.names[k] = real[model.names[k]]
    for frame in model.frames:
        frame.name = real.get(frame.name, frame.name)
    model.armature[:] = 0.0
    return model, locked


@dataclass(frozen=True, eq=False)
class ExtendedModel:
    """Links and rotors as one tree, with the map onto its coordinates (see `Robot`)."""

    model: pin.Model
    body_indices: IntArray
    rotor_indices: IntArray
    link_map: FloatArray
    motor_map: FloatArray
    offset: FloatArray


def add_rotors(tree: UrdfTree, links: pin.Model, names: list[str], actuators: list[Actuator]) -> ExtendedModel:
    """Add a body for every rotor, directly after its carrier: Pinocchio wants joints in depth-first order.

    Args:
        tree: the kinematic tree.
        links: model of the moving links.
        names: (n,) joints that move on their own.
        actuators: the motors.

    Returns:
        The extended model.
    """
    extended = pin.Model()
    extended.name = tree.name
    extended.gravity = links.gravity
    carriers = [links.frames[links.getFrameId(a.carrier, pin.FrameType.BODY)] for a in actuators]
    new_index, rotor_index = {0: 0}, {}

    def rotors_on(body: int) -> None:
        for actuator, carrier in zip(actuators, carriers, strict=True):
            if carrier.parentJoint != body:
                continue
            axis = carrier.placement.rotation @ actuator.rotor_axis
            rotation = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), axis).matrix()
            placement = pin.SE3(rotation, np.zeros(3))
            index = extended.addJoint(new_index[body], pin.JointModelRZ(), placement, f"{actuator.joint} rotor")
            extended.appendBodyToJoint(index, rotor_body(actuator.rotor_inertia or 0.0), pin.SE3.Identity())
            rotor_index[actuator.joint] = index

    rotors_on(0)
    for k in range(1, links.njoints):
        parent = new_index[links.parents[k]]
        index = extended.addJoint(parent, links.joints[k], links.jointPlacements[k], links.names[k])
        extended.appendBodyToJoint(index, links.inertias[k], pin.SE3.Identity())
        new_index[k] = index
        rotors_on(k)
    extended.armature[:] = 0.0

    link_map, motor_map = np.zeros((extended.nv, len(names))), np.zeros((extended.nv, len(names)))
    offset = np.zeros(extended.nv)
    for k in range(1, links.njoints):
        master, multiplier, shift = root_master(tree, links.names[k])
        row = extended.joints[new_index[k]].idx_v
        link_map[row, names.index(master)] = multiplier
        offset[row] = shift
    for actuator in actuators:
        motor_map[extended.joints[rotor_index[actuator.joint]].idx_v, names.index(actuator.joint)] = actuator.gear_ratio
    return ExtendedModel(
        model=extended,
        body_indices=np.array([new_index[k] for k in range(1, links.njoints)], dtype=np.intp),
        rotor_indices=np.array([rotor_index[a.joint] for a in actuators], dtype=np.intp),
        link_map=link_map,
        motor_map=motor_map,
        offset=offset,
    )
