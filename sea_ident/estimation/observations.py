"""What estimators see: the regressor of the base parameters and the torques, of the mean and of every period."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sea_ident._typing import FloatArray
from sea_ident.base_parameters import BaseParameters
from sea_ident.effects import Effect
from sea_ident.effects.coulomb_friction import CoulombFriction
from sea_ident.effects.link_friction import LinkFriction
from sea_ident.motion import Motion
from sea_ident.processing import ProcessedRecording
from sea_ident.regressor import build_regressor
from sea_ident.robot import Robot

CHUNK = 1000
"""Samples of which the regressor is held at once."""

REVERSAL = 2.0
"""Speed, in v_off, below which Coulomb friction is not modelled (paper, eq. 3)."""


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
        regressor = build_regressor(robot, effects, motion[part], some)
        rows[part] = regressor.link[:, :, base.independent]
        rows[part] += regressor.motor[:, :, base.independent]
    return rows


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
    def rows(self) -> FloatArray:
        """(N, n, b) regressor of the mean motion."""
        return base_rows(self.robot, self.effects, self.base, self.processed.motion, self.processed.channels)

    @cached_property
    def period_rows(self) -> FloatArray:
        """(P, N, n, b) regressor of the motion of every period; empty where only one is there."""
        parts = [base_rows(self.robot, self.effects, self.base, motion) for motion in self.processed.period_motions]
        return np.stack(parts) if parts else np.zeros((0, *self.rows.shape))

    @cached_property
    def valid(self) -> NDArray[np.bool_]:
        """(N, n) where the friction model claims to hold: not while a joint with Coulomb friction is close to rest.

        tanh(v / v_off) stands for the sign above 2 v_off (paper, eq. 3); below, friction is anything up to breakaway.
        """
        motion = self.processed.motion
        valid = np.ones(motion.q.shape, dtype=bool)
        for effect in self.effects:
            if isinstance(effect, CoulombFriction):
                joint, speed = effect.required_joint, motion.dtheta
            elif isinstance(effect, LinkFriction):
                joint, speed = effect.required_joint, motion.dq
            else:
                continue
            index = self.robot.index(joint)
            moving = np.abs(speed[:, index]) > REVERSAL * effect.smoothing
            if np.any(moving):
                valid[:, index] &= moving
        return valid

    def residual(self, values: FloatArray) -> FloatArray:
        """(N, n) torque less what the parameters (b,) explain [N m] or [N]."""
        left: FloatArray = self.torque - self.rows @ values
        return left

    def period_residuals(self, values: FloatArray) -> FloatArray:
        """(P, N, n) residual of every period, each with its own motion, so that all noise is in it."""
        left = np.empty_like(self.processed.period_tau_motor)
        if not self.processed.period_motions:
            return left[:0]
        for p, motion in enumerate(self.processed.period_motions):
            rows = base_rows(self.robot, self.effects, self.base, motion)
            left[p] = self.processed.period_tau_motor[p] - rows @ values
        return left
