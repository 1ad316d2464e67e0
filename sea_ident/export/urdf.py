"""The user's URDF with the identified values in it, and everything else as it was."""

import re

from sea_ident._typing import FloatArray
from sea_ident.exceptions import ExportError
from sea_ident.export.bodies import LinkShare, share_bodies
from sea_ident.export.values import ExportValues, JointValues
from sea_ident.export.xml_edit import Node, XmlText
from sea_ident.robot import Actuator
from sea_ident.robot.annotation import LINEAR_LIMIT, RIGID, SERIES_ELASTIC
from sea_ident.robot.urdf import parse_urdf

_TENSOR = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}


def urdf_text(values: ExportValues) -> tuple[str, list[str]]:
    """Write the values into the URDF that the robot was loaded from.

    Replaced are the inertials of the links that move, and of the joints that move `<dynamics>` and transmissions.
    Comments, geometry, layout, other elements and locked joints stay as they are. Transmissions of an annotation
    fragment move into the URDF and take the place of those it has for the same joints.

    Args:
        values: the values.

    Returns:
        Text of the URDF, and notes for the user.

    Raises:
        ExportError: if a body is not physically consistent.
    """
    robot = values.robot
    shares, notes = share_bodies(robot, parse_urdf(robot.urdf, robot.source))
    text = re.sub(r"(<\?xml[^>]*encoding=)(\"[^\"]*\"|'[^']*')", r'\1"utf-8"', robot.urdf, count=1)
    if robot.annotation is not None:
        text = _with_transmissions(text, robot.annotation, set(robot.joint_names))
    document = XmlText(text)
    for share in shares:
        _write_inertial(document, share)
    for joint, joint_values in zip(robot.joints, values.joints, strict=True):
        _write_dynamics(document, joint_values, elastic=joint.elastic)
        if joint.actuator is not None:
            _write_transmission(document, joint.actuator, joint_values)
    left_out = [*values.left_out, *(f"{v.joint}.torque_offset" for v in values.joints if v.torque_offset)]
    if left_out:
        notes.append(f"a URDF has no place for {', '.join(left_out)}: left out")
    return document.text(), notes


def _named(document: XmlText, tag: str, name: str) -> Node:
    return next(node for node in document.root.all(tag) if node.attributes.get("name") == name)


def _write_inertial(document: XmlText, share: LinkShare) -> None:
    link = _named(document, "link", share.link)
    inertial = link.first("inertial")
    if share.scale is not None:
        for tag, keys in (("mass", ("value",)), ("inertia", tuple(_TENSOR))):
            element = None if inertial is None else inertial.first(tag)
            for key in keys:
                if element is not None and key in element.attributes:
                    document.set(element, key, _number(share.scale * float(element.attributes[key])))
        return
    if share.inertia is None:
        if inertial is not None:
            document.remove(inertial)
        return
    new = {
        "origin": {"xyz": _numbers(share.inertia.lever), "rpy": "0 0 0"},
        "mass": {"value": _number(share.inertia.mass)},
        "inertia": {key: _number(share.inertia.inertia[at]) for key, at in _TENSOR.items()},
    }
    if inertial is None:
        lines = "\n".join(f"  {_element(tag, attributes)}" for tag, attributes in new.items())
        document.add(link, f"<inertial>\n{lines}\n</inertial>", first=True)
        return
    for tag, attributes in new.items():
        element = inertial.first(tag)
        if element is None:
            document.add(inertial, _element(tag, attributes), first=True)
            continue
        for key, value in attributes.items():
            if key != "rpy" or "rpy" in element.attributes:
                document.set(element, key, value)


def _write_dynamics(document: XmlText, values: JointValues, *, elastic: bool) -> None:
    """Friction of the link side; at a rigid joint all the friction there is."""
    joint = _named(document, "joint", values.joint)
    damping = values.link_viscous_friction if elastic else values.viscous_friction
    friction = values.link_coulomb_friction if elastic else values.coulomb_friction
    _write_element(document, joint, "dynamics", {"damping": damping or 0.0, "friction": friction or 0.0})


