"""Limits as the barrier method sees them: values on a grid of times, their slopes and their curvature."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.excitation.dynamic_limits import DynamicLimits
from sea_ident.excitation.linear_limits import LinearLimits
from sea_ident.motion import Motion, fourier_basis


class Tangent(Protocol):
    """Limits linearised at a trajectory; v coefficients, values in the shape of the wall."""

    def push(self, step: FloatArray) -> FloatArray:
        """Change of the values with a step (n, 2 L + 1)."""

    def pull(self, weight: FloatArray) -> FloatArray:
        """(v,) gradient of the weighted sum of the values."""

    def curvature(self, weight: FloatArray) -> FloatArray:
        """(v, v) weighted sum of the outer products of the slopes."""


class Wall(Protocol):
    """lower <= values <= upper at the times of a grid."""

    @property
    def lower(self) -> FloatArray:
        """(r, 1) lowest values."""

    @property
    def upper(self) -> FloatArray:
        """(r, 1) highest values."""

    def values(self, coefficients: FloatArray) -> FloatArray:
        """(r, M) values at the grid."""

    def tangent(self, coefficients: FloatArray) -> Tangent:
        """Linearised at (n, 2 L + 1) coefficients."""

    def overshoot(self, values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(r, M) how far the value between grid points lies beyond that at the grid point: downward, upward."""


