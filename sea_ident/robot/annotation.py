"""The annotation: URDF <transmission> elements, in the URDF itself or in a fragment of their own."""

from dataclasses import dataclass

import numpy as np
from lxml import etree

from sea_ident._typing import FloatArray
from sea_ident.exceptions import RobotError
from sea_ident.robot.actuator import Actuator, SeriesElasticActuator
from sea_ident.robot.spelling import check_spelling
from sea_ident.robot.urdf import MOVING_TYPES, UrdfTree
from sea_ident.robot.workspace import (
    HALF_SPACE,
    SELF_COLLISION,
    HalfSpace,
    SelfCollision,
    parse_half_spaces,
    parse_self_collision,
)
from sea_ident.robot.xml import LARGEST_NUMBER, number, vector

SERIES_ELASTIC = "sea_ident/SeriesElastic"
LINEAR_LIMIT = "sea_ident/LinearLimit"
RIGID = "transmission_interface/SimpleTransmission"
EXTRA_LIMITS = ("acceleration", "jerk", "deflection", "torque")


@dataclass(frozen=True, eq=False)
class LinearLimit:
    """lower <= sum of coefficient x position <= upper.

    Attributes:
        name: name of the transmission element.
        coefficients: coefficient of each joint [-].
        lower: lowest value [rad] or [m].
        upper: highest value [rad] or [m].
    """

    name: str
    coefficients: dict[str, float]
    lower: float
    upper: float


@dataclass(frozen=True, eq=False)
class Annotation:
    """What the transmissions say.

    Attributes:
        actuators: actuator of each joint that has one.
        limits: further limits of each joint: acceleration, jerk, deflection, torque.
        combinations: limits on linear combinations of joint positions.
        ignored: types of the transmissions that are not read.
        half_spaces: limits on where points of links may be.
        self_collision: the distance that links keep from each other.
    """

    actuators: dict[str, Actuator]
    limits: dict[str, dict[str, float]]
    combinations: tuple[LinearLimit, ...]
    ignored: tuple[str, ...]
    half_spaces: tuple[HalfSpace, ...] = ()
    self_collision: SelfCollision | None = None


def _text_number(parent: etree._Element, tag: str, where: str, *, positive: bool = True) -> float | None:
    element = parent.find(tag)
    if element is None:
        return None
    text = (element.text or "").strip()
    try:
        value = float(text)
    except ValueError:
        hint = "; expand the file with xacro first" if "${" in text else ""
        raise RobotError(f"{where}: <{tag}> holds {text!r}, not a number{hint}") from None
    if not abs(value) <= LARGEST_NUMBER or (positive and value < 0.0):
        raise RobotError(f"{where}: <{tag}> is {text}; it must be finite and not negative")
    return value


def _rotor_axis(actuator: etree._Element, joint: str, tree: UrdfTree, where: str) -> tuple[str, FloatArray]:
    """Carrier link and (3,) unit spin axis in its frame."""
    urdf_joint = tree.joints[joint]
    element = actuator.find("rotorAxis")
    if element is None:
        return urdf_joint.parent, urdf_joint.rotation @ urdf_joint.axis
    link = element.get("link", urdf_joint.parent)
    if link not in tree.links:
        raise RobotError(f"{where}: <rotorAxis> names the link {link!r}, which does not exist")
    ancestors = tree.path_to_root(urdf_joint.parent)
    if link not in ancestors:
        raise RobotError(
            f"{where}: <rotorAxis> is on link {link!r}, which does not carry the joint {joint!r}; "
            f"use one of {', '.join(ancestors)}"
        )
    if "xyz" not in element.attrib:
        raise RobotError(f"{where}: <rotorAxis> has no xyz; give the unit spin axis in the frame of {link!r}")
    axis = vector(element, "xyz", "", where)
    length = float(np.linalg.norm(axis))
    if abs(length - 1.0) > 1e-3:
        raise RobotError(f"{where}: <rotorAxis> {axis.tolist()} has length {length:.6g}, not 1; give a unit axis")
    return link, axis / length


