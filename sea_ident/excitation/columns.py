"""The columns of a model and their derivatives with respect to the state, for many samples at once."""

from dataclasses import dataclass, replace

import numpy as np

from sea_ident._typing import FloatArray, IntArray
from sea_ident.effects import Effect, JointEffect, Side, State
from sea_ident.effects.coulomb_friction import CoulombFriction
from sea_ident.effects.link_friction import LinkFriction
from sea_ident.effects.rigid_bodies import RigidBodies
from sea_ident.effects.rotor_inertia import RotorInertia
from sea_ident.effects.spring_damping import SpringDamping
from sea_ident.effects.spring_stiffness import SpringStiffness
from sea_ident.effects.viscous_friction import ViscousFriction
from sea_ident.excitation.bodies import BodyColumns
from sea_ident.motion import Motion
from sea_ident.robot import Robot

# Parts of the state, in the order of their blocks of n.
STATES = ("q", "dq", "ddq", "theta", "dtheta", "ddtheta")


@dataclass(frozen=True, eq=False)
class Slopes:
    """Columns at N samples and their derivatives.

    Attributes:
        columns: (N, R, p) rows of the information matrix: R = n sums, or 2 n link and motor rows.
        slopes: (N, R, p, 6 n) derivatives by `STATES`; (N, R, p, 3 n) where theta = q moves along.
    """

    columns: FloatArray
    slopes: FloatArray


