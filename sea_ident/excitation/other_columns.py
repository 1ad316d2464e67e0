"""Columns of effects that say nothing about their derivatives, and these by differences of many steps at once."""

from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property

import numpy as np

from sea_ident._typing import FloatArray, IntArray
from sea_ident.effects import Effect, State
from sea_ident.excitation.bodies import BodyColumns
from sea_ident.motion import Motion
from sea_ident.robot import Robot

# Parts of the state, in the order of their blocks of n.
STATES = ("q", "dq", "ddq", "theta", "dtheta", "ddtheta")

SAMPLES_AT_ONCE = 3000
"""Samples in which an effect is evaluated at a time: fewer call it more often, more do not fit into the cache."""

STEP = 1e-6
"""Of a central difference [rad], [m] and their rates."""


@dataclass(frozen=True, eq=False)
class OtherColumns:
    """Columns of an effect that says nothing about its derivatives: these are central differences.

    Attributes:
        robot: the robot.
        effect: the effect; one without memory.
        which: (k,) its columns that are asked for.
        motion: (N, n) motion.
        elastic: whether theta moves on its own.
        separate: whether link and motor rows are kept apart or summed.
    """

    robot: Robot
    effect: Effect
    which: IntArray
    motion: Motion
    elastic: bool
    separate: bool

    def _rows(self, state: State) -> FloatArray:
        """(N, R, k)."""
        part = self.effect.evaluate(state)
        rows = np.concatenate([part.link, part.motor], axis=1) if self.separate else part.link + part.motor
        chosen: FloatArray = rows[:, :, self.which]
        return chosen

    @cached_property
    def _differences(self) -> FloatArray:
        """(N, R, k, S)."""
        n, samples = self.robot.n, len(self.motion)
        names_of_states = STATES if self.elastic else STATES[:3]
        rows = n * (2 if self.separate else 1)
        differences = np.zeros((samples, rows, len(self.which), n * len(names_of_states)))
        moves: list[tuple[int, tuple[str, ...], int]] = []
        for k, name in enumerate(names_of_states):
            partner = {"q": "theta", "dq": "dtheta", "ddq": "ddtheta"}.get(name)
            names = (name,) if self.elastic or partner is None else (name, partner)
            if not set(names).isdisjoint(self.effect.depends_on):
                moves.extend((k * n + i, names, i) for i in range(n))
        links = _Links(self.robot, self.motion)
        portion = max(SAMPLES_AT_ONCE // (2 * samples), 1)
        for begin in range(0, len(moves), portion):
            some = moves[begin : begin + portion]
            steps = [_Step(names, i, sign * STEP) for _, names, i in some for sign in (1.0, -1.0)]
            # an effect without memory does not ask which sample comes after which
            moved = self._rows(_Stepped.of(links, steps))
            there, back = np.moveaxis(moved.reshape(len(some), 2, samples, *moved.shape[1:]), 1, 0)
            slopes = (there - back) / (2.0 * STEP)
            differences[..., [state for state, _, _ in some]] = np.moveaxis(slopes, 0, -1)
        return differences

    def columns(self) -> FloatArray:
        """(R, k, N) columns."""
        return self._rows(State(self.robot, self.motion)).transpose(1, 2, 0)

    def pull(self, lever: FloatArray) -> FloatArray:
        """(S, N) gradient by the state of the sum of columns times a lever (R, k, N)."""
        return np.asarray(np.einsum("rpn,nrps->sn", lever, self._differences, optimize=True), dtype=np.float64)

    def slopes(self, stride: int, dtype: type[np.floating]) -> FloatArray:
        """(N', R, k, S) derivatives at every so many samples."""
        return self._differences[::stride].astype(dtype)


@dataclass(frozen=True)
class _Step:
    """A step of parts of the state at one joint."""

    names: tuple[str, ...]
    joint: int
    size: float

    def taken(self, motion: Motion) -> Motion:
        """A motion with this step in all of its samples."""
        changed = {}
        for name in self.names:
            values = getattr(motion, name).copy()
            values[:, self.joint] += self.size
            changed[name] = values
        return replace(motion, **changed)


class _Links:
    """Torque of the links in a motion and its derivatives.

    Args:
        robot: the robot.
        motion: (N, n) motion.
    """

    def __init__(self, robot: Robot, motion: Motion) -> None:
        self.robot, self.motion = robot, motion
        self._known: dict[bytes, tuple[FloatArray, dict[str, FloatArray]]] = {}

    def torque(self, inertial: FloatArray) -> tuple[FloatArray, dict[str, FloatArray]]:
        """(N, n) with standard inertial parameters (10 b,), and its derivatives (N, n, n) by q, q' and q''."""
        key = inertial.tobytes()
        if key not in self._known:
            robot, motion = self.robot, self.motion
            rows = [robot.extended_model.joints[int(k)].idx_v for k in robot.body_indices]
            link = robot.link_map[rows]
            x, v, a = (link @ values.T for values in (motion.q, motion.dq, motion.ddq))
            bodies = BodyColumns.torque(robot.model, inertial).at(x + robot.offset[rows][:, None], v, a)
            by_coordinate = np.split(bodies.slopes()[:, :, 0], 3, axis=-1)
            slopes = {name: link.T @ part @ link for name, part in zip(STATES[:3], by_coordinate, strict=True)}
            self._known[key] = np.asarray(bodies.columns()[:, 0].T @ link, dtype=np.float64), slopes
        return self._known[key]


@dataclass(frozen=True, eq=False)
class _Stepped(State):
    """A motion again and again, with another step each time.

    The torque of the links follows by its derivatives: from sample to sample it would take longer than all the rest.

    Attributes:
        links: in the motion without a step.
        steps: one after the other.
    """

    links: _Links = field(kw_only=True)
    steps: Sequence[_Step] = field(kw_only=True)

    @staticmethod
    def of(links: _Links, steps: Sequence[_Step]) -> "_Stepped":
        taken = [step.taken(links.motion) for step in steps]
        one_after_another = (np.concatenate([getattr(each, f.name) for each in taken]) for f in fields(Motion))
        return _Stepped(links.robot, Motion(*one_after_another), links=links, steps=steps)

    def body_torque(self, inertial: FloatArray) -> FloatArray:
        """(N', n) torque that the links with these standard inertial parameters (10 b,) need [N m]."""
        torque, slopes = self.links.torque(inertial)
        stepped = [
            torque + sum(step.size * slopes[name][:, :, step.joint] for name in step.names if name in slopes)
            for step in self.steps
        ]
        return np.concatenate(stepped)
