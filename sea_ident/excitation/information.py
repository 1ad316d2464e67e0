"""The information matrix of a Fourier series and its derivatives with respect to the coefficients."""

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from sea_ident._typing import FloatArray
from sea_ident.excitation.columns import ModelColumns
from sea_ident.motion import FourierSeries, Motion, fourier_basis

SingleArray: TypeAlias = NDArray[np.float32]
# Numbers held at once while derivatives are contracted (float32).
_CHUNK = 6_000_000


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

    @property
    def time(self) -> FloatArray:
        """(N,) [s]."""
        return np.arange(self.samples, dtype=np.float64) / (self.samples * self.base_frequency)

    def motion(self, coefficients: FloatArray) -> Motion:
        """The motion of (n, 2 L + 1) coefficients."""
        return FourierSeries.from_coefficients(coefficients, self.base_frequency).motion(self.time)

    def matrix(self, coefficients: FloatArray) -> FloatArray:
        """(p, p) information matrix."""
        phi = self.columns.evaluate(self.motion(coefficients), derivatives=False).columns * self.weights[:, None]
        flat = phi.reshape(-1, phi.shape[2])
        matrix: FloatArray = self.gain * (flat.T @ flat) + self.collected
        return matrix

    def model(self, coefficients: FloatArray) -> "LocalModel":
        """Columns, derivatives and information matrix at a point."""
        found = self.columns.evaluate(self.motion(coefficients))
        root = np.sqrt(self.gain) * self.weights
        phi = found.columns * root[:, None]
        slopes = found.slopes * root[:, None, None]
        flat = phi.reshape(-1, phi.shape[2])
        return LocalModel(self, phi, slopes, flat.T @ flat + self.collected)

    def eigenvalues(self, coefficients: FloatArray) -> FloatArray:
        """(p,) eigenvalues of the information matrix, ascending."""
        return np.asarray(np.linalg.eigvalsh(self.matrix(coefficients)), dtype=np.float64)

    def bases(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """(N, 2 L + 1) bases of position, velocity and acceleration."""
        first, second, third = (
            fourier_basis(self.time, self.base_frequency, self.harmonics, order) for order in range(3)
        )
        return first, second, third


@dataclass(frozen=True, eq=False)
class LocalModel:
    """First and second order of a criterion around a point.

    Attributes:
        information: what it was computed from.
        phi: (N, R, p) weighted columns.
        slopes: (N, R, p, S) their derivatives by the state.
        matrix: (p, p) information matrix.
    """

    information: Information
    phi: FloatArray
    slopes: FloatArray
    matrix: FloatArray

    def gradient(self, derivative: FloatArray) -> FloatArray:
        """Gradient of a function of G.

        Args:
            derivative: (p, p) symmetric derivative of the function with respect to G.

        Returns:
            (n (2 L + 1),) derivatives with respect to the coefficients.
        """
        samples, rows, p, states = self.slopes.shape
        lever = 2.0 * (self.phi @ derivative)
        by_state = (lever.reshape(samples, 1, rows * p) @ self.slopes.reshape(samples, rows * p, states))[:, 0]
        n = states // 3
        parts = [basis.T @ by_state[:, k * n : (k + 1) * n] for k, basis in enumerate(self.information.bases())]
        gradient: FloatArray = (parts[0] + parts[1] + parts[2]).T.reshape(-1)
        return gradient

    def changes(self, vectors: FloatArray) -> SingleArray:
        """Change of the information matrix with every coefficient, in another basis.

        Args:
            vectors: (p, p) columns are the basis.

        Returns:
            (n (2 L + 1), p, p) ``V' dG/dc V`` in single precision: it only shapes the step.
        """
        samples, rows, p, states = self.slopes.shape
        n = states // 3
        phi = (self.phi @ vectors).astype(np.float32)
        bases = [basis.astype(np.float32) for basis in self.information.bases()]
        width = bases[0].shape[1]
        total = np.zeros((width, n * p * p), dtype=np.float32)
        size = max(1, _CHUNK // (states * p * p))
        for start in range(0, samples, size):
            part = slice(start, min(start + size, samples))
            slopes = self.slopes[part].astype(np.float32)
            count = slopes.shape[0]
            # (N, S p, R) @ (N, R, p)
            crossed = np.ascontiguousarray(slopes.transpose(0, 3, 2, 1)).reshape(count, states * p, rows) @ phi[part]
            crossed = crossed.reshape(count, 3, n * p * p)
            for k in range(3):
                total += bases[k][part].T @ crossed[:, k]
        half = total.reshape(width, n, p, p).transpose(1, 0, 2, 3).reshape(n * width, p, p)
        half = np.matmul(vectors.T.astype(np.float32), half)
        changes: SingleArray = half + np.swapaxes(half, 1, 2)
        return changes
