"""What a gear takes for itself of the load that it carries."""

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Self

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects.base import Anchor, Shape
from sea_ident.effects.load import MotorLoadEffect
from sea_ident.effects.state import State
from sea_ident.motion import Motion
from sea_ident.robot import Robot

LEAST_OF_LINKS = 0.02
"""Share of the inertia of rotor and links together that the links have at least [-]."""

ALL_INERTIA = 0.999
"""Cosine between a load and what the rotor needs from which on a loss shows no more than their product [-]."""

TOLD = 1e-3
"""Share of what a rotor needs that no links need, from which on a motion tells it from them [-]."""

SAMPLES = 40
"""Random states in which it is seen whether links can stand in for a rotor, ..."""

KEPT = 32
"""... and robots of which that is kept."""


@dataclass(frozen=True)
class GearLoss(MotorLoadEffect):
    """A loss by the load of a gear, which the links are and the inertia of the rotor is not.

    At a rigid joint often only the sum of both inertias shows in the torque. Where the description does not give that
    of the rotor either, it is a parameter of the loss, which alone tells it; where the load is all inertia not even
    that does, and all of it counts as load.

    Attributes:
        most: what the reflected inertia of the rotor may be where it is free [kg m2]; 0 where all counts as load, None
            where the inertia is that of the model.
    """

    most: float | None = None

    @property
    def ranges(self) -> tuple[Shape, ...]:
        """The reflected inertia of the rotor where it is free."""
        if not self.most:
            return self.shapes
        return (*self.shapes, Shape("reflected_inertia", "kg m2", 0.0, self.most, logarithmic=False, points=5))

    def variants(self, state: State) -> tuple[Self, ...]:
        """With several inertias of the rotor where it is free."""
        own = self.on(state)
        inertias = [float(value) for shape in own.ranges for value in shape.grid()]
        return tuple(replace(own, reflected_inertia=value) for value in inertias) if inertias else (own,)

    def on(self, state: State) -> Self:
        """With the inertia of the rotor free, where neither torque nor description tells it, and the loss can."""
        robot = state.robot
        whole = None if self.most else self._whole(robot)
        if whole is None:
            return self
        most = (1.0 - LEAST_OF_LINKS) * float(np.min(state.inertia_at(robot.index(self.at), whole)))
        own = replace(self, inertial=tuple(whole), reflected_inertia=most, most=most)
        load, rotor = state.body_torque(whole)[:, robot.index(self.at)], own.rotor_torque(state)
        along = abs(float(load @ rotor)) / max(float(np.linalg.norm(load) * np.linalg.norm(rotor)), 1e-300)
        if most > 0.0 and along < ALL_INERTIA:
            return own
        return replace(self, inertial=tuple(whole), reflected_inertia=0.0, most=0.0)

    def anchored(self, anchor: Anchor) -> Self:
        """With the load that the model gives to its joint; an inertia of the rotor that is free stays as it is."""
        changed = super().anchored(anchor)
        whole = changed._whole(anchor.robot)
        if whole is None:
            return changed
        most = self.most or 0.0
        reflected = self.reflected_inertia if most else 0.0
        return replace(changed, inertial=tuple(whole), reflected_inertia=reflected, most=most)

    def load(self, state: State) -> FloatArray:
        """(N,) torque from the motor side onto the link [N m]."""
        load = super().load(state)
        return load - self.rotor_torque(state) if self.most else load

    def modified(self, robot: Robot, values: FloatArray) -> Robot:
        """The robot with as much of the inertia at the rotor as the loss tells: all else that moves stays the same."""
        links = None if self.most is None else links_for_rotor(robot, self.at)
        if links is None:
            return robot
        own, rotors = np.array([rotor.joint == self.at for rotor in robot.rotors]), robot.rotor_inertias()
        inertia = (self.reflected_inertia or 0.0) / robot.gear_ratios[robot.index(self.at)] ** 2
        links = (inertia - rotors[own][0]) * links
        return robot.with_inertial_parameters(robot.inertial_parameters - links, np.where(own, inertia, rotors))

    @property
    def reservation(self) -> str | None:
        """That nothing tells the inertia of the rotor."""
        if self.most != 0.0:
            return None
        return (
            f"{self.title} is told as a share of a load that holds the inertia of the rotor too, for nothing in these "
            "data tells that from the links: the true share is larger. Give the inertia of the rotor in the annotation"
        )

    def _whole(self, robot: Robot) -> FloatArray | None:
        """(10 b,) links with the inertia of the rotor in them, None where that is known or told from them."""
        links = links_for_rotor(robot, self.at) if _unknown(robot, self.at) else None
        if links is None:
            return None
        inertial = np.array(self.inertial) if len(self.inertial) else robot.inertial_parameters
        ratio = robot.gear_ratios[robot.index(self.at)]
        return np.asarray(inertial + (self.reflected_inertia or 0.0) / ratio**2 * links, dtype=np.float64)


def _unknown(robot: Robot, joint: str) -> bool:
    """Whether a joint is rigid and has a motor of which the description does not give the inertia of the rotor."""
    known = robot.joints[robot.index(joint)]
    return not known.elastic and known.actuator is not None and known.actuator.rotor_inertia is None


@lru_cache(maxsize=KEPT)
def links_for_rotor(robot: Robot, joint: str) -> FloatArray | None:
    """Links that need in every motion what the rotor of a joint needs, of unit inertia at the shaft.

    Args:
        robot: the robot.
        joint: the joint.

    Returns:
        (10 b,) standard inertial parameters, of the link of the joint alone where that can do it; None where no links
        can, so that a motion tells the rotor from them, and where there is no motor.
    """
    own = [rotor.joint == joint for rotor in robot.rotors]
    if not any(own):
        return None
    rng = np.random.default_rng(0)
    q, dq, ddq, theta, dtheta, ddtheta = rng.normal(size=(6, SAMPLES, robot.n))
    for i in np.flatnonzero(~np.array(robot.elastic)):
        theta[:, i], dtheta[:, i], ddtheta[:, i] = q[:, i], dq[:, i], ddq[:, i]
    state = State(robot, Motion(np.arange(SAMPLES) / 100.0, q, dq, ddq, theta, dtheta, ddtheta))
    rotor = (state.rotor_rows.link + state.rotor_rows.motor)[:, :, own.index(True)].ravel()
    columns = state.body_regressor.reshape(len(rotor), -1)
    sizes = np.linalg.norm(columns, axis=0)
    usable = sizes > TOLD * float(np.max(sizes))
    body = robot.bodies.index(robot.joints[robot.index(joint)].child)
    of_its_link = usable & (np.arange(len(usable)) // 10 == body)
    for chosen in (of_its_link, usable):
        values = np.zeros(len(usable))
        scaled = columns[:, chosen] / sizes[chosen]
        values[chosen] = np.linalg.lstsq(scaled, rotor, rcond=TOLD)[0] / sizes[chosen]
        if np.linalg.norm(columns @ values - rotor) < TOLD * np.linalg.norm(rotor):
            return values
    return None
