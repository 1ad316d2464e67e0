"""Shapes of a URDF, as its elements state them."""

import io
from typing import Any

import yourdfpy

from sea_ident.exceptions import RobotError


def read_geometry(urdf: str, source: str) -> Any:
    """Links of a URDF with their visuals and collisions, and its materials; no mesh is loaded.

    Args:
        urdf: the XML.
        source: where it came from, for messages.

    Returns:
        The elements, as a `yourdfpy.Robot`.

    Raises:
        RobotError: an element cannot be read.
    """
    try:
        return yourdfpy.URDF.load(
            io.BytesIO(urdf.encode()),
            build_scene_graph=False,
            load_meshes=False,
            load_collision_meshes=False,
            filename_handler=lambda name: name,
        ).robot
    except Exception as error:  # yourdfpy raises whatever its parts do
        raise RobotError(f"{source}: its shapes cannot be read: {error}") from None