def _write_element(document: XmlText, parent: Node, tag: str, numbers: dict[str, float]) -> None:
    """Attributes of a child, which is made unless all of them are zero."""
    element = parent.first(tag)
    if element is not None:
        for key, value in numbers.items():
            document.set(element, key, _number(value))
    elif any(numbers.values()):
        document.add(parent, _element(tag, {key: _number(value) for key, value in numbers.items()}))


def _write_transmission(document: XmlText, actuator: Actuator, values: JointValues) -> None:
    transmission = _transmission_of(document, actuator)
    element = transmission.first("actuator")
    if element is None:
        return
    contents = {"rotorInertia": actuator.rotor_inertia}
    if actuator.elastic:
        contents |= {"viscousFriction": values.viscous_friction, "coulombFriction": values.coulomb_friction}
    else:  # it stands in <dynamics>
        for tag in ("viscousFriction", "coulombFriction"):
            for old in element.all(tag):
                document.remove(old)
    for tag, value in contents.items():
        if value is None:
            continue
        child = element.first(tag)
        if child is None:
            document.add(element, f"<{tag}>{_number(value)}</{tag}>")
        else:
            document.set_content(child, _number(value))
    law = {"stiffness": values.stiffness, "cubicStiffness": values.cubic_stiffness, "damping": values.damping}
    known = {key: value for key, value in law.items() if value is not None}
    if actuator.elastic and known:
        _write_element(document, transmission, "seriesElastic", known)


def _transmission_of(document: XmlText, actuator: Actuator) -> Node:
    for transmission in document.root.all("transmission"):
        joints = [joint.attributes.get("name") for joint in transmission.all("joint")]
        motors = [motor.attributes.get("name", f"{actuator.joint}_motor") for motor in transmission.all("actuator")]
        if joints == [actuator.joint] and motors == [actuator.name] and _kind(transmission) != LINEAR_LIMIT:
            return transmission
    raise ExportError(f"the URDF has no transmission of joint {actuator.joint!r} with actuator {actuator.name!r}")


def _kind(transmission: Node) -> str:
    child = transmission.first("type")
    return transmission.attributes.get("type") or ("" if child is None else child.content.strip())


def _with_transmissions(urdf: str, annotation: str, moving: set[str]) -> str:
    """The URDF with the transmissions of a fragment, instead of those that would count beside them."""
    document, fragment = XmlText(urdf), XmlText(annotation)
    for old in document.root.all("transmission"):
        names = {joint.attributes.get("name") for joint in old.all("joint")}
        if names & moving and _kind(old) in (SERIES_ELASTIC, LINEAR_LIMIT, RIGID) and not _is_for_others(old):
            document.remove(old)
    texts = []
    for transmission in fragment.root.all("transmission"):
        lines = fragment.source(transmission).splitlines()
        indents = [len(line) - len(line.lstrip()) for line in lines[1:] if line.strip()]
        depth = max(min(indents, default=0), 0)
        texts.append("\n".join([lines[0], *(line[depth:] if line[:depth].isspace() else line for line in lines[1:])]))
    for text in texts:
        document.add(document.root, text)
    return document.text()


def _is_for_others(transmission: Node) -> bool:
    """Whether it is rigid and states no gear and no motor: written for other tools, not read here."""
    if _kind(transmission) != RIGID:
        return False
    tags = {child.tag for part in transmission.children for child in part.children}
    told = {"torqueConstant", "rotorInertia", "rotorAxis", "efficiency", "viscousFriction", "coulombFriction", "limit"}
    ratios = [c.content.strip() for part in transmission.children for c in part.all("mechanicalReduction")]
    return not tags & told and all(ratio in ("1", "1.0") for ratio in ratios)


def _element(tag: str, attributes: dict[str, str]) -> str:
    return f"<{tag} " + " ".join(f'{key}="{value}"' for key, value in attributes.items()) + "/>"


def _number(value: float) -> str:
    return repr(float(value))


def _numbers(values: FloatArray) -> str:
    return " ".join(map(_number, values))