def _actuator(transmission: etree._Element, joint: str, tree: UrdfTree, where: str) -> Actuator:
    elements = transmission.findall("actuator")
    if len(elements) != 1:
        raise RobotError(f"{where}: has {len(elements)} <actuator>; exactly one is read")
    element = elements[0]
    gear_ratio = _text_number(element, "mechanicalReduction", where, positive=False)
    if gear_ratio is None:
        on_joint = transmission.find("joint")
        gear_ratio = None if on_joint is None else _text_number(on_joint, "mechanicalReduction", where, positive=False)
    if gear_ratio is None:
        gear_ratio = 1.0
        if transmission.get("type") == SERIES_ELASTIC:
            raise RobotError(f"{where}: no <mechanicalReduction> in <actuator>; give the gear ratio")
    if gear_ratio == 0.0:
        raise RobotError(f"{where}: the gear ratio <mechanicalReduction> is 0; give motor angle per joint angle")
    efficiency = _text_number(element, "efficiency", where)
    if efficiency is not None and not 0.0 < efficiency <= 1.0:
        raise RobotError(f"{where}: <efficiency> is {efficiency}; it must be in (0, 1]")
    inertia_element = element.find("rotorInertia")
    group = joint if inertia_element is None else inertia_element.get("group", joint)
    carrier, axis = _rotor_axis(element, joint, tree, where)
    name = element.get("name", f"{joint}_motor")
    torque_constant = _text_number(element, "torqueConstant", where)
    if torque_constant == 0.0:
        raise RobotError(f"{where}: <torqueConstant> is 0 N m/A; give its value or leave it out")
    rotor_inertia = _text_number(element, "rotorInertia", where)
    viscous, coulomb = (_text_number(element, tag, where) for tag in ("viscousFriction", "coulombFriction"))
    if transmission.get("type") != SERIES_ELASTIC:
        return Actuator(
            name,
            joint,
            gear_ratio,
            torque_constant,
            rotor_inertia,
            group,
            efficiency,
            viscous,
            coulomb,
            carrier,
            axis,
        )
    spring = transmission.find("seriesElastic")
    values: dict[str, float | None] = {"stiffness": None, "cubicStiffness": None, "damping": None}
    if spring is not None:
        for key in values:
            values[key] = number(spring, key, None, where) if key in spring.attrib else None
            value = values[key]
            if value is not None and key != "cubicStiffness" and (value < 0.0 or (key == "stiffness" and value == 0.0)):
                raise RobotError(f"{where}: {key} of the spring is {value}; it must be positive")
    return SeriesElasticActuator(
        name, joint, gear_ratio, torque_constant, rotor_inertia, group, efficiency, viscous, coulomb, carrier, axis,
        stiffness=values["stiffness"], cubic_stiffness=values["cubicStiffness"], damping=values["damping"],
    )  # fmt: skip


def _known_joint(name: str, tree: UrdfTree, where: str) -> str:
    if name not in tree.joints:
        known = [joint.name for joint in tree.joints.values() if joint.type in MOVING_TYPES]
        raise RobotError(
            f"{where}: names the joint {name!r}, which is not in {tree.file}; its joints: {', '.join(known)}"
        )
    kind = tree.joints[name].type
    if kind not in MOVING_TYPES:
        raise RobotError(f"{where}: names the joint {name!r}, which is {kind}; a motor needs a joint that moves")
    return name


def _one_joint(transmission: etree._Element, tree: UrdfTree, where: str) -> str:
    elements = transmission.findall("joint")
    if len(elements) != 1:
        raise RobotError(f"{where}: has {len(elements)} <joint>; exactly one is read")
    return _known_joint(str(elements[0].get("name", "")), tree, where)


