"""A joint that is elsewhere in the link before it than the description says: a length that was set anew, or wrong."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pinocchio as pin

from sea_ident._typing import FloatArray
from sea_ident.effects.acting import Action, no_torque
from sea_ident.effects.base import Anchor, Column, Effect
from sea_ident.effects.state import Contribution, Side, State
from sea_ident.exceptions import EffectError
from sea_ident.motion import Motion
from sea_ident.robot import Robot

ALONG, ACROSS = "along", "across"
"""The directions: away from the joint before it, and at right angles to that and to its own axis."""

STEP = 0.05
"""Distance over which differences are taken; torque is a polynomial of second order in it [m]."""

LARGEST = 1.0
"""[m]"""

SAMPLES = 60
"""Random samples of a motion in which bodies are compared."""

PARALLEL = 1e-6
"""Sine or cosine below which directions are parallel or at right angles [-]."""


@dataclass(frozen=True)
class JointPlacement(Effect):
    """A joint, and all that it carries, moved in the frame of the link before it, at right angles to its own axis.

    Torque is T(0) + L p + B(p, p) of the way p. A change along p is that over the way: the derivative half way.

    Along its own axis nothing is told that moving the next joint would not do. What moves along the axis of a joint at
    the base does so with all that there is, and nothing feels it.

    Attributes:
        joint: joint that is elsewhere.
        inertial: (10 b,) standard inertial parameters of all links; empty for those of the description.
        shift: along and across, at which the columns hold, and nearly so close by [m].
    """

    inertial: Sequence[float] = ()
    shift: Sequence[float] = (0.0, 0.0)

    name: ClassVar[str] = "joint_placement"
    side: ClassVar[Side] = Side.LINK
    source: ClassVar[str] = "Hollerbach, Khalil, Gautier, Model identification, Springer Handbook of Robotics, 2008"
    depends_on: ClassVar[tuple[str, ...]] = ("q", "dq", "ddq")

    def __post_init__(self) -> None:
        object.__setattr__(self, "inertial", tuple(float(value) for value in self.inertial))
        object.__setattr__(self, "shift", tuple(float(value) for value in self.shift))

    @classmethod
    def instances(cls, robot: Robot) -> tuple[Effect, ...]:
        """At every joint that has a joint before it and is felt to be elsewhere."""
        places = [cls(joint=name) for i, name in enumerate(robot.joint_names) if robot.parents[i] >= 0]
        return tuple(place for place in places if place.directions(robot))

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """Ways along and across, those that are felt."""
        return tuple(
            Column(self.parameter_name(label), "m", self.name, self.joint, self.side)
            for label in self.directions(robot)
        )

    def directions(self, robot: Robot) -> dict[str, FloatArray]:
        """(3,) unit vectors in the frame of the link before it, by name, of those that are felt."""
        i = self._index(robot)
        model, place = robot.model, robot.model.getJointId(str(self.joint))
        own, before = _axis(robot, i), _axis(robot, robot.parents[i])
        inward = model.jointPlacements[place].rotation @ own
        line = np.array(model.jointPlacements[place].translation)
        along = line - (line @ inward) * inward
        if np.linalg.norm(along) <= PARALLEL * max(float(np.linalg.norm(line)), PARALLEL):
            along = np.eye(3)[int(np.argmin(np.abs(inward)))]
            along = along - (along @ inward) * inward
        along = along / np.linalg.norm(along)
        found = {ALONG: along, ACROSS: np.cross(inward, along)}
        if robot.parents[robot.parents[i]] >= 0 or abs(before @ inward) > PARALLEL:
            return found
        # of all ways at right angles to both axes there is one; the other one moves all that there is
        felt = np.cross(before, inward)
        label = max(found, key=lambda each: abs(float(found[each] @ felt)))
        return {label: felt * (1.0 if found[label] @ felt > 0.0 else -1.0)}

    def evaluate(self, state: State) -> Contribution:
        """Torque of the change over the way, half way."""
        inertial = np.array(self.inertial) if len(self.inertial) else state.robot.inertial_parameters
        columns = [
            (self._rows(state, 0.5, way) - self._rows(state, 0.5, -way)) @ inertial / (2.0 * STEP)
            for way in (STEP * each for each in self.directions(state.robot).values())
        ]
        return state.body_columns(np.stack(columns, axis=2))

    def followed(self, state: State, values: FloatArray) -> FloatArray:
        """What the bodies need more where the joint is."""
        whole = replace(self, shift=self._shift(state.robot, values))
        return whole._rows(state, 1.0, np.zeros(3)) - state.body_regressor

    def anchored(self, anchor: Anchor) -> "JointPlacement":
        """With the inertial parameters of the model, and the way that it has by now."""
        names = [column.name for column in self.columns(anchor.robot)]
        values = np.clip([anchor.value(name) for name in names], -LARGEST, LARGEST)
        return replace(self, inertial=anchor.inertial(), shift=self._shift(anchor.robot, values))

    def plausible(self, values: FloatArray, parameters: Mapping[str, float]) -> bool:
        """Whether it is no farther than any link is long."""
        return bool(np.all(np.abs(values) < LARGEST))

    @property
    def reservation(self) -> str | None:
        """What the ways are."""
        return (
            f"{self.title}: its <origin> in the description is off; {ALONG} counts away from the joint before it, "
            f"{ACROSS} at right angles to that and to its own axis. Correct it there and identify again: files that "
            "are exported do not have it"
        )

    def torque(self, robot: Robot, values: FloatArray) -> Action:
        """None: it acts in `modified`."""
        return no_torque

    def modified(self, robot: Robot, values: FloatArray) -> Robot:
        """The robot with the joint there, and bodies that need there what those need that it was found with.

        A model knows sums of what its bodies have, for the place that the joint has in its description; how they are
        shared out does not matter there and does elsewhere.
        """
        moved = self._moved(robot, self._way(robot, np.asarray(values, dtype=np.float64)))
        if not len(self.inertial):
            return moved
        q, dq, ddq = np.random.default_rng(1).normal(size=(3, SAMPLES, robot.n))
        rows = State(moved, Motion.rigid(np.arange(SAMPLES) / 100.0, q, dq, ddq)).body_regressor
        table, apart = rows.reshape(-1, rows.shape[2]), np.array(self.inertial) - robot.inertial_parameters
        less = np.linalg.lstsq(table, table @ apart, rcond=1e-9)[0]
        return moved.with_inertial_parameters(robot.inertial_parameters + less, robot.rotor_inertias())

    def _shift(self, robot: Robot, values: FloatArray) -> tuple[float, float]:
        """Along and across, of the values of those that are felt."""
        known = dict(zip(self.directions(robot), values, strict=True))
        return float(known.get(ALONG, 0.0)), float(known.get(ACROSS, 0.0))

    def _way(self, robot: Robot, values: FloatArray) -> FloatArray:
        """(3,) in the frame of the link before it [m]."""
        ways = (value * way for value, way in zip(values, self.directions(robot).values(), strict=True))
        return np.asarray(sum(ways, np.zeros(3)), dtype=np.float64)

    def _rows(self, state: State, share: float, beside: FloatArray) -> FloatArray:
        """(N, n, 10 b) link rows of the standard inertial parameters, a share of the way on and beside that (3,)."""
        directions = self.directions(state.robot)
        now = dict(zip((ALONG, ACROSS), self.shift, strict=True))
        way = sum((share * now[label] * each for label, each in directions.items()), np.asarray(beside))
        return State(self._moved(state.robot, way), state.motion).body_regressor

    def _moved(self, robot: Robot, way: FloatArray) -> Robot:
        self._index(robot)
        return robot.with_joint_moved(str(self.joint), way)

    def _index(self, robot: Robot) -> int:
        """Index of its joint.

        Raises:
            EffectError: if none was given, or it has no joint before it.
        """
        if self.joint is None:
            raise EffectError(f"the effect {self.name!r} is that of a joint; give joint=...")
        i = robot.index(self.joint)
        if robot.parents[i] < 0:
            raise EffectError(f"{self.name} at {self.joint!r}: it is the first joint; where that is no torque tells")
        return i


def _axis(robot: Robot, index: int) -> FloatArray:
    """(3,) unit axis of a joint in its own frame, about or along which it moves."""
    model, place = robot.model, robot.model.getJointId(robot.joint_names[index])
    data = model.createData()
    pin.computeJointJacobians(model, data, pin.neutral(model))
    jacobian = pin.getJointJacobian(model, data, place, pin.ReferenceFrame.LOCAL)[:, model.joints[place].idx_v]
    axis = jacobian[:3] if robot.joints[index].prismatic else jacobian[3:]
    return np.asarray(axis, dtype=np.float64)
