"""The columns of a model in a motion and their derivatives by the state, for many samples at once."""

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from sea_ident._typing import FloatArray, IntArray
from sea_ident.effects import Effect, JointEffect, Side
from sea_ident.effects.rigid_bodies import RigidBodies
from sea_ident.effects.rotor_inertia import RotorInertia
from sea_ident.excitation.bodies import BodyColumns, BodyMotion
from sea_ident.excitation.local_slopes import local_slopes
from sea_ident.excitation.other_columns import OtherColumns
from sea_ident.motion import Motion
from sea_ident.robot import Robot


class _Part(Protocol):
    """Columns of one effect in a motion; R rows, k columns, S states, N samples."""

    def columns(self) -> FloatArray:
        """(R, k, N) columns."""

    def pull(self, lever: FloatArray) -> FloatArray:
        """(S, N) gradient by the state of the sum of columns times a lever (R, k, N)."""

    def slopes(self, stride: int, dtype: type[np.floating]) -> FloatArray:
        """(N', R, k, S) derivatives at every so many samples."""


@dataclass(frozen=True, eq=False)
class ModelColumns:
    """Chosen columns of a model.

    Attributes:
        robot: the robot.
        effects: the model.
        chosen: (p,) indices of its columns.
        elastic: whether theta moves on its own (6 n states, as `STATES`); otherwise theta = q (3 n states).
        separate: whether link and motor rows are kept apart (2 n rows, needed for springs) or summed (n rows).
    """

    robot: Robot
    effects: tuple[Effect, ...]
    chosen: IntArray
    elastic: bool = False
    separate: bool = False

    @property
    def rows(self) -> int:
        """Number R of rows per sample."""
        return (2 if self.separate else 1) * self.robot.n

    @property
    def states(self) -> int:
        """Number S of states per sample."""
        return (6 if self.elastic else 3) * self.robot.n

    @cached_property
    def _places(self) -> tuple[tuple[Effect, IntArray, IntArray], ...]:
        """Every effect with its own chosen columns, and where they stand among all chosen."""
        found = []
        start = 0
        for effect in self.effects:
            count = len(effect.columns(self.robot))
            here = np.flatnonzero((self.chosen >= start) & (self.chosen < start + count))
            if len(here):
                found.append((effect, self.chosen[here] - start, here))
            start += count
        return tuple(found)

    @cached_property
    def _bodies(self) -> dict[int, "_BodyMap"]:
        """Of every effect made of bodies, by its place among the effects."""
        return {
            k: _BodyMap.of(self, effect, which)
            for k, (effect, which, _) in enumerate(self._places)
            if isinstance(effect, RigidBodies | RotorInertia)
        }

    def at(self, motion: Motion) -> "ColumnMotion":
        """The columns in a motion of N samples; its theta is ignored unless `elastic`."""
        whole = motion if self.elastic else Motion.rigid(motion.time, motion.q, motion.dq, motion.ddq)
        parts: list[_Part] = []
        for k, (effect, which, _) in enumerate(self._places):
            if k in self._bodies:
                parts.append(self._bodies[k].at(whole))
            elif isinstance(effect, JointEffect):
                parts.append(_JointPart(self, effect, which, whole))
            else:
                parts.append(OtherColumns(self.robot, effect, which, whole, self.elastic, self.separate))
        return ColumnMotion(self, len(motion), tuple(parts), tuple(here for _, _, here in self._places))


