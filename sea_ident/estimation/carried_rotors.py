"""What the rotors that a link carries take of its pseudo-inertia.

A rotor of the model has an inertia about its axis alone; its mass and its transverse inertia belong to the link that
carries it. A thin disc of spin inertia J has J / 2 about every transverse axis, which is a second moment of J / 2 along
the axis of the rotor: so much the link must have about its centre of mass.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from sea_ident._typing import FloatArray
from sea_ident.robot import Robot


@dataclass(frozen=True, eq=False)
class CarriedRotors:
    """The rotors of one link.

    Attributes:
        coefficients: (p, 4, 4) pseudo-inertia that they take per unit of each parameter of the model.
        constant: (4, 4) what those take whose inertia is no parameter.
    """

    coefficients: FloatArray
    constant: FloatArray

    @property
    def any(self) -> bool:
        """Whether there are any."""
        return bool(np.any(self.coefficients) or np.any(self.constant))


def carried_rotors(
    robot: Robot, names: Sequence[str], bodies: Sequence[str], known: FloatArray, references: Sequence[FloatArray]
) -> tuple[CarriedRotors, ...]:
    """What the rotors take of every body; nothing of one that has no room for them in the description either.

    Args:
        robot: the robot.
        names: (p,) parameters of the model.
        bodies: names of the bodies.
        known: (p,) parameters as far as they are known.
        references: (4, 4) pseudo-inertia of every body in the description.
    """
    model, count = robot.model, len(names)
    coefficients = {body: np.zeros((count, 4, 4)) for body in bodies}
    constants = {body: np.zeros((4, 4)) for body in bodies}
    for rotor in robot.rotors:
        frame = model.frames[model.getFrameId(rotor.carrier, pin.FrameType.BODY)]
        body = robot.bodies[frame.parentJoint - 1] if frame.parentJoint else None
        if body not in coefficients:
            continue
        axis = frame.placement.rotation @ rotor.rotor_axis
        taken = np.zeros((4, 4))
        taken[:3, :3] = 0.5 * np.outer(axis, axis)
        name = f"{rotor.rotor_group}.rotor_inertia"
        if name in names:
            coefficients[body][names.index(name)] += taken
        else:
            constants[body] += (rotor.rotor_inertia or 0.0) * taken
    found = []
    for body, reference in zip(bodies, references, strict=True):
        taken = np.einsum("p,pij->ij", np.maximum(known, 0.0), coefficients[body]) + constants[body]
        half = np.linalg.inv(np.linalg.cholesky(reference))
        room = bool(np.linalg.eigvalsh(half @ (reference - taken) @ half.T)[0] > 0.0)
        share = 1.0 if room else 0.0
        found.append(CarriedRotors(share * coefficients[body], share * constants[body]))
    return tuple(found)
