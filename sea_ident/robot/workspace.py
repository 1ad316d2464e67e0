"""Limits on where the robot may be in space, and the transmissions that state them in an annotation."""

from dataclasses import dataclass

import numpy as np
from lxml import etree

from sea_ident._typing import FloatArray
from sea_ident.exceptions import RobotError
from sea_ident.robot.urdf import UrdfTree
from sea_ident.robot.xml import number, vector

HALF_SPACE = "sea_ident/HalfSpace"
SELF_COLLISION = "sea_ident/SelfCollision"
DISTANCE = 0.01
"""Safety distance where none is stated [m]."""


@dataclass(frozen=True, eq=False)
class HalfSpace:
    """A point of a link stays on one side of a plane: ``normal . p(q) <= offset`` in the frame of the robot's root.

    Attributes:
        name: of the plane.
        link: link that carries the point.
        normal: (3,) direction that points out of what is allowed, of any length.
        offset: of the plane along the normal, as long as the normal [m].
        point: (3,) in the frame of the link [m].
    """

    name: str
    link: str
    normal: FloatArray
    offset: float
    point: FloatArray


@dataclass(frozen=True)
class SelfCollision:
    """Links keep a distance from each other.

    Attributes:
        distance: least distance between links that are not neighbours [m].
        ignored: pairs of links that may come nearer.
    """

    distance: float = DISTANCE
    ignored: tuple[tuple[str, str], ...] = ()


def parse_half_spaces(transmission: etree._Element, tree: UrdfTree, where: str) -> list[HalfSpace]:
    """One half-space for every point of a `sea_ident/HalfSpace`.

    ``<link name="tool" xyz="0 0 0.1"/>``, once or more, and ``<plane normal="0 0 -1" offset="-0.05"/>``.

    Raises:
        RobotError: no link or no plane, an unknown link, a normal of zero.
    """
    plane, links = transmission.find("plane"), transmission.findall("link")
    if plane is None or not links:
        raise RobotError(f'{where}: needs <link name="..."/> elements and a <plane normal="x y z" offset="..."/>')
    if "normal" not in plane.attrib:
        raise RobotError(f"{where}: <plane> has no normal; give the direction that points out of what is allowed")
    normal = vector(plane, "normal", "", where)
    if not np.any(normal):
        raise RobotError(f"{where}: the normal of its <plane> is zero; give the direction out of what is allowed")
    offset = number(plane, "offset", None, where)
    return [
        HalfSpace(
            transmission.get("name", "plane"),
            _known_link(element.get("name", ""), tree, where),
            normal,
            offset,
            vector(element, "xyz", "0 0 0", where),
        )
        for element in links
    ]


def parse_self_collision(transmission: etree._Element, tree: UrdfTree, where: str) -> SelfCollision:
    """A `sea_ident/SelfCollision`: ``<distance>0.02</distance>``, ``<ignore link1="..." link2="..."/>``.

    Raises:
        RobotError: an unknown link, or a distance that is not a number of at least 0.
    """
    text = transmission.findtext("distance")
    try:
        distance = DISTANCE if text is None else float(text)
    except ValueError:
        raise RobotError(f"{where}: <distance> holds {text!r}, not a number") from None
    if not 0.0 <= distance < np.inf:
        raise RobotError(f"{where}: <distance> is {distance} m; it must be finite and not negative")
    ignored = tuple(
        (_known_link(pair.get("link1", ""), tree, where), _known_link(pair.get("link2", ""), tree, where))
        for pair in transmission.findall("ignore")
    )
    return SelfCollision(distance, ignored)


def _known_link(name: str, tree: UrdfTree, where: str) -> str:
    if name not in tree.links:
        raise RobotError(
            f"{where}: names the link {name!r}, which is not in {tree.file}; its links: {', '.join(tree.links)}"
        )
    return name
