"""Linear limits of many harmonics as the barrier method sees them."""

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from sea_ident._typing import FloatArray
from sea_ident.excitation.linear_limits import LinearLimits
from sea_ident.excitation.walls import LinearWall, Wall, parabolic_overshoot

ComplexArray: TypeAlias = NDArray[np.complex128]

# harmonics up to which products with the basis functions themselves are as fast
_FEW = 40


def linear_wall(limits: LinearLimits, base_frequency: float, harmonics: int, points: int) -> Wall:
    """Linear limits on `points` times of a period, in the form that is faster."""
    kind = LinearWall if harmonics <= _FEW else SpectralWall
    return kind.of(limits, base_frequency, harmonics, points)


@dataclass(frozen=True, eq=False)
class SpectralWall:
    """`LinearWall` of many harmonics, by discrete Fourier transforms: nothing grows with points times harmonics.

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
    def of(limits: LinearLimits, base_frequency: float, harmonics: int, points: int) -> "SpectralWall":
        """On `points` times of a period."""
        omega = 2.0 * np.pi * base_frequency * np.arange(1, harmonics + 1)
        gain = omega ** (limits.derivative[:, None] - 1.0)
        return SpectralWall(limits, points, gain, (limits.derivative == 0).astype(np.float64))

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

    def tangent(self, coefficients: FloatArray) -> "SpectralWall":
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
