"""Reading of URDF text: the kinematic tree, and the checks that Pinocchio does not make.

Only what rigid-body dynamics needs is looked at; geometry is left alone, so missing meshes do not matter.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from lxml import etree

from sea_ident._typing import FloatArray
from sea_ident.exceptions import RobotError
from sea_ident.robot.xml import number, parse_xml, vector

MOVING_TYPES = ("revolute", "continuous", "prismatic")
REFUSED_TYPES = ("floating", "planar", "spherical", "ball")
# Pinocchio's reader recurses along the chain: some thousand links in a row overflow the stack.
LONGEST_CHAIN = 1000
MOST_LINKS = 10000
# Converters write 1e16 where there is no limit.
NO_LIMIT = 1e6


@dataclass(frozen=True, eq=False)
class Mimic:
    """Position = multiplier x position of another joint + offset."""

    joint: str
    multiplier: float
    offset: float


@dataclass(frozen=True, eq=False)
class JointElement:
    """A joint as its URDF states it.

    Attributes:
        name: name of the joint.
        type: URDF type: revolute, continuous, prismatic, fixed, floating, planar.
        parent: name of the parent link.
        child: name of the child link.
        axis: (3,) unit axis in the joint frame [-].
        origin: (3,) position of the joint frame in the parent link [m].
        rpy: (3,) its roll, pitch, yaw [rad].
        lower: lowest position [rad] or [m].
        upper: highest position [rad] or [m].
        velocity: largest speed [rad/s] or [m/s].
        effort: largest torque [N m] or force [N].
        damping: viscous friction of the link side [N m s/rad] or [N s/m]; None where not stated.
        friction: Coulomb friction of the link side [N m] or [N]; None where not stated.
        mimic: the joint that this one follows.
    """

    name: str
    type: str
    parent: str
    child: str
    axis: FloatArray
    origin: FloatArray
    rpy: FloatArray
    lower: float
    upper: float
    velocity: float
    effort: float
    damping: float | None
    friction: float | None
    mimic: Mimic | None

    @property
    def rotation(self) -> FloatArray:
        """(3, 3) orientation of the joint frame in the parent link [-]."""
        return rotation_from_rpy(self.rpy)


@dataclass(frozen=True, eq=False)
class Inertial:
    """Mass properties of a link as its URDF states them.

    Attributes:
        mass: [kg].
        centre: (3,) centre of mass in the link frame [m].
        rpy: (3,) roll, pitch, yaw of the frame of the tensor [rad].
        tensor: (3, 3) inertia about the centre of mass, in that frame [kg m2].
    """

    mass: float
    centre: FloatArray
    rpy: FloatArray
    tensor: FloatArray


@dataclass(frozen=True, eq=False)
class UrdfTree:
    """The kinematic tree of a URDF.

    Attributes:
        name: name of the robot.
        text: the XML it was read from.
        file: where it came from, for messages.
        root: the parsed XML.
        base: name of the root link.
        links: link names to their inertial, None where they state none.
        joints: joints by name, in file order.
    """

    name: str
    text: str
    file: str
    root: etree._Element
    base: str
    links: dict[str, Inertial | None]
    joints: dict[str, JointElement]

    def path_to_root(self, link: str) -> tuple[str, ...]:
        """Names of the links from `link` (included) up to the root link."""
        parent_of = {j.child: j.parent for j in self.joints.values()}
        path = [link]
        while path[-1] in parent_of:
            path.append(parent_of[path[-1]])
        return tuple(path)


def rotation_from_rpy(rpy: FloatArray) -> FloatArray:
    """Rotation matrix (3, 3) of URDF roll, pitch, yaw [rad]."""
    (sr, sp, sy), (cr, cp, cy) = np.sin(rpy), np.cos(rpy)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def _inertial(link: etree._Element, where: str) -> Inertial | None:
    inertial = link.find("inertial")
    if inertial is None:
        return None
    mass_element, tensor_element, origin = (inertial.find(tag) for tag in ("mass", "inertia", "origin"))
    for tag, element in (("mass", mass_element), ("inertia", tensor_element)):
        if element is None:
            raise RobotError(f"{where}: <inertial> has no <{tag}>; add it or remove the <inertial>")
    mass = number(mass_element, "value", None, where)
    if mass < 0.0:
        raise RobotError(f"{where}: mass is {mass} kg; a mass cannot be negative")
    tensor = np.zeros((3, 3))
    for i, name in enumerate(("ixx", "iyy", "izz")):
        tensor[i, i] = number(tensor_element, name, None, where)
        if tensor[i, i] < -1e-12:  # CAD exports write a zero as -5e-20
            raise RobotError(f"{where}: {name} is {tensor[i, i]} kg m2; a moment of inertia cannot be negative")
    for (i, j), name in (((0, 1), "ixy"), ((0, 2), "ixz"), ((1, 2), "iyz")):
        tensor[i, j] = tensor[j, i] = number(tensor_element, name, 0.0, where)
    return Inertial(mass, vector(origin, "xyz", "0 0 0", where), vector(origin, "rpy", "0 0 0", where), tensor)


def _joint(element: etree._Element, file: str) -> JointElement:
    name = element.get("name", "")
    if not name:
        raise RobotError(f"{file}: a <joint> (line {element.sourceline}) has no name")
    where = f"{file}: joint {name!r}"
    kind = element.get("type", "")
    if kind not in (*MOVING_TYPES, *REFUSED_TYPES, "fixed"):
        raise RobotError(f"{where}: unknown type {kind!r}; use revolute, continuous, prismatic or fixed")
    ends = {}
    for end in ("parent", "child"):
        end_element = element.find(end)
        if end_element is None or not end_element.get("link"):
            raise RobotError(f"{where}: has no <{end} link=...>")
        ends[end] = end_element.get("link", "")
    axis = vector(element.find("axis"), "xyz", "1 0 0", where)
    if kind in MOVING_TYPES:
        length = float(np.linalg.norm(axis))
        if length < 1e-3 or abs(length - 1.0) > 1e-2:
            unit = "" if length < 1e-3 else f": {' '.join(f'{part:.9g}' for part in axis / length)}"
            raise RobotError(f"{where}: axis {axis.tolist()} has length {length:.6g}, not 1; give a unit axis{unit}")
        axis = axis / length
    limit, dynamics, mimic_element = element.find("limit"), element.find("dynamics"), element.find("mimic")
    inf = float("inf")
    lower, upper, velocity, effort = -inf, inf, inf, inf
    if limit is not None:
        velocity = abs(_bound(limit, "velocity", inf, where)) or inf
        effort = abs(_bound(limit, "effort", inf, where)) or inf
        if kind in ("revolute", "prismatic"):
            # URDF: an omitted bound of a limited joint is zero; both zero means that none was stated.
            lower, upper = (_bound(limit, side, 0.0, where) for side in ("lower", "upper"))
            if lower > upper:
                raise RobotError(f"{where}: lower limit {lower} is above upper limit {upper}; exchange them")
            if lower == upper == 0.0:
                lower, upper = -inf, inf
            if lower == upper:
                raise RobotError(f"{where}: lower and upper limit are both {lower}; widen them, or make it fixed")
    mimic = None
    if mimic_element is not None:
        mimic = Mimic(
            joint=mimic_element.get("joint", ""),
            multiplier=number(mimic_element, "multiplier", 1.0, where),
            offset=number(mimic_element, "offset", 0.0, where),
        )
    damping = friction = None
    if dynamics is not None:
        damping = number(dynamics, "damping", 0.0, where) if "damping" in dynamics.attrib else None
        friction = number(dynamics, "friction", 0.0, where) if "friction" in dynamics.attrib else None
        for label, value in (("damping", damping), ("friction", friction)):
            if value is not None and value < 0.0:
                raise RobotError(f"{where}: {label} is {value}; it cannot be negative")
    origin = element.find("origin")
    return JointElement(
        name=name,
        type=kind,
        parent=ends["parent"],
        child=ends["child"],
        axis=axis,
        origin=vector(origin, "xyz", "0 0 0", where),
        rpy=vector(origin, "rpy", "0 0 0", where),
        lower=lower,
        upper=upper,
        velocity=velocity,
        effort=effort,
        damping=damping,
        friction=friction,
        mimic=mimic,
    )


def _bound(limit: etree._Element, attribute: str, default: float, where: str) -> float:
    """A limit, infinite where it is one only by name."""
    value = number(limit, attribute, default, where, finite=False)
    return value if abs(value) < NO_LIMIT else float(np.copysign(np.inf, value))


def parse_urdf(text: str | bytes, file: str) -> UrdfTree:
    """Read the kinematic tree of a URDF and check that it is one.

    Args:
        text: the XML.
        file: where it came from, for messages.

    Returns:
        The tree.

    Raises:
        RobotError: malformed XML, duplicate names, unknown links, closed loops, several roots, negative masses.
    """
    root = parse_xml(text, file)
    if root.tag != "robot":
        hint = "; expand it with xacro first" if "xacro" in str(root.tag) else ""
        raise RobotError(f"{file}: the root element is <{root.tag}>, not <robot>{hint}")
    links: dict[str, Inertial | None] = {}
    for link in root.findall("link"):
        name = link.get("name", "")
        if not name:
            raise RobotError(f"{file}: a <link> (line {link.sourceline}) has no name")
        if name in links:
            raise RobotError(f"{file}: two links are named {name!r}; rename one")
        links[name] = _inertial(link, f"{file}: link {name!r}")
    joints: dict[str, JointElement] = {}
    for element in root.findall("joint"):
        joint = _joint(element, file)
        if joint.name in joints:
            raise RobotError(f"{file}: two joints are named {joint.name!r}; rename one")
        joints[joint.name] = joint
    if not links:
        if root.find("transmission") is not None:
            raise RobotError(f"{file}: has transmissions but no <link>: it is an annotation; give it with its robot")
        raise RobotError(f"{file}: has no <link>; is it a URDF?")
    if len(links) > MOST_LINKS:
        raise RobotError(f"{file}: has {len(links)} links; at most {MOST_LINKS} are read")
    base = _check_tree(links, joints, file)
    decoded = text if isinstance(text, str) else text.decode("utf-8", errors="replace")
    return UrdfTree(root.get("name") or Path(file).stem, decoded, file, root, base, links, joints)


def _check_tree(links: dict[str, Inertial | None], joints: dict[str, JointElement], file: str) -> str:
    """The name of the single root link, or an error that says why this is not a tree."""
    parent_joint: dict[str, str] = {}
    for joint in joints.values():
        for link in (joint.parent, joint.child):
            if link not in links:
                raise RobotError(f"{file}: joint {joint.name!r} names the link {link!r}, which does not exist")
        if joint.child in parent_joint:
            raise RobotError(
                f"{file}: link {joint.child!r} is the child of two joints, {parent_joint[joint.child]!r} and "
                f"{joint.name!r}: a closed loop. Cut the loop: remove one of the two joints"
            )
        parent_joint[joint.child] = joint.name
    roots = [link for link in links if link not in parent_joint]
    if not roots:
        raise RobotError(f"{file}: no link is a root: the joints form a closed loop. Remove one joint of it")
    if len(roots) > 1:
        raise RobotError(f"{file}: several root links: {', '.join(roots)}; connect them by fixed joints")
    depth, children = {roots[0]: 0}, [roots[0]]
    by_parent: dict[str, list[str]] = {}
    for joint in joints.values():
        by_parent.setdefault(joint.parent, []).append(joint.child)
    while children:
        parent = children.pop()
        for child in by_parent.get(parent, []):
            depth[child] = depth[parent] + 1
            children.append(child)
    if len(depth) < len(links):
        lost = ", ".join(sorted(set(links) - set(depth)))
        raise RobotError(f"{file}: the links {lost} form a closed loop. Remove one of its joints")
    longest = max(depth.values())
    if longest > LONGEST_CHAIN:
        raise RobotError(f"{file}: {longest} joints follow each other in a chain; at most {LONGEST_CHAIN} are read")
    return roots[0]