def _linear_limit(transmission: etree._Element, tree: UrdfTree, where: str) -> LinearLimit:
    coefficients: dict[str, float] = {}
    for element in transmission.findall("joint"):
        joint = _known_joint(element.get("name", ""), tree, where)
        if joint in coefficients:
            raise RobotError(f"{where}: names the joint {joint!r} twice; name it once")
        value = _text_number(element, "coefficient", where, positive=False)
        coefficients[joint] = 1.0 if value is None else value
    limit = transmission.find("limit")
    if limit is None or not coefficients:
        raise RobotError(f"{where}: needs <joint> elements and a <limit lower=... upper=...>")
    infinity = float("inf")
    lower = number(limit, "lower", -infinity, where)
    upper = number(limit, "upper", infinity, where)
    if lower > upper:
        raise RobotError(f"{where}: lower limit {lower} is above upper limit {upper}; exchange them")
    return LinearLimit(transmission.get("name", "combination"), coefficients, lower, upper)


def _says_nothing(transmission: etree._Element) -> bool:
    """Whether a rigid transmission states no gear and no motor, as URDFs written for simulators often do."""
    tags = ("torqueConstant", "rotorInertia", "rotorAxis", "efficiency", "viscousFriction", "coulombFriction")
    if any(transmission.find(f"actuator/{tag}") is not None for tag in tags):
        return False
    if transmission.find("joint/limit") is not None:
        return False
    return all((e.text or "").strip() in ("1", "1.0") for e in transmission.iter("mechanicalReduction"))


def parse_annotation(root: etree._Element, file: str, tree: UrdfTree) -> Annotation:
    """Read the transmissions below `root`.

    Args:
        root: root element of the URDF or of the fragment.
        file: where it came from, for messages.
        tree: the kinematic tree that it annotates.

    Returns:
        The annotation; empty where there is no transmission.

    Raises:
        RobotError: unknown joint or link, two transmissions on one joint, values out of range.
    """
    actuators: dict[str, Actuator] = {}
    limits: dict[str, dict[str, float]] = {}
    combinations: list[LinearLimit] = []
    ignored: list[str] = []
    half_spaces: list[HalfSpace] = []
    self_collision: SelfCollision | None = None
    for transmission in root.findall("transmission"):
        name = transmission.get("name", f"(line {transmission.sourceline})")
        where = f"{file}: transmission {name!r}"
        kind = transmission.get("type") or (transmission.findtext("type") or "").strip()
        if kind == LINEAR_LIMIT:
            combinations.append(_linear_limit(transmission, tree, where))
            continue
        if kind == HALF_SPACE:
            half_spaces += parse_half_spaces(transmission, tree, where)
            continue
        if kind == SELF_COLLISION:
            if self_collision is not None:
                raise RobotError(f"{where}: is the second of type {SELF_COLLISION}; state one")
            self_collision = parse_self_collision(transmission, tree, where)
            continue
        if kind not in (SERIES_ELASTIC, RIGID):
            if kind.startswith("sea_ident/"):
                known = ", ".join((SERIES_ELASTIC, LINEAR_LIMIT, HALF_SPACE, SELF_COLLISION))
                raise RobotError(f"{where}: unknown type {kind!r}; use {known}")
            ignored.append(kind or "no type")
            continue
        if kind == RIGID and _says_nothing(transmission):
            continue
        check_spelling(transmission, where)
        joint = _one_joint(transmission, tree, where)
        if kind == RIGID and transmission.find("seriesElastic") is not None:
            raise RobotError(
                f"{where}: has a <seriesElastic>, and its type is {RIGID}; for a spring use {SERIES_ELASTIC}"
            )
        if joint in actuators:
            raise RobotError(f"{where}: joint {joint!r} already has the transmission of {actuators[joint].name!r}")
        transmission.set("type", kind)
        actuators[joint] = _actuator(transmission, joint, tree, where)
        limit = transmission.find("joint").find("limit")
        if limit is not None:
            limits[joint] = {key: number(limit, key, None, where) for key in EXTRA_LIMITS if key in limit.attrib}
            for key, value in limits[joint].items():
                if value <= 0.0:
                    raise RobotError(f"{where}: the {key} limit is {value}; it must be positive")
    return Annotation(
        actuators, limits, tuple(combinations), tuple(dict.fromkeys(ignored)), tuple(half_spaces), self_collision
    )
