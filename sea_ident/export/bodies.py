"""How the links that are fixed to each other share the body that was identified.

Identification sees one body for all links that move together. Written back, the link at the joint takes what is left
of it after the others, which stay as they are; where that would leave no physical body, the others are scaled down.
"""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
import scipy.linalg

from sea_ident._typing import FloatArray
from sea_ident.estimation.pseudo_inertia import inertial_parameters, pseudo_inertia
from sea_ident.exceptions import ExportError
from sea_ident.robot import Robot
from sea_ident.robot.urdf import Inertial, UrdfTree, rotation_from_rpy

_NOTHING = 1e-12
_ROUNDING = 1e-9


def parameters_of(link: Inertial, placement: pin.SE3) -> FloatArray:
    """(10,) inertial parameters of a link about the frame in which `placement` is given."""
    rotation, c = rotation_from_rpy(link.rpy), link.centre
    about = rotation @ link.tensor @ rotation.T + link.mass * (c @ c * np.eye(3) - np.outer(c, c))
    own = np.concatenate([[link.mass], link.mass * c, about[[0, 0, 1, 0, 1, 2], [0, 1, 1, 2, 2, 2]]])
    frame = placement.homogeneous
    return inertial_parameters(frame @ pseudo_inertia(own) @ frame.T)


@dataclass(frozen=True, eq=False)
class LinkShare:
    """What a link gets of the body that it is part of.

    Attributes:
        link: name of the link.
        scale: factor on its own mass and inertia; None where `inertia` replaces them.
        inertia: its mass properties in its own frame; None where `scale` is given, or where it gets nothing.
    """

    link: str
    scale: float | None
    inertia: pin.Inertia | None


def share_bodies(robot: Robot, tree: UrdfTree) -> tuple[list[LinkShare], list[str]]:
    """Share every identified body among the links that make it up.

    Args:
        robot: the robot, its bodies with the identified values.
        tree: its URDF.

    Returns:
        The shares of all links that change, and notes for the user.

    Raises:
        ExportError: if a body is not physically consistent.
    """
    shares: list[LinkShare] = []
    notes: list[str] = []
    for k, name in enumerate(robot.bodies, start=1):
        body = robot.model.inertias[k].toDynamicParameters()
        check_body(name, body)
        fixed = {
            frame.name: parameters_of(inertial, frame.placement)
            for frame in robot.model.frames
            if frame.type == pin.FrameType.BODY and frame.parentJoint == k and frame.name != name
            if (inertial := tree.links[frame.name]) is not None
        }
        carried = sum(fixed.values(), np.zeros(10))
        scale = _largest_share(body, carried)
        rest = body - scale * carried
        nothing = abs(rest[0]) < _NOTHING * body[0] and np.abs(rest[4:]).max() < _NOTHING * np.abs(body[4:]).max()
        shares.append(LinkShare(name, None, None if nothing else pin.Inertia.FromDynamicParameters(rest)))
        if scale < 1.0:
            shares += [LinkShare(link, scale, None) for link in fixed]
            notes.append(
                f"the links fixed to {name!r} ({', '.join(fixed)}) weigh more than the identified body allows; their "
                f"mass and inertia were multiplied by {scale:.4g}"
            )
    return shares, notes


def check_body(name: str, body: FloatArray) -> None:
    """Refuse a body that cannot exist.

    Raises:
        ExportError: if its pseudo-inertia has a negative eigenvalue.
    """
    matrix = pseudo_inertia(body)
    # eigenvalues of a body in units in which mass and lengths are of size one
    size = np.sqrt(max(np.trace(matrix[:3, :3]) / max(body[0], 1e-300), 1e-300))
    units = np.diag([1 / size, 1 / size, 1 / size, 1.0])
    smallest = np.linalg.eigvalsh(units @ matrix @ units)[0] if body[0] > 0.0 else -np.inf
    if smallest < -_ROUNDING * body[0]:
        raise ExportError(
            f"link {name!r} has inertial parameters that no body has (mass {body[0]:.4g} kg); export the physically "
            f"consistent parameters of the model"
        )


def _largest_share(body: FloatArray, carried: FloatArray) -> float:
    """The largest factor in (0, 1] on what is carried that leaves a physical rest."""
    if not np.any(carried):
        return 1.0
    whole, part = pseudo_inertia(body), pseudo_inertia(carried)
    rest = np.linalg.eigvalsh(whole - part)
    if rest[0] >= -_NOTHING * max(float(np.abs(rest).max()), float(np.trace(whole))):
        return 1.0
    ridge = 1e-12 * np.diag([np.trace(whole[:3, :3])] * 3 + [whole[3, 3]])
    ratio = float(scipy.linalg.eigh(part, whole + ridge, eigvals_only=True)[-1])
    return min(1.0, 0.99 / ratio)
