"""What verbs read."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sea_ident.robot import Robot


def read_robot(source: str, annotation: str | None, joints: str | None) -> "Robot":
    """The robot that the ROBOT argument and its two options mean."""
    from sea_ident.robot import load_robot

    names = None if joints is None else [name.strip() for name in joints.split(",") if name.strip()]
    return load_robot(source, annotation, names)