@dataclass(frozen=True, eq=False)
class LinearWall:
    """Linear limits on an equidistant grid.

    Attributes:
        limits: the limits.
        bases: (m, M, 2 L + 1) basis of the derivative that each limit is about.
    """

    limits: LinearLimits
    bases: FloatArray

    @staticmethod
    def of(limits: LinearLimits, base_frequency: float, harmonics: int, points: int) -> "LinearWall":
        """On `points` times of a period."""
        time = np.arange(points) / (points * base_frequency)
        by_order = {
            int(d): fourier_basis(time, base_frequency, harmonics, int(d)) for d in np.unique(limits.derivative)
        }
        bases = [by_order[int(d)] for d in limits.derivative]
        return LinearWall(limits, np.array(bases).reshape(len(limits), points, 2 * harmonics + 1))

    @property
    def lower(self) -> FloatArray:
        """(m, 1)."""
        return self.limits.lower[:, None]

    @property
    def upper(self) -> FloatArray:
        """(m, 1)."""
        return self.limits.upper[:, None]

    def values(self, coefficients: FloatArray) -> FloatArray:
        """(m, M)."""
        combined = self.limits.joints @ coefficients
        values: FloatArray = (self.bases @ combined[:, :, None])[:, :, 0]
        return values

    def tangent(self, coefficients: FloatArray) -> "LinearWall":
        """Itself."""
        return self

    def push(self, step: FloatArray) -> FloatArray:
        """As `values`."""
        return self.values(step)

    def pull(self, weight: FloatArray) -> FloatArray:
        """(v,)."""
        per_limit = (weight[:, None, :] @ self.bases)[:, 0]
        gradient: FloatArray = (self.limits.joints.T @ per_limit).ravel()
        return gradient

    def curvature(self, weight: FloatArray) -> FloatArray:
        """(v, v); every limit is a small block of its joints."""
        joints = self.limits.joints
        blocks = np.swapaxes(self.bases, 1, 2) @ (self.bases * weight[:, :, None])
        n, width = joints.shape[1], self.bases.shape[2]
        pairs = (joints[:, :, None] * joints[:, None, :]).reshape(len(joints), n * n)
        total = (pairs.T @ blocks.reshape(len(joints), width * width)).reshape(n, n, width, width)
        curvature: FloatArray = total.transpose(0, 2, 1, 3).reshape(n * width, n * width)
        return curvature

    def overshoot(self, values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """By parabolas through neighbouring points."""
        return parabolic_overshoot(values)


def parabolic_overshoot(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """How far the peak of the parabola through three neighbours lies beyond the middle one.

    Args:
        values: (r, M) periodic samples.

    Returns:
        (r, M) below each valley of the samples, and above each peak; zero elsewhere.
    """
    left, right = np.roll(values, 1, axis=1), np.roll(values, -1, axis=1)
    bend = 2.0 * values - left - right
    with np.errstate(divide="ignore", invalid="ignore"):
        beyond = np.where(bend != 0.0, (right - left) ** 2 / (8.0 * np.abs(bend)), 0.0)
    peak = (values >= left) & (values >= right) & (bend > 0.0)
    valley = (values <= left) & (values <= right) & (bend < 0.0)
    return _spread(np.where(valley, beyond, 0.0)), _spread(np.where(peak, beyond, 0.0))


def _spread(values: FloatArray) -> FloatArray:
    """Largest of each value and its two neighbours: a peak may move by a grid point."""
    return np.maximum(values, np.maximum(np.roll(values, 1, axis=1), np.roll(values, -1, axis=1)))


@dataclass(frozen=True, eq=False)
class DynamicWall:
    """Torque limits on an equidistant grid.

    Friction turns over within a fraction of a step of the grid. So each limit is taken twice: the upper one with the
    friction of the highest velocity that can be reached on the way to the nearest grid point, the lower one with that
    of the lowest.

    Attributes:
        limits: the limits, with friction that the grid can show.
        base_frequency: of the series [Hz].
        bases: (3, M, 2 L + 1) bases of position, velocity and acceleration.
        smoothing: (n,) velocities within which friction turns over on this grid [rad/s].
    """

    limits: DynamicLimits
    base_frequency: float
    bases: FloatArray
    smoothing: FloatArray

    @staticmethod
    def of(
        limits: DynamicLimits, base_frequency: float, harmonics: int, points: int, smoothing: FloatArray
    ) -> "DynamicWall":
        """On `points` times of a period, with friction that turns over within (n,) velocities [rad/s]."""
        time = np.arange(points) / (points * base_frequency)
        bases = [fourier_basis(time, base_frequency, harmonics, order) for order in range(3)]
        return DynamicWall(limits.smoothed(smoothing), base_frequency, np.array(bases), smoothing)

    def _shifts(self, motion: Motion) -> tuple[FloatArray, ...]:
        """(M, n) changes of velocity on the way to the nearest grid point, and what smoothing takes off friction."""
        if not self.limits.friction:
            return (np.zeros_like(motion.dq),)
        reach = 0.5 * np.abs(motion.ddq) / (len(motion) * self.base_frequency) + self.smoothing
        return reach, -reach

    @property
    def lower(self) -> FloatArray:
        """(r, 1); (2 r, 1) with friction."""
        bound = -self.limits.bound[:, None]
        return np.concatenate([np.full_like(bound, -np.inf), bound]) if self.limits.friction else bound

    @property
    def upper(self) -> FloatArray:
        """(r, 1); (2 r, 1) with friction."""
        bound = self.limits.bound[:, None]
        return np.concatenate([bound, np.full_like(bound, np.inf)]) if self.limits.friction else bound

    def _motion(self, coefficients: FloatArray) -> Motion:
        q, dq, ddq = (basis @ coefficients.T for basis in self.bases)
        return Motion.rigid(np.arange(len(q), dtype=np.float64), q, dq, ddq)

    def values(self, coefficients: FloatArray) -> FloatArray:
        """(r, M); (2 r, M) with friction."""
        motion = self._motion(coefficients)
        return self.limits.evaluate(motion, derivatives=False, shifts=self._shifts(motion))[0].T

    def tangent(self, coefficients: FloatArray) -> "DynamicTangent":
        """Slopes of all torques by all coefficients."""
        motion = self._motion(coefficients)
        _, slopes = self.limits.evaluate(motion, shifts=self._shifts(motion))
        samples, r, states = slopes.shape
        by_state = slopes.reshape(samples, r, 3, states // 3)
        rows = np.einsum("mrdn,dmw->rmnw", by_state, self.bases, optimize=True)
        return DynamicTangent(np.ascontiguousarray(rows.reshape(r, samples, -1)))

    def overshoot(self, values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """By parabolas through neighbouring points."""
        return parabolic_overshoot(values)


@dataclass(frozen=True, eq=False)
class DynamicTangent:
    """Torque limits linearised: (r, M, v) rows."""

    rows: FloatArray

    def push(self, step: FloatArray) -> FloatArray:
        """(r, M)."""
        change: FloatArray = self.rows @ step.ravel()
        return change

    def pull(self, weight: FloatArray) -> FloatArray:
        """(v,)."""
        gradient: FloatArray = weight.ravel() @ self.rows.reshape(-1, self.rows.shape[2])
        return gradient

    def curvature(self, weight: FloatArray) -> FloatArray:
        """(v, v); rows that add nothing that could be seen are left out."""
        rows = self.rows.reshape(-1, self.rows.shape[2])
        size = weight.ravel() * np.einsum("rv,rv->r", rows, rows)
        take = size > 1e-4 * size.max(initial=0.0)
        chosen = rows[take] * np.sqrt(weight.ravel()[take])[:, None]
        curvature: FloatArray = chosen.T @ chosen
        return curvature