@dataclass(frozen=True, eq=False)
class ColumnMotion:
    """The chosen columns in a motion.

    Attributes:
        model: the columns.
        samples: N.
        parts: the columns of every effect.
        places: where they stand among all.
    """

    model: ModelColumns
    samples: int
    parts: tuple[_Part, ...]
    places: tuple[IntArray, ...]

    def columns(self) -> FloatArray:
        """(R, p, N) columns."""
        columns = np.zeros((self.model.rows, len(self.model.chosen), self.samples))
        for part, here in zip(self.parts, self.places, strict=True):
            columns[:, here] = part.columns()
        return columns

    def pull(self, lever: FloatArray) -> FloatArray:
        """(S, N) gradient by the state of the sum of columns times a lever (R, p, N)."""
        gradient = np.zeros((self.model.states, self.samples))
        for part, here in zip(self.parts, self.places, strict=True):
            gradient += part.pull(lever[:, here])
        return gradient

    def slopes(self, stride: int = 1, dtype: type[np.floating] = np.float64) -> FloatArray:
        """(N', R, p, S) derivatives at every so many samples; rows lie next to each other."""
        if len(self.parts) == 1:
            return self.parts[0].slopes(stride, dtype)
        count = len(range(0, self.samples, stride))
        shape = (count, self.model.states, len(self.model.chosen), self.model.rows)
        slopes = np.zeros(shape, dtype=dtype).transpose(0, 3, 2, 1)
        for part, here in zip(self.parts, self.places, strict=True):
            if isinstance(part, _JointPart):
                part.put_slopes(slopes, here, stride)
                continue
            contiguous = np.array_equal(here, np.arange(here[0], here[-1] + 1))
            slopes[:, :, slice(here[0], here[-1] + 1) if contiguous else here] = part.slopes(stride, dtype)
        return slopes