@dataclass(frozen=True, eq=False)
class ModelColumns:
    """Chosen columns of a model.

    Attributes:
        robot: the robot.
        effects: the model.
        chosen: (p,) indices of its columns.
        elastic: whether theta moves on its own; otherwise theta = q.
        separate: whether link and motor rows are kept apart (needed for springs), or summed.
    """

    robot: Robot
    effects: tuple[Effect, ...]
    chosen: IntArray
    elastic: bool = False
    separate: bool = False

    def evaluate(self, motion: Motion, *, derivatives: bool = True) -> Slopes:
        """Columns and derivatives of a motion (theta = q unless `elastic`)."""
        n, samples = self.robot.n, len(motion)
        rows = 2 * n if self.separate else n
        blocks = 6 if self.elastic else 3
        columns = np.zeros((samples, rows, len(self.chosen)))
        slopes = np.zeros((samples, rows, len(self.chosen), blocks * n if derivatives else 0))
        start = 0
        for effect in self.effects:
            count = len(effect.columns(self.robot))
            here = np.flatnonzero((self.chosen >= start) & (self.chosen < start + count))
            if len(here):
                self._add(effect, self.chosen[here] - start, here, motion, columns, slopes, derivatives)
            start += count
        return Slopes(columns, slopes)

    def _add(
        self,
        effect: Effect,
        which: IntArray,
        here: IntArray,
        motion: Motion,
        columns: FloatArray,
        slopes: FloatArray,
        derivatives: bool,
    ) -> None:
        if isinstance(effect, RigidBodies | RotorInertia):
            column, slope = self._bodies(effect, which, motion, derivatives)
            columns[:, :, here] = column
            if derivatives:
                slopes[:, :, here] = slope
        elif isinstance(effect, JointEffect):
            self._joint(effect, which, here, motion, columns, slopes, derivatives)
        else:
            columns[:, :, here] = self._rows(effect, motion)[:, :, which]
            if derivatives:
                slopes[:, :, here] = self._differences(effect, which, motion)

    # -- bodies ----------------------------------------------------------------------------------------------------

    def _bodies(
        self, effect: Effect, which: IntArray, motion: Motion, derivatives: bool
    ) -> tuple[FloatArray, FloatArray]:
        robot = self.robot
        if isinstance(effect, RigidBodies) and not self.elastic and not self.separate:
            # theta = q and no rotor among the columns: the links alone are enough
            take = np.array([robot.extended_model.joints[int(k)].idx_v for k in robot.body_indices])
            model, link, motor, offset = robot.model, robot.link_map[take], None, robot.offset[take]
            bodies = BodyColumns.of(model, which)
        else:
            model, link, motor, offset = robot.extended_model, robot.link_map, robot.motor_map, robot.offset
            bodies = BodyColumns.of(model, self._extended_columns(effect, which))
        theta = (motion.q, motion.dq, motion.ddq)
        if self.elastic:
            theta = (motion.theta, motion.dtheta, motion.ddtheta)

        def at(link_part: FloatArray, motor_part: FloatArray) -> FloatArray:
            whole: FloatArray = link_part @ link.T
            return whole if motor is None else whole + motor_part @ motor.T

        column, slope = bodies.evaluate(
            at(motion.q, theta[0]) + offset, at(motion.dq, theta[1]), at(motion.ddq, theta[2]), derivatives=derivatives
        )
        if isinstance(effect, RotorInertia):
            groups = self._groups(which)
            column = column @ groups
            slope = np.moveaxis(np.moveaxis(slope, 2, 3) @ groups, 3, 2)
        return self._fold(column, link, motor), self._fold_states(self._fold(slope, link, motor), link, motor)

    def _extended_columns(self, effect: Effect, which: IntArray) -> IntArray:
        robot = self.robot
        if isinstance(effect, RigidBodies):
            return 10 * (robot.body_indices[which // 10] - 1) + which % 10
        return 10 * (robot.rotor_indices - 1) + 9

    def _groups(self, which: IntArray) -> FloatArray:
        """(rotors, chosen groups) membership."""
        names = self.robot.rotor_groups
        of = [names.index(f"{rotor.rotor_group}.rotor_inertia") for rotor in self.robot.rotors]
        membership: FloatArray = (np.array(of)[:, None] == which[None, :]).astype(np.float64)
        return membership

    def _fold(self, rows: FloatArray, link: FloatArray, motor: FloatArray | None) -> FloatArray:
        """From rows of coordinates (N, nv, ...) to sums or link and motor rows."""
        motor_part = np.zeros_like(link) if motor is None else motor
        take = np.concatenate([link, motor_part], axis=1) if self.separate else link + motor_part
        return _contract(rows, take, 1)

    def _fold_states(self, slopes: FloatArray, link: FloatArray, motor: FloatArray | None) -> FloatArray:
        """From derivatives by coordinates (..., 3 nv) to derivatives by q (and theta)."""
        if not slopes.shape[-1]:
            return slopes
        nv = link.shape[0]
        parts = [slopes[..., k * nv : (k + 1) * nv] for k in range(3)]
        if self.elastic:
            assert motor is not None
            folded = [part @ link for part in parts] + [part @ motor for part in parts]
        else:
            both = link if motor is None else link + motor
            if nv == both.shape[1] and np.array_equal(both, np.eye(nv)):
                return slopes
            folded = [part @ both for part in parts]
        return np.concatenate(folded, axis=-1)

    # -- effects at one joint --------------------------------------------------------------------------------------

    def _joint(
        self,
        effect: JointEffect,
        which: IntArray,
        here: IntArray,
        motion: Motion,
        columns: FloatArray,
        slopes: FloatArray,
        derivatives: bool,
    ) -> None:
        n, i = self.robot.n, self.robot.index(effect.required_joint)
        theta, dtheta = (motion.theta, motion.dtheta) if self.elastic else (motion.q, motion.dq)
        state = (motion.q[:, i], motion.dq[:, i], theta[:, i], dtheta[:, i])
        value = effect.local_columns(*state)[:, which]
        on_link = {Side.LINK: 1.0, Side.SPRING: -1.0}.get(effect.side, 0.0)
        on_motor = {Side.MOTOR: 1.0, Side.SPRING: 1.0}.get(effect.side, 0.0)
        signs = [(i, on_link), (n + i, on_motor)] if self.separate else [(i, on_link + on_motor)]
        for row, sign in signs:
            columns[:, row, here] = sign * value
        if not derivatives:
            return
        places = (i, n + i, 3 * n + i, 4 * n + i) if self.elastic else (i, n + i, i, n + i)
        for place, part in zip(places, local_slopes(effect, *state), strict=True):
            if part is None:
                continue
            for row, sign in signs:
                slopes[:, row, here, place] += sign * part[:, which]

    # -- any other effect ------------------------------------------------------------------------------------------

    def _rows(self, effect: Effect, motion: Motion) -> FloatArray:
        whole = motion if self.elastic else Motion.rigid(motion.time, motion.q, motion.dq, motion.ddq)
        part = effect.evaluate(State(self.robot, whole))
        rows: FloatArray = np.concatenate([part.link, part.motor], axis=1) if self.separate else part.link + part.motor
        return rows

    def _differences(self, effect: Effect, which: IntArray, motion: Motion) -> FloatArray:
        """Central differences, for effects that say nothing about their derivatives."""
        n = self.robot.n
        names = STATES if self.elastic else STATES[:3]
        parts = []
        step = 1e-6
        for name in names:
            for i in range(n):
                shift = np.zeros(n)
                shift[i] = step
                there, back = (
                    self._rows(effect, replace(motion, **{name: getattr(motion, name) + sign * shift}))[:, :, which]
                    for sign in (1.0, -1.0)
                )
                parts.append((there - back) / (2.0 * step))
        return np.stack(parts, axis=-1)


def _contract(values: FloatArray, matrix: FloatArray, axis: int) -> FloatArray:
    """Product of one axis (length of the rows of the matrix) with a matrix."""
    if matrix.shape[0] == matrix.shape[1] and np.array_equal(matrix, np.eye(len(matrix))):
        return values
    return np.moveaxis(np.tensordot(values, matrix, axes=(axis, 0)), -1, axis)


def local_slopes(
    effect: JointEffect, q: FloatArray, dq: FloatArray, theta: FloatArray, dtheta: FloatArray
) -> tuple[FloatArray | None, FloatArray | None, FloatArray | None, FloatArray | None]:
    """(N, k) derivatives of the columns of an effect by q, q', theta and theta'; None where there is none.

    Known effects are differentiated by hand, others by a difference of fourth order in the state of their joint.
    """
    one = np.ones((len(q), 1))
    if isinstance(effect, ViscousFriction):
        return None, None, None, one
    if isinstance(effect, CoulombFriction):
        return None, None, None, _sign_slope(dtheta, effect.smoothing)
    if isinstance(effect, LinkFriction):
        return None, np.concatenate([one, _sign_slope(dq, effect.smoothing)], axis=1), None, None
    if isinstance(effect, SpringStiffness):
        return -one, None, one, None
    if isinstance(effect, SpringDamping):
        return None, -one, None, one
    state = [q, dq, theta, dtheta]
    parts: list[FloatArray | None] = []
    step = 1e-5
    for k in range(4):

        def moved(steps: int, k: int = k) -> FloatArray:
            there = list(state)
            there[k] = state[k] + steps * step
            return effect.local_columns(*there)

        parts.append((8.0 * (moved(1) - moved(-1)) - (moved(2) - moved(-2))) / (12.0 * step))
    return parts[0], parts[1], parts[2], parts[3]


def _sign_slope(velocity: FloatArray, smoothing: float) -> FloatArray:
    return ((1.0 - np.tanh(velocity / smoothing) ** 2) / smoothing)[:, None]
