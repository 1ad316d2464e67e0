"""A push from outside during part of the time."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import ClassVar, Self

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from sea_ident._typing import FloatArray
from sea_ident.effects.acting import Action, SimulationState
from sea_ident.effects.base import Column, Effect, Shape
from sea_ident.effects.signal import is_closed
from sea_ident.effects.state import Contribution, Side, State
from sea_ident.exceptions import EffectError
from sea_ident.robot import Robot

_BEGINS = 32
"""Beginnings of a push that a search tries in a period."""

_LENGTHS = (2, 4, 6, 9)
"""Its lengths, in steps between two beginnings."""

WHEN = ("start", "stop")
"""Shapes that say when it pushes."""

POINT = ("point_x", "point_y", "point_z")
"""Shapes that say where it meets the link."""

_REACH = 0.5
"""Distance from the centre of mass up to which a link is pushed, along every axis [m]."""

RISE = 2.5e-3
"""Time in which a push grows to its size in a simulation, and is gone, around its edges [s]: of a jump a step of the
integrator would take all or nothing."""


@dataclass(frozen=True)
class ExternalForce(Effect):
    """A constant force on a point of a link from `start` to `stop`, -J' f in the link rows.

    Nobody says where a push meets a link; away from the centre of mass as described it turns the link too.

    Attributes:
        joint: joint whose link is pushed.
        start: [s].
        stop: [s]; before `start` where a periodic push goes on round the end of the period.
        period: after which the push comes again, 0 where it comes once [s].
        point_x: where it pushes, from the described centre of mass along the x axis of the link [m].
        point_y: along the y axis [m].
        point_z: along the z axis [m].
    """

    start: float = 0.0
    stop: float = 1e6
    period: float = 0.0
    point_x: float = 0.0
    point_y: float = 0.0
    point_z: float = 0.0

    name: ClassVar[str] = "external_force"
    side: ClassVar[Side] = Side.LINK
    source: ClassVar[str] = (
        "Haddadin, De Luca, Albu-Schaffer, Robot collisions: a survey, IEEE Trans. Robotics 33, 2017"
    )
    shapes: ClassVar[tuple[Shape, ...]] = (
        Shape("start", "s", 0.0, 1e6, logarithmic=False),
        Shape("stop", "s", 0.0, 1e6, logarithmic=False),
        Shape("point_x", "m", -_REACH, _REACH, logarithmic=False),
        Shape("point_y", "m", -_REACH, _REACH, logarithmic=False),
        Shape("point_z", "m", -_REACH, _REACH, logarithmic=False),
    )
    depends_on: ClassVar[tuple[str, ...]] = ("q",)

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """Force along the axes of the base."""
        self._body(robot)
        return tuple(Column(self.parameter_name(axis), "N", self.name, self.joint, self.side) for axis in "xyz")

    def evaluate(self, state: State) -> Contribution:
        """-J' while it pushes, less in the samples in which it begins and ends: as much as it pushes about them."""
        share = self.share_of(state.motion.time)
        link = _jacobians(state, self._body(state.robot), share > 0.0, self._point) * -share[:, None, None]
        return Contribution(link, np.broadcast_to(0.0, link.shape))

    def share_of(self, time: FloatArray) -> FloatArray:
        """(N,) share of the time around each of evenly spaced samples (N,) [s] in which it pushes [-].

        Of periods one after the other, each with the time that it has by itself, too.
        """
        if len(time) < 2:
            return self.pushes(time).astype(np.float64)
        half = 0.5 * float(np.median(np.diff(time)))
        begin, end = time - half, time + half
        if not self.period > 0.0:  # nothing is known of what was before and after
            begin, end = np.maximum(begin, time[0]), np.minimum(end, time[-1])
        return self._share_between(begin, end)

    def _share_between(self, begin: FloatArray, end: FloatArray) -> FloatArray:
        """Share of the time from one moment to another (any shape) [s] in which it pushes [-]."""
        return np.asarray((self._pushed(end) - self._pushed(begin)) / (end - begin), dtype=np.float64)

    def _pushed(self, time: FloatArray) -> FloatArray:
        """(N,) how long it has pushed until some times (N,) [s]."""
        if not self.period > 0.0:
            return np.clip(time, self.start, self.stop)
        length = float(np.mod(self.stop - self.start, self.period))
        rounds, phase = np.divmod(time - self.start, self.period)
        return np.asarray(rounds * length + np.minimum(phase, length), dtype=np.float64)

    def pushes(self, time: FloatArray) -> NDArray[np.bool_]:
        """Whether it pushes at the times (any shape) [s]."""
        phase = np.mod(time, self.period) if self.period > 0.0 else np.asarray(time)
        if self.stop >= self.start:
            return np.asarray((phase >= self.start) & (phase <= self.stop))
        return np.asarray((phase >= self.start) | (phase <= self.stop))

    def torque(self, robot: Robot, values: FloatArray) -> Action:
        """The same at the present state."""
        body, data = self._body(robot), robot.extended_model.createData()
        force = np.asarray(values, dtype=np.float64)

        def act(state: SimulationState, link: FloatArray, motor: FloatArray) -> None:
            share = self._share_around(state.time)
            if share > 0.0:
                x = robot.extended_state(state.q, state.theta)
                link[:] -= robot.link_map.T @ (_jacobian(robot, data, body, x, self._point) @ (share * force))

        return act

    def _share_around(self, time: float) -> float:
        """Share of the time `RISE` around a moment of a simulation in which it pushes [-]."""
        begin, end = time + RISE * np.array([-0.5, 0.5])
        if not self.period > 0.0:  # what pushes once begins with the recording at the earliest
            begin, end = (max(begin, 0.0), end) if time >= 0.0 else (begin, min(end, 0.0))
        return float(self._share_between(begin, end))

    def variants(self, state: State) -> tuple["ExternalForce", ...]:
        """Where the motion closes on itself, pushes in every period: begin and length in steps of a fraction of it."""
        motion = state.motion
        if not is_closed(motion.q):
            return (self,)
        period = float(motion.time[-1] - motion.time[0]) * len(motion) / (len(motion) - 1)
        found = []
        for first in range(_BEGINS):
            for length in _LENGTHS:
                start = first * period / _BEGINS
                stop = float(np.mod(start + length * period / _BEGINS, period))
                found.append(replace(self, start=start, stop=stop, period=period))
        return tuple(found)

    @classmethod
    def in_pieces(cls, variants: Sequence[Self]) -> tuple[Sequence[Self], FloatArray | None]:
        """Pushes that come again and differ by their edges alone: those from every edge to the next one."""
        one = variants[0]
        if not one.period > 0.0 or any(replace(v, start=one.start, stop=one.stop) != one for v in variants):
            return variants, None
        starts, stops = (np.mod([getattr(v, name) for v in variants], one.period) for name in WHEN)
        edges = np.unique(np.concatenate([starts, stops]))
        pieces = [replace(one, start=float(a), stop=float(b)) for a, b in pairwise([*edges, edges[0]])]
        begins, inside = starts[:, None] <= edges, edges < stops[:, None]
        goes_round = (stops < starts)[:, None]
        return pieces, np.where(goes_round, begins | inside, begins & inside).astype(np.float64)

    @property
    def _point(self) -> FloatArray:
        return np.array([self.point_x, self.point_y, self.point_z])

    def _body(self, robot: Robot) -> int:
        if self.joint is None:
            raise EffectError(f"the effect {self.name!r} pushes a link; give the joint that moves it, joint=...")
        robot.index(self.joint)
        names = [robot.extended_model.names[int(index)] for index in robot.body_indices]
        return int(robot.body_indices[names.index(self.joint)])


