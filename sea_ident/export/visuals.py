"""Primitive shapes of a URDF, for formats that can draw them."""

from dataclasses import dataclass

import numpy as np
from lxml import etree

from sea_ident._typing import FloatArray
from sea_ident.robot.urdf import rotation_from_rpy
from sea_ident.robot.xml import vector


@dataclass(frozen=True, eq=False)
class Visual:
    """A shape on a link.

    Attributes:
        shape: box, cylinder or sphere.
        size: half lengths; radius and half length; radius [m].
        position: (3,) in the link frame [m].
        rotation: (3, 3) in the link frame [-].
        colour: (4,) red, green, blue, opacity; None where not stated.
    """

    shape: str
    size: FloatArray
    position: FloatArray
    rotation: FloatArray
    colour: FloatArray | None


def read_visuals(root: etree._Element) -> dict[str, tuple[Visual, ...]]:
    """The primitive shapes of all links; meshes and what cannot be read are left out, as they are only drawn.

    Args:
        root: the parsed URDF.

    Returns:
        Shapes by name of the link.
    """
    colours = {m.get("name"): colour for m in root.findall("material") if (colour := _colour(m)) is not None}
    found: dict[str, tuple[Visual, ...]] = {}
    for link in root.findall("link"):
        shapes = []
        for visual in link.findall("visual"):
            shape = _shape(visual.find("geometry"))
            if shape is None:
                continue
            origin, material = visual.find("origin"), visual.find("material")
            colour = None
            if material is not None:
                own = _colour(material)
                colour = colours.get(material.get("name")) if own is None else own
            position = vector(origin, "xyz", "0 0 0", "visual")
            rotation = rotation_from_rpy(vector(origin, "rpy", "0 0 0", "visual"))
            shapes.append(Visual(*shape, position, rotation, colour))
        found[str(link.get("name"))] = tuple(shapes)
    return found


def _colour(material: etree._Element) -> FloatArray | None:
    element = material.find("color")
    values = _floats(element, "rgba")
    return values if values is not None and values.shape == (4,) else None


def _shape(geometry: etree._Element | None) -> tuple[str, FloatArray] | None:
    if geometry is None:
        return None
    box, cylinder, sphere = (geometry.find(tag) for tag in ("box", "cylinder", "sphere"))
    if (size := _floats(box, "size")) is not None and size.shape == (3,):
        shape, lengths = "box", size / 2.0
    elif (radius := _floats(cylinder, "radius")) is not None and (length := _floats(cylinder, "length")) is not None:
        shape, lengths = "cylinder", np.array([radius[0], length[0] / 2.0])
    elif (radius := _floats(sphere, "radius")) is not None:
        shape, lengths = "sphere", radius[:1]
    else:
        return None
    return (shape, lengths) if bool(np.all(lengths > 0.0)) else None


def _floats(element: etree._Element | None, attribute: str) -> FloatArray | None:
    if element is None:
        return None
    try:
        values = np.array([float(part) for part in element.get(attribute, "").split()])
    except ValueError:
        return None
    return values if len(values) and bool(np.all(np.isfinite(values))) else None
