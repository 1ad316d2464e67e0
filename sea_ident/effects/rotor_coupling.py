"""Spin of the rotors from the motion of the links that carry them, when it is not as the drawing says."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pinocchio as pin

from sea_ident._typing import FloatArray
from sea_ident.effects.acting import Action, no_torque
from sea_ident.effects.base import Anchor, Column, Effect
from sea_ident.effects.state import Contribution, Side, State
from sea_ident.exceptions import EffectError
from sea_ident.robot import Robot

ROUNDING = 1e-9
"""Share of the torque that turns a rotor by itself below which its coupling comes from the digits of a description."""

MOST = 10.0
"""Times the inertia of the rotor: where its axis lies, its carrier turns it once at most, and one that is drawn to lie
across shows a part of that. What turns it many times is a transmission [-]."""


@dataclass(frozen=True)
class RotorCoupling(Effect):
    """The terms S, C1 and C2 of one rotor without its own inertia B: a gear that turns the other way doubles them.

    Attributes:
        joint: joint that the rotor drives.
        inertia: of the rotor in the model, None where that is not known [kg m2].
    """

    inertia: float | None = None

    name: ClassVar[str] = "rotor_coupling"
    side: ClassVar[Side] = Side.BOTH
    source: ClassVar[str] = "De Luca, Book, Robots with flexible elements, Springer Handbook of Robotics, 2008"

    @classmethod
    def instances(cls, robot: Robot) -> tuple[Effect, ...]:
        """At every rotor that is carried by a link that moves."""
        found = []
        for k, rotor in enumerate(robot.rotors):
            if robot.extended_model.parents[int(robot.rotor_indices[k])] != 0:
                found.append(cls(joint=rotor.joint))
        return tuple(found)

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """One column."""
        self._rotor(robot)
        return (Column(self.parameter_name(), "kg m2", self.name, self.joint, self.side),)

    def evaluate(self, state: State) -> Contribution:
        """Rows of the rotor as a body, without the part that its own acceleration gives."""
        robot = state.robot
        k, i = self._rotor(robot), robot.index(str(self.joint))
        rows = state.rotor_rows
        motor, link = rows.motor[:, :, k : k + 1].copy(), rows.link[:, :, k : k + 1]
        spin = robot.motor_map[robot.extended_model.joints[int(robot.rotor_indices[k])].idx_v, i]
        own = spin**2 * state.motion.ddtheta[:, i]
        motor[:, i, 0] -= own
        # no joint before it turns a link about the axis of this rotor: all that is left is rounding
        if max(np.abs(link).max(initial=0.0), np.abs(motor).max(initial=0.0)) < ROUNDING * np.abs(own).max(initial=0.0):
            return Contribution(np.zeros_like(link), np.zeros_like(motor))
        return Contribution(link, motor)

    def anchored(self, anchor: Anchor) -> "RotorCoupling":
        """With the inertia of the rotor in the model."""
        rotor = anchor.robot.rotors[self._rotor(anchor.robot)]
        return replace(self, inertia=anchor.value(f"{rotor.rotor_group}.rotor_inertia"))

    def plausible(self, values: FloatArray, parameters: Mapping[str, float]) -> bool:
        """Whether its carrier can turn the rotor that far."""
        return not self.inertia or bool(abs(values[0]) < MOST * self.inertia)

    def torque(self, robot: Robot, values: FloatArray) -> Action:
        """None: it acts in `modified`."""
        return no_torque

    def modified(self, robot: Robot, values: FloatArray) -> Robot:
        """The robot with a rotor that has the same inertia B and another coupling: spin / s, inertia x s^2.

        Raises:
            EffectError: if the rotor has no inertia, or the coupling would vanish altogether.
        """
        k = self._rotor(robot)
        index = int(robot.rotor_indices[k])
        inertia = float(robot.rotor_inertias()[k])
        if not inertia > 0.0:
            raise EffectError(f"the rotor of {self.joint!r} has no inertia; its coupling cannot be changed")
        ratio = 1.0 + float(values[0]) / inertia
        if abs(ratio) < 1e-3:
            raise EffectError(
                f"rotor_coupling of {values[0]:g} kg m2 at {self.joint!r} takes the whole coupling away; "
                "take a slightly smaller value"
            )
        column = robot.extended_model.joints[index].idx_v
        motor_map, link_map, offset = robot.motor_map.copy(), robot.link_map.copy(), robot.offset.copy()
        for part in (motor_map, link_map):
            part[column] /= ratio
        offset[column] /= ratio
        extended = pin.Model(robot.extended_model)
        extended.inertias[index] = pin.Inertia(0.0, np.zeros(3), np.diag([0.0, 0.0, inertia * ratio**2]))
        return replace(robot, motor_map=motor_map, link_map=link_map, offset=offset, extended_model=extended)

    def _rotor(self, robot: Robot) -> int:
        if self.joint is None:
            raise EffectError(f"the effect {self.name!r} acts at a joint; give joint=...")
        robot.index(self.joint)
        for k, rotor in enumerate(robot.rotors):
            if rotor.joint == self.joint:
                return k
        raise EffectError(f"joint {self.joint!r} of {robot.name} has no motor, so no rotor that couples")