@dataclass(frozen=True, eq=False)
class _BodyMap:
    """Bodies of the extended model and how their coordinates follow from q and theta.

    Attributes:
        bodies: the columns by coordinate.
        link: (nv, n) part of q in the coordinates.
        motor: (nv, n) part of theta.
        offset: (nv,) coordinates at zero.
        fold: (nv, R) rows by coordinate to rows of the model.
        states: (nv, n) of each of the S / 3 n groups of states: q, and theta where it moves on its own.
        groups: (columns of bodies, k) sum over identical rotors, None where there is nothing to sum.
    """

    bodies: BodyColumns
    link: FloatArray
    motor: FloatArray
    offset: FloatArray
    fold: FloatArray
    states: tuple[FloatArray, ...]
    groups: FloatArray | None

    @staticmethod
    def of(model: ModelColumns, effect: Effect, which: IntArray) -> "_BodyMap":
        robot = model.robot
        groups = None
        if isinstance(effect, RigidBodies) and not model.elastic and not model.separate:
            # theta = q and no rotor among the columns: the links alone are enough
            take = np.array([robot.extended_model.joints[int(k)].idx_v for k in robot.body_indices])
            bodies = BodyColumns.of(robot.model, which)
            link, offset = robot.link_map[take], robot.offset[take]
            motor = np.zeros_like(link)
        else:
            link, motor, offset = robot.link_map, robot.motor_map, robot.offset
            parameters = 10 * (robot.rotor_indices - 1) + 9
            if isinstance(effect, RigidBodies):
                parameters = 10 * (robot.body_indices[which // 10] - 1) + which % 10
            else:
                names = robot.rotor_groups
                of = np.array([names.index(f"{rotor.rotor_group}.rotor_inertia") for rotor in robot.rotors])
                groups = (of[:, None] == which[None, :]).astype(np.float64)
            bodies = BodyColumns.of(robot.extended_model, parameters)
        fold = np.concatenate([link, motor], axis=1) if model.separate else link + motor
        states = (link, motor) if model.elastic else (link + motor,)
        return _BodyMap(bodies, link, motor, offset, fold, states, groups)

    def at(self, motion: Motion) -> "_BodyPart":
        def coordinates(q: FloatArray, theta: FloatArray) -> FloatArray:
            whole: FloatArray = self.link @ q.T + self.motor @ theta.T
            return whole

        return _BodyPart(
            self,
            self.bodies.at(
                coordinates(motion.q, motion.theta) + self.offset[:, None],
                coordinates(motion.dq, motion.dtheta),
                coordinates(motion.ddq, motion.ddtheta),
            ),
        )


@dataclass(frozen=True, eq=False)
class _BodyPart:
    map: _BodyMap
    motion: BodyMotion

    def columns(self) -> FloatArray:
        columns = _contract(self.motion.columns(), self.map.fold, 0)
        return columns if self.map.groups is None else _contract(columns, self.map.groups, 1)

    def pull(self, lever: FloatArray) -> FloatArray:
        by_body = lever if self.map.groups is None else _contract(lever, self.map.groups.T, 1)
        by_coordinate = self.motion.pull(_contract(by_body, self.map.fold.T, 0))
        nv = len(self.map.fold)
        return np.concatenate(
            [states.T @ by_coordinate[k * nv : (k + 1) * nv] for states in self.map.states for k in range(3)]
        )

    def slopes(self, stride: int, dtype: type[np.floating]) -> FloatArray:
        slopes = _contract(self.motion.slopes(stride, dtype), self.map.fold.astype(dtype), 1)
        if self.map.groups is not None:
            slopes = _contract(slopes, self.map.groups.astype(dtype), 2)
        nv = len(self.map.fold)
        if len(self.map.states) == 1 and _is_identity(self.map.states[0]):
            return slopes
        return np.concatenate(
            [slopes[..., k * nv : (k + 1) * nv] @ states.astype(dtype) for states in self.map.states for k in range(3)],
            axis=-1,
        )


@dataclass(frozen=True, eq=False)
class _JointPart:
    """An effect at one joint: its columns depend on q, q', theta and theta' of that joint."""

    model: ModelColumns
    effect: JointEffect
    which: IntArray
    motion: Motion

    @cached_property
    def _index(self) -> int:
        return self.model.robot.index(self.effect.required_joint)

    @cached_property
    def _signs(self) -> list[tuple[int, float]]:
        """Rows at which it acts, with sign."""
        on_link = {Side.LINK: 1.0, Side.SPRING: -1.0}.get(self.effect.side, 0.0)
        on_motor = {Side.MOTOR: 1.0, Side.SPRING: 1.0}.get(self.effect.side, 0.0)
        n, i = self.model.robot.n, self._index
        return [(i, on_link), (n + i, on_motor)] if self.model.separate else [(i, on_link + on_motor)]

    @cached_property
    def _state(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        motion, i = self.motion, self._index
        return motion.q[:, i], motion.dq[:, i], motion.theta[:, i], motion.dtheta[:, i]

    @cached_property
    def _slopes(self) -> list[tuple[int, FloatArray]]:
        """State and (N, k) derivative by it."""
        n, i = self.model.robot.n, self._index
        places = (i, n + i, 3 * n + i, 4 * n + i) if self.model.elastic else (i, n + i, i, n + i)
        parts = local_slopes(self.effect, *self._state)
        return [(place, part[:, self.which]) for place, part in zip(places, parts, strict=True) if part is not None]

    def columns(self) -> FloatArray:
        value = self.effect.local_columns(*self._state)[:, self.which].T
        columns = np.zeros((self.model.rows, *value.shape))
        for row, sign in self._signs:
            columns[row] = sign * value
        return columns

    def pull(self, lever: FloatArray) -> FloatArray:
        gradient = np.zeros((self.model.states, len(self.motion)))
        for place, part in self._slopes:
            for row, sign in self._signs:
                gradient[place] += sign * (lever[row] * part.T).sum(axis=0)
        return gradient

    def slopes(self, stride: int, dtype: type[np.floating]) -> FloatArray:
        samples = len(range(0, len(self.motion), stride))
        slopes = np.zeros((samples, self.model.rows, len(self.which), self.model.states), dtype=dtype)
        self.put_slopes(slopes, np.arange(len(self.which)), stride)
        return slopes

    def put_slopes(self, slopes: FloatArray, here: IntArray, stride: int) -> None:
        """Add the few that are not zero to those of all columns, where its own stand at `here`."""
        for place, part in self._slopes:
            for row, sign in self._signs:
                slopes[:, row, here, place] += sign * part[::stride]


def _is_identity(matrix: FloatArray) -> bool:
    return matrix.shape[0] == matrix.shape[1] and np.array_equal(matrix, np.eye(len(matrix)))


def _contract(values: FloatArray, matrix: FloatArray, axis: int) -> FloatArray:
    """Product of one axis with the rows of a matrix."""
    if _is_identity(matrix):
        return values
    return np.moveaxis(np.tensordot(values, matrix, axes=(axis, 0)), -1, axis)
