"""A base that does not stand level."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pinocchio as pin

from sea_ident._typing import FloatArray
from sea_ident.effects.acting import Action, no_torque
from sea_ident.effects.base import Anchor, Column, Effect, Shape
from sea_ident.effects.state import Contribution, Side, State
from sea_ident.effects.unfelt_moments import level_axes, sideways, sideways_torque, unfelt_moments
from sea_ident.motion import Motion
from sea_ident.robot import Robot

LARGEST = 1.0
"""Angle beyond which the columns are not followed: no base stands so, and near a right angle they vanish [rad]."""

HARDLY_SEEN = 1e-3
"""Share of the torque by a rotation about one axis below which that about the other is none, as long as its angle is 0:
a robot that moves in an upright plane does not feel it turn about an axis in the plane, but for the digits that the
plane was given with [-]."""

LEAN = 0.1
"""Angle at which a search looks for a rotation that is not felt as long as it is small [rad]."""

FREE = ("moment_first", "moment_second")
"""The first moments about one upright axis."""

APART = 0.01
"""Least singular value of normalised columns from which on these are told from the tilt [-]."""

TIMES_AS_LARGE = 2.0
"""How much of what all links need under a tilt these may be [-]."""

SAMPLES = 40
"""Random postures in which a robot is given them."""


@dataclass(frozen=True)
class BaseTilt(Effect):
    """Gravity in another direction than the description says.

    Gravity turned by an angle t is g - sin t / t (t x g) + (1 - cos t) / t^2 (t x (t x g)): linear in the angle, but
    for what is known of it by `angles`.

    What turns about an upright axis has a first moment that a level robot does not feel, and a tilted one does. Where
    other joints tell the tilt, it is a parameter beside the angles; where none do, only the product of both is seen,
    and it is what the description says.

    A robot that moves in an upright plane hardly feels that it leans to its side: gravity in the plane becomes less by
    half the square of the angle. Its sign is not told.

    Attributes:
        joint: None, it acts on the whole robot.
        inertial: (10 b,) standard inertial parameters of all links; empty for those of the description.
        angles: rotation about the two level axes that the columns hold at, and nearly so close by [rad].
        moment_first: first moment not felt level, beyond what `inertial` has of it, across its axis [kg m].
        moment_second: the same at right angles to that [kg m].
        most: what these may be where they are free [kg m]; 0 where they are not, None where all moments are felt.
        squared: about which of the axes nothing is felt but the square of the angle.
    """

    inertial: Sequence[float] = ()
    angles: Sequence[float] = (0.0, 0.0)
    moment_first: float = 0.0
    moment_second: float = 0.0
    most: float | None = None
    squared: Sequence[bool] = (False, False)

    name: ClassVar[str] = "base_tilt"
    side: ClassVar[Side] = Side.LINK
    source: ClassVar[str] = "Khalil, Dombre, Modeling, Identification and Control of Robots, 2002, section 9.3"
    depends_on: ClassVar[tuple[str, ...]] = ("q",)

    def __post_init__(self) -> None:
        object.__setattr__(self, "inertial", tuple(float(value) for value in self.inertial))
        object.__setattr__(self, "angles", tuple(float(value) for value in self.angles))
        object.__setattr__(self, "squared", tuple(bool(value) for value in self.squared))

    @classmethod
    def instances(cls, robot: Robot) -> tuple[Effect, ...]:
        """Once for the whole robot, if there is gravity."""
        return (cls(),) if np.any(robot.model.gravity.linear) else ()

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """Rotation of the base about two level axes."""
        return tuple(
            Column(self.parameter_name(label), "rad", self.name, None, self.side) for label in ("first", "second")
        )

    @property
    def ranges(self) -> tuple[Shape, ...]:
        """The first moments that are not felt level, where they are free."""
        most = self.most or 0.0
        return tuple(Shape(name, "kg m", -most, most, logarithmic=False, points=1) for name in FREE if most)

    @property
    def reservation(self) -> str | None:
        """That the first moments are those of the description, or that a sign is not told."""
        if self.most != 0.0:
            if not any(square and angle for square, angle in zip(self.squared, self.angles, strict=True)):
                return None
            return (
                f"{self.title} takes the robot out of the upright plane in which it moves: that makes gravity there "
                "less by half the square of the angle, the same to either side. Gravity that is described too large "
                "does that too"
            )
        return (
            f"{self.title} is told as far as the description is right about the centres of mass of what turns about "
            "upright axes: a level robot does not feel them, and in these data a tilted one shows their product with "
            "the angle alone, which is off by the same share as they are"
        )

    def variants(self, state: State) -> tuple["BaseTilt", ...]:
        """With first moments that are not felt level, free where the motion tells them from the tilt.

        And at an angle about an axis of which only its square is felt.
        """
        own = self.on(state)
        sizes = np.linalg.norm(replace(own, angles=(0.0, 0.0))._felt(state), axis=(0, 1))
        squared = tuple(bool(size < HARDLY_SEEN * np.max(sizes)) for size in sizes)
        if any(self.angles) or not any(squared):
            return (own,)
        leaning = (replace(own, angles=tuple(LEAN * np.eye(2)[k]), squared=squared) for k in np.flatnonzero(squared))
        return (own, *leaning)

    def on(self, state: State) -> "BaseTilt":
        """With first moments that are not felt level, free where the motion tells them from the tilt."""
        unfelt = () if self.most else unfelt_moments(state.robot)
        if not unfelt:
            return self
        ways, links = sideways(state.robot), self._links(state.robot)
        tilted = [state.gravity_torque(way, links).ravel() for way in ways]
        apart = all(
            _apart(np.stack([*tilted, *(state.gravity_torque(way, moment).ravel() for moment in unfelt)], axis=1))
            for way in ways
        )
        most = TIMES_AS_LARGE * float(np.max(np.abs(tilted))) / float(np.linalg.norm(ways[0]))
        return replace(self, most=most if apart and len(unfelt) == len(FREE) else 0.0)

    def evaluate(self, state: State) -> Contribution:
        """Torque of the change of gravity over the angle."""
        out = self._felt(state)
        sizes = np.linalg.norm(out, axis=(0, 1))
        out[:, :, (sizes < HARDLY_SEEN * np.max(sizes)) & (np.array(self.angles) == 0.0)] = 0.0
        return state.body_columns(out)

    def followed(self, state: State, values: FloatArray) -> FloatArray:
        """First moments, with the angle; those that are not felt level are parameters of the tilt or given."""
        change = np.einsum("k,kx->x", values, self._changes(state.robot))
        rows = state.gravity_rows(change)
        unfelt = unfelt_moments(state.robot)
        if unfelt:
            apart = (rows @ np.stack(unfelt, axis=1)).reshape(-1, len(unfelt))
            flat = rows.reshape(len(apart), -1)
            felt = flat - apart @ np.linalg.lstsq(apart, flat, rcond=None)[0]
            felt[:, np.linalg.norm(felt, axis=0) <= HARDLY_SEEN * np.linalg.norm(flat, axis=0)] = 0.0
            rows = felt.reshape(rows.shape)
        return np.asarray(rows, dtype=np.float64)

    def anchored(self, anchor: Anchor) -> "BaseTilt":
        """With the inertial parameters of the model, and the angles that it has by now."""
        found = [anchor.value(self.parameter_name(label)) for label in ("first", "second")]
        # where only the square is felt, what is told at an angle is the square over that angle
        found = [
            np.sqrt(max(angle * value, 0.0)) if square else value
            for value, angle, square in zip(found, self.angles, self.squared, strict=True)
        ]
        angles = tuple(float(np.clip(angle, -LARGEST, LARGEST)) for angle in found)
        return replace(self, inertial=anchor.inertial(), angles=angles)

    def std_factors(self, robot: Robot) -> FloatArray:
        """Half where only the square of the angle is felt."""
        return np.where(self.squared, 0.5, 1.0)

    def plausible(self, values: FloatArray, parameters: Mapping[str, float]) -> bool:
        """Whether gravity in the plane of the robot becomes less, where it leans out of that."""
        leaning = zip(values, self.angles, self.squared, strict=True)
        return all(value * angle >= 0.0 for value, angle, square in leaning if square)

    def torque(self, robot: Robot, values: FloatArray) -> Action:
        """None: it acts in `modified`."""
        return no_torque

    def modified(self, robot: Robot, values: FloatArray) -> Robot:
        """The robot with its gravity turned, and with the first moments that this was found with."""
        unfelt = () if self.most is None else unfelt_moments(robot)
        if unfelt:
            # what is not felt may be shared among the bodies of a model in any way
            q = np.random.default_rng(1).normal(size=(SAMPLES, robot.n))
            still, ways = np.zeros_like(q), sideways(robot)
            state = State(robot, Motion.rigid(np.arange(SAMPLES) / 100.0, q, still, still))
            lacking = sideways_torque(state, self._links(robot) - robot.inertial_parameters, ways)
            columns = np.stack([sideways_torque(state, moment, ways) for moment in unfelt], axis=1)
            more = np.linalg.lstsq(columns, lacking, rcond=None)[0] @ np.stack(unfelt)
            robot = robot.with_inertial_parameters(robot.inertial_parameters + more, robot.rotor_inertias())
        gravity = np.asarray(robot.model.gravity.linear)
        turn = sum((value * axis for value, axis in zip(values, level_axes(gravity), strict=True)), np.zeros(3))
        return robot.with_gravity(pin.exp3(-turn) @ gravity)

    def _felt(self, state: State) -> FloatArray:
        """(N, n, 2) torque of the change of gravity over each angle."""
        inertial = self._links(state.robot)
        return np.stack([state.gravity_torque(change, inertial) for change in self._changes(state.robot)], axis=2)

    def _changes(self, robot: Robot) -> FloatArray:
        """(2, 3) change of gravity over each angle, as the robot sees it [m/(s2 rad)]."""
        gravity = np.asarray(robot.model.gravity.linear)
        axes = level_axes(gravity)
        turn = self.angles[0] * axes[0] + self.angles[1] * axes[1]
        half = 0.5 * float(np.linalg.norm(turn))
        along, across = np.sinc(2.0 * half / np.pi), 0.5 * np.sinc(half / np.pi) ** 2
        ways = np.cross(np.stack(axes), gravity)
        # the base turns by an angle, so gravity turns the other way as the robot sees it
        return np.asarray(across * np.cross(turn, ways) - along * ways, dtype=np.float64)

    def _links(self, robot: Robot) -> FloatArray:
        """(10 b,) standard inertial parameters of all links."""
        inertial = np.array(self.inertial) if len(self.inertial) else robot.inertial_parameters
        if not self.most:
            return inertial
        first, second = unfelt_moments(robot)
        return np.asarray(inertial + self.moment_first * first + self.moment_second * second, dtype=np.float64)


def _apart(columns: FloatArray) -> bool:
    """Whether none of the columns (M, k) is nearly a sum of the others."""
    sizes = np.linalg.norm(columns, axis=0)
    return bool(np.all(sizes > 0.0)) and float(np.linalg.svd(columns / sizes, compute_uv=False)[-1]) > APART
