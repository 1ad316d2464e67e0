"""What estimators see: the regressor of the base parameters and the torques, of the mean and of every period."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from sea_ident._typing import FloatArray
from sea_ident.base_parameters import BaseParameters
from sea_ident.effects import Effect
from sea_ident.effects.coulomb_friction import CoulombFriction
from sea_ident.effects.link_friction import LinkFriction
from sea_ident.estimation.agreement import Agreement, agreement
from sea_ident.motion import Motion
from sea_ident.processing import ProcessedRecording
from sea_ident.regressor import Regressor, build_regressor, build_total
from sea_ident.reversals import around_mean_reversal, without_ringing
from sea_ident.robot import Robot

CHUNK = 20_000
"""Samples of which the regressor is held at once; whole periods, where they are no longer than this."""

REVERSAL = 2.0
"""Speed, in v_off, below which Coulomb friction is not modelled (paper, eq. 3)."""

NEARLY_ALWAYS = 0.95
"""Share of the samples in which a motor stands from which on nothing is told of what acts there [-], ..."""

HARDLY_MOVES = 2e-3
"""... or share of the speed of the fastest up to which it creeps where the others push it [-]."""

CACHE = 400 * 2**20
"""Bytes of period regressors that are kept rather than computed again."""


class SpringSide(Enum):
    """Rows from which the spring torque follows."""

    LINK = "link"
    MOTOR = "motor"
    NONE = "none"


@dataclass(frozen=True, eq=False)
class Rows:
    """Regressor of a motion in the base parameters.

    Attributes:
        total: (N, n, b) motor torque is ``total @ values`` (paper, eq. 8).
        spring: (N, m, b) spring torque of the m elastic joints is ``spring @ values`` from link rows; from motor rows
            the motor torque is to be added. Empty columns where neither determines it.
    """

    total: FloatArray
    spring: FloatArray


def base_rows(
    robot: Robot,
    effects: Sequence[Effect],
    base: BaseParameters,
    motion: Motion,
    channels: Mapping[str, FloatArray] | None = None,
) -> FloatArray:
    """(N, n, b) rows of the motor torque in the base parameters (paper, eq. 8)."""
    rows = np.empty((len(motion), robot.n, base.rank))
    for start in range(0, len(motion), CHUNK):
        part = slice(start, start + CHUNK)
        some = None if channels is None else {kind: values[part] for kind, values in channels.items()}
        rows[part] = build_total(robot, effects, motion[part], some, base.independent)
    return rows


def spring_side(robot: Robot, effects: Sequence[Effect], base: BaseParameters, motion: Motion) -> SpringSide:
    """From which rows the base parameters determine the spring torques: the link rows where possible.

    Link rows need no torque measurement. A rigid joint before an elastic one can hide what they need.
    """
    elastic = robot.elastic_indices
    if not elastic.size:
        return SpringSide.NONE
    regressor = build_regressor(robot, effects, motion[:: max(1, len(motion) // 100)], None)
    if _determined(regressor.link[:, elastic], base):
        return SpringSide.LINK
    if _determined(regressor.motor[:, elastic], base):
        return SpringSide.MOTOR
    return SpringSide.NONE


def _determined(columns: FloatArray, base: BaseParameters) -> bool:
    """Whether rows in all parameters are rows in the base parameters."""
    flat = columns.reshape(-1, columns.shape[-1])
    scale = np.abs(flat).max(axis=0)
    left = np.abs(flat - flat[:, base.independent] @ base.grouping).max(axis=0)
    return bool(np.all(left <= 1e-7 * np.maximum(scale, 1e-6 * scale.max(initial=0.0))))


def friction_is_modelled(robot: Robot, effects: Sequence[Effect], motion: Motion) -> NDArray[np.bool_]:
    """(N, n) False where a joint with Coulomb friction is close to rest.

    tanh(v / v_off) stands for the sign above 2 v_off (paper, eq. 3); below, friction is anything up to breakaway.
    """
    valid = np.ones(motion.q.shape, dtype=bool)
    for effect, kind, index in _frictions(robot, effects):
        valid[:, index] &= np.abs(getattr(motion, kind)[:, index]) > REVERSAL * effect.smoothing
    return valid


def stands(robot: Robot, processed: ProcessedRecording) -> NDArray[np.bool_]:
    """(n,) whether a motor hardly moves, as where friction or a brake holds it.

    Hardly ever faster than its periods differ, or far slower than the fastest that turns, or slides, as it does. Its
    torque is then what others ask of it, and says nothing of its friction or of what it moves.
    """
    speeds = processed.motion.dtheta
    each = [motion.dtheta for motion in processed.period_motions]
    shares = [np.mean(around_mean_reversal(speeds[:, i], [s[:, i] for s in each])) for i in range(speeds.shape[1])]
    rms, slides = np.sqrt(np.mean(speeds**2, axis=0)), np.array([joint.prismatic for joint in robot.joints])
    fastest = np.array([np.max(rms[slides == slide]) for slide in slides])
    stood: NDArray[np.bool_] = (np.array(shares) > NEARLY_ALWAYS) | (rms < HARDLY_MOVES * fastest)
    return stood


def _frictions(
    robot: Robot, effects: Sequence[Effect]
) -> Iterator[tuple[CoulombFriction | LinkFriction, Literal["dtheta", "dq"], int]]:
    """Effects with a friction that jumps, the speed with whose sign it does, and the index of the joint."""
    for effect in effects:
        if isinstance(effect, CoulombFriction):
            yield effect, "dtheta", robot.index(effect.required_joint)
        elif isinstance(effect, LinkFriction):
            yield effect, "dq", robot.index(effect.required_joint)


def _chunks(
    robot: Robot, effects: Sequence[Effect], motion: Motion, channels: Mapping[str, FloatArray] | None
) -> Iterator[tuple[slice, Regressor]]:
    for start in range(0, len(motion), CHUNK):
        part = slice(start, start + CHUNK)
        some = None if channels is None else {kind: values[part] for kind, values in channels.items()}
        yield part, build_regressor(robot, effects, motion[part], some)


@dataclass(frozen=True, eq=False)
class Observations:
    """A recording as equations in the base parameters: ``rows @ values = torque + noise``.

    Attributes:
        robot: the robot.
        effects: the model.
        base: its base parameters.
        processed: the recording.
    """

    robot: Robot
    effects: tuple[Effect, ...]
    base: BaseParameters
    processed: ProcessedRecording

    @property
    def torque(self) -> FloatArray:
        """(N, n) mean motor torque [N m] or [N]."""
        return self.processed.tau_motor

    @property
    def periods(self) -> int:
        """Number P of periods in the mean."""
        return self.processed.periods

    @cached_property
    def spring_side(self) -> SpringSide:
        """From which rows the spring torques follow."""
        return spring_side(self.robot, self.effects, self.base, self.processed.motion)

    def rows_of(self, motion: Motion) -> Rows:
        """Regressor of a motion with the samples of a period; channels are those of the mean."""
        robot, base = self.robot, self.base
        elastic = robot.elastic_indices
        side = self.spring_side
        if side is SpringSide.NONE:
            total = base_rows(robot, self.effects, base, motion, self.processed.channels)
            return Rows(total, np.zeros((len(motion), len(elastic), base.rank)))
        total = np.empty((len(motion), robot.n, base.rank))
        spring = np.zeros((len(motion), len(elastic), base.rank))
        for part, regressor in _chunks(robot, self.effects, motion, self.processed.channels):
            link, motor = regressor.link[:, :, base.independent], regressor.motor[:, :, base.independent]
            if regressor.recorded_sum is None:
                np.add(link, motor, out=total[part])
            else:
                total[part] = regressor.recorded_sum[:, :, base.independent]
            if side is SpringSide.LINK:
                spring[part] = link[:, elastic]
            elif side is SpringSide.MOTOR:
                spring[part] = -motor[:, elastic]
        return Rows(total, spring)

    @cached_property
    def mean(self) -> Rows:
        """Regressor of the mean motion."""
        return self.rows_of(self.processed.motion)

    @property
    def rows(self) -> FloatArray:
        """(N, n, b) regressor of the mean motion."""
        return self.mean.total

    @cached_property
    def _kept_periods(self) -> list[Rows]:
        return [self.rows_of(motion) for motion in self.processed.period_motions]

    def each_period(self) -> Iterator[Rows]:
        """Regressor of the motion of every period; computed once where that fits into memory."""
        parts = self.processed.period_motions
        width = self.robot.n + len(self.robot.elastic_indices)
        if len(parts) * self.processed.samples * width * self.base.rank * 8 <= CACHE:
            yield from self._kept_periods
        else:
            yield from (self.rows_of(motion) for motion in parts)

    @cached_property
    def valid(self) -> NDArray[np.bool_]:
        """(N, n) where the friction model claims to hold, see `friction_is_modelled`."""
        valid = friction_is_modelled(self.robot, self.effects, self.processed.motion)
        # a joint that never leaves rest keeps its rows: there is nothing else of it
        return np.asarray(valid | ~np.any(valid, axis=0), dtype=np.bool_)

    @cached_property
    def judged(self) -> NDArray[np.bool_]:
        """(N, n) where the residual says something about the model: there friction holds, and no reversal is near.

        A fast joint passes the speeds at which friction does not hold between two samples, and those beside it have
        the friction of either side.
        """
        motion, periods = self.processed.motion, self.processed.period_motions
        judged = friction_is_modelled(self.robot, self.effects, motion)
        for _, kind, index in _frictions(self.robot, self.effects):
            speed, *each = (getattr(m, kind)[:, index] for m in (motion, *periods))
            judged[:, index] &= ~around_mean_reversal(speed, each)
        return judged

    def agreement(
        self, mean: FloatArray, periods: FloatArray, used: NDArray[np.bool_] | None = None
    ) -> Agreement | None:
        """How well a residual (N, n) and those of the periods (P, N, n) agree, among these samples (N,) or all."""
        mean, periods = mean.copy(), periods.copy()
        if self.processed.periodic and len(periods):
            for i, joint in enumerate(self.robot.joints):
                left_out = ~self.judged[:, i]
                if 0 < np.count_nonzero(left_out) < len(left_out):
                    harmonics = self.processed.motor_harmonics if joint.elastic else self.processed.link_harmonics
                    mean[:, i] = without_ringing(mean[:, i], left_out, harmonics)
                    periods[:, :, i] = without_ringing(periods[:, :, i], left_out, harmonics)
        return agreement(mean, periods, self.judged if used is None else self.judged & used[:, None])

    def residual(self, values: FloatArray) -> FloatArray:
        """(N, n) torque less what the parameters (b,) explain [N m] or [N]."""
        left: FloatArray = self.torque - self.rows @ values
        return left

    def period_residuals(self, values: FloatArray, torque: FloatArray | None = None) -> FloatArray:
        """(P, N, n) residual of every period, each with its own motion, so that all noise is in it.

        Args:
            values: (b,) parameters.
            torque: (P, N, n) torques in place of the measured ones.
        """
        measured = self.processed.period_tau_motor if torque is None else torque
        if not self.processed.period_motions:
            return np.zeros((0, *measured.shape[1:]))
        return np.stack([measured[p] - rows.total @ values for p, rows in enumerate(self.each_period())])

    def spring_torque(self, rows: Rows, tau_motor: FloatArray, values: FloatArray) -> FloatArray:
        """(N, m) spring torque of the elastic joints by the dynamic model [N m] (paper, eqs. 1-2)."""
        torque: FloatArray = rows.spring @ values
        if self.spring_side is SpringSide.MOTOR:
            torque = torque + tau_motor[:, self.robot.elastic_indices]
        return torque

    def spring_torque_of_periods(self, values: FloatArray) -> Iterator[tuple[Motion, FloatArray]]:
        """Motion of every period, and the (N, m) spring torque with it by parameters (b,) [N m]."""
        processed = self.processed
        periods = zip(processed.period_motions, self.each_period(), processed.period_tau_motor, strict=True)
        return ((motion, self.spring_torque(rows, torque, values)) for motion, rows, torque in periods)