def _jacobians(state: State, body: int, wanted: NDArray[np.bool_], point: FloatArray) -> FloatArray:
    """(N, n, 3) transposed Jacobians of a point of a body in the link rows, right at least where `wanted` (N,).

    The point is given from the centre of mass, in the axes of the body. What does not depend on it is computed once per
    state, and the last point is kept: many pushes that differ by their edges alone are compared there.
    """
    robot, motion = state.robot, state.motion
    kept: dict[int, tuple[NDArray[np.bool_], FloatArray, FloatArray]] = state.__dict__.setdefault("_jacobians", {})
    last: dict[int, tuple[FloatArray, FloatArray]] = state.__dict__.setdefault("_jacobians_of_point", {})
    nothing = np.zeros(len(motion), dtype=bool), np.zeros((len(motion), robot.n, 6)), np.zeros((len(motion), 3, 3))
    known, rows, turns = kept.setdefault(body, nothing)
    missing = np.flatnonzero(wanted & ~known)
    if len(missing):
        model = robot.extended_model.copy()
        centre = pin.SE3(np.eye(3), model.inertias[body].lever)
        frame = model.addFrame(pin.Frame("pushed", body, 0, centre, pin.FrameType.OP_FRAME))
        data, axes = model.createData(), pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        full = np.empty((len(missing), 6, model.nv))
        for k, x in enumerate(np.ascontiguousarray(robot.extended_state(motion.q[missing], motion.theta[missing]))):
            # a robot with a single velocity gets its Jacobian as a vector
            full[k] = pin.computeFrameJacobian(model, data, x, frame, axes).reshape(6, model.nv)
            turns[missing[k]] = data.oMi[body].rotation
        rows[missing] = robot.link_map.T @ full.transpose(0, 2, 1)
        known[missing] = True
        last.pop(body, None)
    moved = rows[:, :, :3]
    if np.any(point):
        if body not in last or not np.array_equal(last[body][0], point):
            # a point away from the centre moves with the rotation too: v + w x arm
            last[body] = point, moved + np.cross(rows[:, :, 3:], (turns @ point)[:, None])
        moved = last[body][1]
    return moved


def _jacobian(robot: Robot, data: pin.Data, body: int, x: FloatArray, point: FloatArray) -> FloatArray:
    """(nv, 3) transposed Jacobian of a point of a body, given from its centre of mass, in the axes of the base."""
    model = robot.extended_model
    pin.computeJointJacobians(model, data, x)
    # a robot with a single velocity gets its Jacobian as a vector
    full = pin.getJointJacobian(model, data, body, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED).reshape(6, model.nv)
    arm = data.oMi[body].rotation @ (model.inertias[body].lever + point)
    jacobian: FloatArray = full[:3] - pin.skew(arm) @ full[3:]
    return jacobian.T
