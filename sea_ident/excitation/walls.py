"""Limits as the barrier method sees them: values on a grid of times, their slopes and their curvature."""

from dataclasses import dataclass
from typing import Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from sea_ident._typing import FloatArray
from sea_ident.excitation.dynamic_limits import DynamicLimits
from sea_ident.excitation.linear_limits import LinearLimits
from sea_ident.motion import Motion, fourier_basis

ComplexArray: TypeAlias = NDArray[np.complex128]


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
    """Linear limits on an equidistant grid, by discrete Fourier transforms: nothing grows with points times harmonics.

    The derivative that limit k is about has the basis functions ``gain_l cos(l wt + turn)``, ``gain_l sin(l wt +
    turn)`` and, for a position, 1. Products of two of them are cosines and sines of sums and differences of their
    multiples, so that weighted sums of all products follow from the first 2 L Fourier coefficients of the weight.

    Attributes:
        limits: the limits.
        points: M, times of the grid; more than 4 L.
        gain: (m, L).
        position: (m,) 1 where a limit is about a position, 0 elsewhere.
    """

    limits: LinearLimits
    points: int
    gain: FloatArray
    position: FloatArray

    @staticmethod
    def of(limits: LinearLimits, base_frequency: float, harmonics: int, points: int) -> "LinearWall":
        """On `points` times of a period."""
        omega = 2.0 * np.pi * base_frequency * np.arange(1, harmonics + 1)
        gain = omega ** (limits.derivative[:, None] - 1.0)
        return LinearWall(limits, points, gain, (limits.derivative == 0).astype(np.float64))

    @property
    def lower(self) -> FloatArray:
        """(m, 1)."""
        return self.limits.lower[:, None]

    @property
    def upper(self) -> FloatArray:
        """(m, 1)."""
        return self.limits.upper[:, None]

    @property
    def _turned(self) -> ComplexArray:
        """(m, L) gain with the phase of the derivative: each one turns by a quarter of a period."""
        turned: ComplexArray = self.gain * (1j ** (self.limits.derivative[:, None] - 1))
        return turned

    def values(self, coefficients: FloatArray) -> FloatArray:
        """(m, M)."""
        combined, harmonics = self.limits.joints @ coefficients, self.gain.shape[1]
        spectrum = np.zeros((len(combined), harmonics + 1), dtype=np.complex128)
        spectrum[:, 0] = self.points * self.position * combined[:, -1]
        wave = combined[:, :harmonics] - 1j * combined[:, harmonics:-1]
        spectrum[:, 1:] = 0.5 * self.points * self._turned * wave
        return np.fft.irfft(spectrum, self.points, axis=1)

    def tangent(self, coefficients: FloatArray) -> "LinearWall":
        """Itself."""
        return self

    def push(self, step: FloatArray) -> FloatArray:
        """As `values`."""
        return self.values(step)

    def pull(self, weight: FloatArray) -> FloatArray:
        """(v,)."""
        spectrum = np.fft.rfft(weight, axis=1)[:, : self.gain.shape[1] + 1].conj()
        wave = self._turned * spectrum[:, 1:]
        per_limit = np.concatenate([wave.real, wave.imag, (self.position * spectrum[:, 0].real)[:, None]], axis=1)
        gradient: FloatArray = (self.limits.joints.T @ per_limit).ravel()
        return gradient

    def curvature(self, weight: FloatArray) -> FloatArray:
        """(v, v); every limit is a small block of its joints."""
        joints = self.limits.joints
        blocks = self._blocks(weight)
        n, width = joints.shape[1], blocks.shape[1]
        pairs = (joints[:, :, None] * joints[:, None, :]).reshape(len(joints), n * n)
        total = (pairs.T @ blocks.reshape(len(joints), width * width)).reshape(n, n, width, width)
        curvature: FloatArray = total.transpose(0, 2, 1, 3).reshape(n * width, n * width)
        return curvature

    def _blocks(self, weight: FloatArray) -> FloatArray:
        """(m, 2 L + 1, 2 L + 1) weighted sums over the grid of products of the basis functions of every limit."""
        m, harmonics = self.gain.shape
        spectrum = np.fft.rfft(weight, axis=1)[:, : 2 * harmonics + 1].conj()
        order = np.arange(1, harmonics + 1)
        # cos x cos y and its like, from x - y and x + y; the turn of both counts twice in the sum
        apart = order[None, :] - order[:, None]
        difference, total = spectrum[:, np.abs(apart)], spectrum[:, order[:, None] + order[None, :]]
        total = total * np.where(self.limits.derivative % 2 == 1, 1.0, -1.0)[:, None, None]
        half = 0.5 * self.gain[:, :, None] * self.gain[:, None, :]
        mixed = half * (total.imag + np.sign(apart) * difference.imag)
        blocks = np.empty((m, 2 * harmonics + 1, 2 * harmonics + 1))
        blocks[:, :harmonics, :harmonics] = half * (difference.real + total.real)
        blocks[:, harmonics:-1, harmonics:-1] = half * (difference.real - total.real)
        blocks[:, :harmonics, harmonics:-1] = mixed
        blocks[:, harmonics:-1, :harmonics] = np.swapaxes(mixed, 1, 2)
        wave = self.position[:, None] * self._turned * spectrum[:, 1 : harmonics + 1]
        blocks[:, -1, :-1] = np.concatenate([wave.real, wave.imag], axis=1)
        blocks[:, :-1, -1] = blocks[:, -1, :-1]
        blocks[:, -1, -1] = self.position * spectrum[:, 0].real
        return blocks

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
