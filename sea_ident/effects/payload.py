"""A body that is carried and not in the description."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects.acting import Action, no_torque
from sea_ident.effects.base import Column, Effect
from sea_ident.effects.state import Contribution, Side, State
from sea_ident.exceptions import EffectError
from sea_ident.robot import INERTIAL_NAMES, INERTIAL_UNITS, Robot


@dataclass(frozen=True)
class Payload(Effect):
    """Ten inertial parameters on the link that `joint` moves, on top of its own.

    A fit of all parameters absorbs it altogether: it shows only against an earlier model.

    Attributes:
        joint: joint whose link carries it.
    """

    name: ClassVar[str] = "payload"
    side: ClassVar[Side] = Side.BOTH
    source: ClassVar[str] = "Khalil, Gautier, Lemoine, Identification of the payload inertial parameters, ICRA 2007"
    depends_on: ClassVar[tuple[str, ...]] = ("q", "dq", "ddq")

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """Mass, first moments and inertia about the joint frame."""
        self._index(robot)
        return tuple(
            Column(
                self.parameter_name(name), unit, self.name, self.joint, self.side,
                nonnegative=name in ("m", "Ixx", "Iyy", "Izz"),
            )
            for name, unit in zip(INERTIAL_NAMES, INERTIAL_UNITS, strict=True)
        )  # fmt: skip

    def evaluate(self, state: State) -> Contribution:
        """Rows of the link that carries it."""
        take = 10 * self._index(state.robot)
        return state.body_columns(state.body_regressor[:, :, take : take + 10])

    def torque(self, robot: Robot, values: FloatArray) -> Action:
        """None: it acts in `modified`."""
        return no_torque

    def modified(self, robot: Robot, values: FloatArray) -> Robot:
        """The robot that carries it."""
        inertial = robot.inertial_parameters.copy()
        start = 10 * self._index(robot)
        inertial[start : start + 10] += np.asarray(values, dtype=np.float64)
        return robot.with_inertial_parameters(inertial, robot.rotor_inertias())

    def _index(self, robot: Robot) -> int:
        """Index of the link in `robot.bodies`.

        Raises:
            EffectError: if no joint was given.
        """
        if self.joint is None:
            raise EffectError(f"the effect {self.name!r} is carried by a link; give the joint that moves it, joint=...")
        robot.index(self.joint)
        names = [robot.extended_model.names[int(index)] for index in robot.body_indices]
        return names.index(self.joint)
