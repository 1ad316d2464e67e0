"""Where the meshes of a URDF lie."""

from collections.abc import Callable
from pathlib import Path

from sea_ident.exceptions import RobotError
from sea_ident.robot.sources import find_urdf


def mesh_locator(source: str) -> Callable[[str], Path | None]:
    """How mesh names of a URDF become files: relative to it, or to a package among the folders above it.

    Args:
        source: what `load_robot` was given.

    Returns:
        Function from the name in the URDF to the file, None where there is none.
    """
    try:
        folder = find_urdf(source).resolve().parent
    except RobotError:
        return lambda name: None

    def locate(name: str) -> Path | None:
        inner = name.removeprefix("package://").removeprefix("file://").removeprefix("model://")
        for parent in (folder, *folder.parents):
            for candidate in (parent / inner, parent / inner.partition("/")[2]):
                if candidate.is_file():
                    return candidate
        return None

    return locate
