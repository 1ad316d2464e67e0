"""How the state of the robot follows from the coefficients, and what that means for derivatives."""

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from sea_ident._typing import FloatArray, IntArray
from sea_ident.excitation.springs import SpringTorque
from sea_ident.motion import Motion, fourier_basis

SingleArray: TypeAlias = NDArray[np.float32]


class StatePoint(Protocol):
    """The states of one trajectory; S states by N samples, v coefficients."""

    @property
    def motion(self) -> Motion:
        """The motion."""

    def pull(self, by_state: FloatArray) -> FloatArray:
        """(v,) gradient by the coefficients from that by the state (S, N)."""

    def spread(self, by_state: SingleArray, which: IntArray) -> SingleArray:
        """(v, k) sums over some samples of derivatives by the state (N', S, k) times those of the state."""


@dataclass(frozen=True, eq=False)
class Sampling:
    """Equidistant samples of one period of a Fourier series.

    Attributes:
        base_frequency: [Hz].
        harmonics: L.
        samples: N.
    """

    base_frequency: float
    harmonics: int
    samples: int

    @cached_property
    def time(self) -> FloatArray:
        """(N,) [s]."""
        return np.arange(self.samples, dtype=np.float64) / (self.samples * self.base_frequency)

    @cached_property
    def bases(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """(N, 2 L + 1) bases of position, velocity and acceleration."""
        first, second, third = (
            fourier_basis(self.time, self.base_frequency, self.harmonics, order) for order in range(3)
        )
        return first, second, third

    def rigid(self, coefficients: FloatArray) -> "RigidStates":
        """Motors that follow their links: theta = q."""
        q, dq, ddq = (basis @ coefficients.T for basis in self.bases)
        return RigidStates(self, Motion.rigid(self.time, q, dq, ddq))

    def elastic(self, coefficients: FloatArray, springs: SpringTorque) -> "ElasticStates":
        """Motors ahead of their links by the deflection that prior springs need."""
        return ElasticStates(self, springs, self.rigid(coefficients))


@dataclass(frozen=True, eq=False)
class RigidStates:
    """q, q', q'' are linear in the coefficients; theta = q."""

    sampling: Sampling
    motion: Motion

    def pull(self, by_state: FloatArray) -> FloatArray:
        """(v,)."""
        n = self.motion.n
        parts = [by_state[k * n : (k + 1) * n] @ basis for k, basis in enumerate(self.sampling.bases)]
        gradient: FloatArray = (parts[0] + parts[1] + parts[2]).ravel()
        return gradient

    def spread(self, by_state: SingleArray, which: IntArray) -> SingleArray:
        """(v, k)."""
        samples, _, k = by_state.shape
        n = self.motion.n
        width = self.sampling.bases[0].shape[1]
        # all samples and orders in one product
        bases = np.stack([basis[which] for basis in self.sampling.bases], axis=1).astype(by_state.dtype)
        total: SingleArray = bases.reshape(samples * 3, width).T @ by_state.reshape(samples * 3, n * k)
        return total.reshape(width, n, k).transpose(1, 0, 2).reshape(n * width, k)


@dataclass(frozen=True, eq=False)
class ElasticStates:
    """theta = q + deflection; the deflection is what the spring torque of the prior model asks for.

    Its time derivatives are those of the interpolating trigonometric polynomial.
    """

    sampling: Sampling
    springs: SpringTorque
    rigid: RigidStates

    @cached_property
    def _predicted(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """(N, n) deflection, (N, n) its slope by the spring torque, (N, n, 3 n) slope of that by q, q', q''."""
        return self.springs.predict(self.rigid.motion)

    @cached_property
    def motion(self) -> Motion:
        """The motion."""
        rigid, deflection = self.rigid.motion, self._predicted[0]
        return Motion(
            rigid.time,
            rigid.q,
            rigid.dq,
            rigid.ddq,
            rigid.q + deflection,
            rigid.dq + self._differentiate(deflection, 1),
            rigid.ddq + self._differentiate(deflection, 2),
        )

    def _differentiate(self, values: FloatArray, order: int) -> FloatArray:
        """Time derivative of (N, ...) periodic samples."""
        samples = self.sampling.samples
        frequency = 2j * np.pi * self.sampling.base_frequency * np.fft.rfftfreq(samples, 1.0 / samples)
        if samples % 2 == 0 and order % 2 == 1:
            frequency[-1] = 0.0
        spectrum = np.fft.rfft(values, axis=0)
        return np.fft.irfft(spectrum * (frequency**order).reshape(-1, *([1] * (values.ndim - 1))), samples, axis=0)

    def pull(self, by_state: FloatArray) -> FloatArray:
        """(v,); differentiation in time turns its sign when it is transposed."""
        n = self.rigid.motion.n
        first, second, third = (by_state[k * n : (k + 1) * n].T for k in range(3, 6))
        by_deflection = first - self._differentiate(second, 1) + self._differentiate(third, 2)
        _, softness, slopes = self._predicted
        by_torque = by_deflection * softness
        through = np.einsum("ni,nis->sn", by_torque, slopes)
        return self.rigid.pull(by_state[: 3 * n] + by_state[3 * n :] + through)

    @cached_property
    def _deflection_slopes(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """(N, n, v) derivatives of deflection, its rate and its acceleration by the coefficients."""
        _, softness, slopes = self._predicted
        samples, n, _ = slopes.shape
        by_basis = (softness[:, :, None] * slopes).reshape(samples, n, 3, n)
        bases = np.stack(self.sampling.bases)
        position = np.einsum("mrdn,dmw->mrnw", by_basis, bases, optimize=True).reshape(samples, n, -1)
        return position, self._differentiate(position, 1), self._differentiate(position, 2)

    def spread(self, by_state: SingleArray, which: IntArray) -> SingleArray:
        """(v, k)."""
        n = self.rigid.motion.n
        total = self.rigid.spread(by_state[:, : 3 * n] + by_state[:, 3 * n :], which)
        for order, slopes in enumerate(self._deflection_slopes):
            for i in self.springs.joints:
                there = np.ascontiguousarray(slopes[which, i].T, dtype=by_state.dtype)
                total += there @ by_state[:, (3 + order) * n + int(i)]
        return total
