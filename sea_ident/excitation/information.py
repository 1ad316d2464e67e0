"""The information matrix of a Fourier series and its derivatives with respect to the coefficients."""

from dataclasses import dataclass

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.excitation.columns import ColumnMotion, ModelColumns
from sea_ident.excitation.springs import SpringTorque
from sea_ident.excitation.states import Sampling, SingleArray, StatePoint

# Numbers held at once while derivatives are contracted (single precision).
_CHUNK = 6_000_000
# Samples per harmonic that the curvature is taken from: it only shapes the step.
_CURVATURE_SAMPLES = 12


@dataclass(frozen=True, eq=False)
class Information:
    """G = sum over samples of Phi' W Phi, plus what was collected before.

    Attributes:
        columns: the columns of the model.
        sampling: of one period.
        gain: factor on G, so that a design on few samples compares with a finer one.
        weights: (R,) factor of each row: one over the standard deviation of its noise.
        collected: (p, p) information that is there already.
        springs: springs that predict theta from q; None where theta = q.
    """

    columns: ModelColumns
    sampling: Sampling
    gain: float
    weights: FloatArray
    collected: FloatArray
    springs: SpringTorque | None = None

    def states(self, coefficients: FloatArray) -> StatePoint:
        """The states of (n, 2 L + 1) coefficients."""
        if self.springs is None:
            return self.sampling.rigid(coefficients)
        return self.sampling.elastic(coefficients, self.springs)

    def model(self, coefficients: FloatArray) -> "LocalModel":
        """Columns, information matrix and derivatives at a point."""
        states = self.states(coefficients)
        there = self.columns.at(states.motion)
        phi = there.columns() * (np.sqrt(self.gain) * self.weights)[:, None, None]
        matrix = np.matmul(phi, np.swapaxes(phi, 1, 2)).sum(axis=0) + self.collected
        return LocalModel(self, states, there, phi, matrix)

    def matrix(self, coefficients: FloatArray) -> FloatArray:
        """(p, p) information matrix."""
        return self.model(coefficients).matrix


@dataclass(frozen=True, eq=False)
class LocalModel:
    """The information matrix at a point, and its derivatives when asked for.

    Attributes:
        information: what it was computed from.
        states: the states there.
        columns: the columns there.
        phi: (R, p, N) weighted columns.
        matrix: (p, p) information matrix.
    """

    information: Information
    states: StatePoint
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
        return self.states.pull(self.columns.pull(lever))

    def changes(self, vectors: FloatArray) -> SingleArray:
        """Change of the information matrix with every coefficient, in another basis, from part of the samples.

        Args:
            vectors: (p, k) columns are the basis.

        Returns:
            (n (2 L + 1), k, k) ``V' dG/dc V`` in single precision: it only shapes the step.
        """
        sampling = self.information.sampling
        stride = max(1, sampling.samples // (_CURVATURE_SAMPLES * sampling.harmonics))
        slopes = self.columns.slopes(stride, np.float32)
        samples, rows, p, states = slopes.shape
        k = vectors.shape[1]
        # the weight of the rows of the slopes goes with the smaller factor
        phi = np.matmul(vectors.T, self.phi[:, :, ::stride]) * (stride * self._root)[:, None, None]
        phi = np.ascontiguousarray(phi.transpose(2, 0, 1), dtype=np.float32)
        which = np.arange(0, sampling.samples, stride)
        total: SingleArray = np.zeros((1, 1), dtype=np.float32)
        size = max(1, _CHUNK // (states * p * k))
        for start in range(0, samples, size):
            part = slice(start, min(start + size, samples))
            turned = np.ascontiguousarray(slopes[part].transpose(0, 3, 2, 1), dtype=np.float32)
            # (N, S p, R) @ (N, R, k)
            crossed = (turned.reshape(len(turned), states * p, rows) @ phi[part]).reshape(-1, states, p * k)
            total = total + self.states.spread(crossed, which[part])
        half = np.matmul(vectors.T.astype(np.float32), total.reshape(-1, p, k))
        changes: SingleArray = half + np.swapaxes(half, 1, 2)
        return changes
