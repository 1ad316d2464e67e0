"""The information matrix of a Fourier series and its derivatives with respect to the coefficients."""

from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from sea_ident._typing import FloatArray
from sea_ident.excitation.columns import ColumnMotion, ModelColumns
from sea_ident.motion import FourierSeries, Motion, fourier_basis

SingleArray: TypeAlias = NDArray[np.float32]
# Numbers held at once while derivatives are contracted (single precision).
_CHUNK = 6_000_000
# Samples per harmonic that the curvature is taken from: it only shapes the step.
_CURVATURE_SAMPLES = 16


@dataclass(frozen=True, eq=False)
class Information:
    """G = sum over samples of Phi' W Phi, plus what was collected before.

    Attributes:
        columns: the columns of the model.
        base_frequency: of the series [Hz].
        harmonics: of the series, L.
        samples: N, samples per period.
        gain: factor on G, so that a design on few samples compares with a finer one.
        weights: (R,) factor of each row: one over the standard deviation of its noise.
        collected: (p, p) information that is there already.
    """

    columns: ModelColumns
    base_frequency: float
    harmonics: int
    samples: int
    gain: float
    weights: FloatArray
    collected: FloatArray

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

    def motion(self, coefficients: FloatArray) -> Motion:
        """The motion of (n, 2 L + 1) coefficients."""
        q, dq, ddq = (basis @ coefficients.T for basis in self.bases)
        return Motion.rigid(self.time, q, dq, ddq)

    def series(self, coefficients: FloatArray) -> FourierSeries:
        """The series of (n, 2 L + 1) coefficients."""
        return FourierSeries.from_coefficients(coefficients, self.base_frequency)

    def model(self, coefficients: FloatArray) -> "LocalModel":
        """Columns, information matrix and derivatives at a point."""
        there = self.columns.at(self.motion(coefficients))
        phi = there.columns() * (np.sqrt(self.gain) * self.weights)[:, None, None]
        matrix = np.matmul(phi, np.swapaxes(phi, 1, 2)).sum(axis=0) + self.collected
        return LocalModel(self, there, phi, matrix)

    def matrix(self, coefficients: FloatArray) -> FloatArray:
        """(p, p) information matrix."""
        return self.model(coefficients).matrix

    def eigenvalues(self, coefficients: FloatArray) -> FloatArray:
        """(p,) eigenvalues of the information matrix, ascending."""
        return np.asarray(np.linalg.eigvalsh(self.matrix(coefficients)), dtype=np.float64)


@dataclass(frozen=True, eq=False)
class LocalModel:
    """The information matrix at a point, and its derivatives when asked for.

    Attributes:
        information: what it was computed from.
        columns: the columns there.
        phi: (R, p, N) weighted columns.
        matrix: (p, p) information matrix.
    """

    information: Information
    columns: ColumnMotion
    phi: FloatArray
    matrix: FloatArray

    @property
    def _root(self) -> FloatArray:
        """(R,) weight of each row, with the gain."""
        root: FloatArray = np.sqrt(self.information.gain) * self.information.weights
        return root

    def gradient(self, derivative: FloatArray) -> FloatArray:
        """Gradient of a function of G.

        Args:
            derivative: (p, p) symmetric derivative of the function with respect to G.

        Returns:
            (n (2 L + 1),) derivatives with respect to the coefficients.
        """
        lever = np.matmul(2.0 * derivative, self.phi) * self._root[:, None, None]
        by_state = self.columns.pull(lever)
        n = self.columns.model.robot.n
        parts = [by_state[k * n : (k + 1) * n] @ basis for k, basis in enumerate(self.information.bases)]
        gradient: FloatArray = (parts[0] + parts[1] + parts[2]).ravel()
        return gradient

    def changes(self, vectors: FloatArray) -> SingleArray:
        """Change of the information matrix with every coefficient, in another basis, from part of the samples.

        Args:
            vectors: (p, p) columns are the basis.

        Returns:
            (n (2 L + 1), p, p) ``V' dG/dc V`` in single precision: it only shapes the step.
        """
        information = self.information
        stride = max(1, information.samples // (_CURVATURE_SAMPLES * information.harmonics))
        slopes = self.columns.slopes(stride) * (stride * self._root)[:, None, None]
        samples, rows, p, states = slopes.shape
        n = states // 3
        phi = np.matmul(vectors.T, self.phi[:, :, ::stride]).transpose(2, 0, 1).astype(np.float32)
        bases = [basis[::stride].astype(np.float32) for basis in information.bases]
        width = bases[0].shape[1]
        total = np.zeros((width, n * p * p), dtype=np.float32)
        size = max(1, _CHUNK // (states * p * p))
        for start in range(0, samples, size):
            part = slice(start, min(start + size, samples))
            turned = np.ascontiguousarray(slopes[part].transpose(0, 3, 2, 1), dtype=np.float32)
            # (N, S p, R) @ (N, R, p)
            crossed = (turned.reshape(len(turned), states * p, rows) @ phi[part]).reshape(len(turned), 3, n * p * p)
            for k in range(3):
                total += bases[k][part].T @ crossed[:, k]
        half = total.reshape(width, n, p, p).transpose(1, 0, 2, 3).reshape(n * width, p, p)
        half = np.matmul(vectors.T.astype(np.float32), half)
        changes: SingleArray = half + np.swapaxes(half, 1, 2)
        return changes
