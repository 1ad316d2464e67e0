"""Inertia of the rotors about their spin axes."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects.acting import Action, no_torque
from sea_ident.effects.base import Column, Effect
from sea_ident.effects.state import Contribution, Side, State
from sea_ident.robot import Robot


@dataclass(frozen=True)
class RotorInertia(Effect):
    """One parameter for every group of identical motors: it enters B, S, C1 and C2 at once (paper, eqs. 1-2)."""

    name: ClassVar[str] = "rotor_inertia"
    side: ClassVar[Side] = Side.BOTH
    source: ClassVar[str] = "Vantilt et al., ICRA 2015, eqs. 1-5"

    @classmethod
    def instances(cls, robot: Robot) -> tuple[Effect, ...]:
        """Once for the whole robot, if it has motors."""
        return (cls(),) if robot.rotors else ()

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """`<joint or group>.rotor_inertia`."""
        joints: dict[str, list[str]] = {}
        for rotor in robot.rotors:
            joints.setdefault(f"{rotor.rotor_group}.rotor_inertia", []).append(rotor.joint)
        return tuple(
            Column(name, "kg m2", self.name, of[0] if len(of) == 1 else None, self.side, nonnegative=True)
            for name, of in joints.items()
        )

    def evaluate(self, state: State) -> Contribution:
        """Rows of the rotors, summed over each group."""
        rows, membership = state.rotor_rows, self._membership(state.robot)
        return Contribution(rows.link @ membership, rows.motor @ membership)

    def prior(self, robot: Robot) -> FloatArray:
        """Data-sheet values."""
        groups = robot.rotor_groups
        values = np.full(len(groups), np.nan)
        for rotor in robot.rotors:
            if rotor.rotor_inertia is not None:
                values[groups.index(f"{rotor.rotor_group}.rotor_inertia")] = rotor.rotor_inertia
        return values

    def torque(self, robot: Robot, values: FloatArray) -> Action:
        """Nothing to add: the simulator integrates the rotors themselves."""
        return no_torque

    @staticmethod
    def _membership(robot: Robot) -> FloatArray:
        """(rotors, groups) 1 where a rotor belongs to a group."""
        groups = robot.rotor_groups
        matrix = np.zeros((len(robot.rotors), len(groups)))
        for row, rotor in enumerate(robot.rotors):
            matrix[row, groups.index(f"{rotor.rotor_group}.rotor_inertia")] = 1.0
        return matrix
