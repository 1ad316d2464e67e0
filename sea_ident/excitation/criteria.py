"""What a good excitation is: functions of the information matrix G = F' F, written so that larger is better.

References:
    Pukelsheim, Optimal Design of Experiments, SIAM, 2006.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import ClassVar

import numpy as np
import scipy.linalg

from sea_ident._typing import FloatArray
from sea_ident.effects import Effect

# sharpness of smooth forms in the last steps, as a multiple of their own
_REFINED = 4


@dataclass(frozen=True, eq=False)
class LocalCriterion:
    """First and second order of a criterion around a matrix.

    ``value + tr(derivative dG) - 1/2 sum_ij weights_ij (vectors' dG vectors)_ij^2``

    Attributes:
        derivative: (p, p) symmetric.
        vectors: (p, k).
        weights: (k, k), nonnegative.
    """

    derivative: FloatArray
    vectors: FloatArray
    weights: FloatArray


@dataclass(frozen=True)
class Criterion(ABC):
    """A function of the information matrix that is to be made large."""

    name: ClassVar[str]
    tolerance: ClassVar[float] = 1e-4  # gain of a step that is too small to go on for

    @abstractmethod
    def value(self, matrix: FloatArray) -> float:
        """The criterion of a (p, p) matrix; minus infinity where it is singular."""

    @abstractmethod
    def local(self, matrix: FloatArray) -> LocalCriterion:
        """Its derivatives at a (p, p) matrix that is positive definite."""

    def reported(self, matrix: FloatArray) -> float:
        """The number by which designs of this criterion are compared."""
        return self.value(matrix)

    def refined(self) -> "Criterion":
        """What to follow in the last steps, if the criterion is a smooth form of the reported number."""
        return self

    def describe(self) -> str:
        """Its name, with what it is about."""
        return self.name


@dataclass(frozen=True)
class SpectralCriterion(Criterion):
    """A criterion of the eigenvalues alone: its derivatives are diagonal in the basis of the eigenvectors."""

    @abstractmethod
    def of(self, eigenvalues: FloatArray) -> float:
        """The criterion of positive eigenvalues in ascending order."""

    @abstractmethod
    def slope(self, eigenvalues: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(p,) derivatives by the eigenvalues, and (p, p) weights of the concave model in their basis."""

    def of_report(self, eigenvalues: FloatArray) -> float:
        """The number that is reported."""
        return self.of(eigenvalues)

    def scaling(self, matrix: FloatArray) -> FloatArray:
        """(p,) factors of rows and columns with which the matrix is judged."""
        return np.ones(len(matrix))

    def _eigenvalues(self, matrix: FloatArray) -> FloatArray:
        diagonal = np.diag(matrix)
        if not np.all(np.isfinite(matrix)) or float(diagonal.min()) <= 0.0:
            return np.zeros(1)
        scale = self.scaling(matrix)
        return np.asarray(np.linalg.eigvalsh(matrix * np.outer(scale, scale)), dtype=np.float64)

    def value(self, matrix: FloatArray) -> float:
        """The criterion of a (p, p) matrix."""
        eigenvalues = self._eigenvalues(matrix)
        return self.of(eigenvalues) if eigenvalues[0] > 0.0 else -np.inf

    def reported(self, matrix: FloatArray) -> float:
        """The number that is reported."""
        eigenvalues = self._eigenvalues(matrix)
        return self.of_report(eigenvalues) if eigenvalues[0] > 0.0 else -np.inf

    def local(self, matrix: FloatArray) -> LocalCriterion:
        """Derivatives through the eigenvectors."""
        scale = self.scaling(matrix)
        eigenvalues, vectors = np.linalg.eigh(matrix * np.outer(scale, scale))
        slope, weights = self.slope(eigenvalues)
        derivative = (vectors * slope) @ vectors.T
        return LocalCriterion(
            self.unscale(matrix, scale, derivative), scale[:, None] * vectors, np.maximum(weights, 0.0)
        )

    def unscale(self, matrix: FloatArray, scale: FloatArray, derivative: FloatArray) -> FloatArray:
        """(p, p) derivative by G of a function with this derivative by the scaled G."""
        return derivative


@dataclass(frozen=True)
class DOptimality(Criterion):
    """log det G: the volume of the confidence ellipsoid (paper, eq. 18).

    Units of the parameters only shift it, so that it is computed with columns of unit norm.
    """

    name: ClassVar[str] = "D"
    tolerance: ClassVar[float] = 1e-3

    def value(self, matrix: FloatArray) -> float:
        """Natural logarithm of the determinant."""
        return log_det(matrix)

    def local(self, matrix: FloatArray) -> LocalCriterion:
        """G^-1, and the square of dG in the metric of G^-1."""
        scale = 1.0 / np.sqrt(np.diag(matrix))
        eigenvalues, vectors = np.linalg.eigh(matrix * np.outer(scale, scale))
        whitening = scale[:, None] * vectors / np.sqrt(eigenvalues)
        return LocalCriterion(whitening @ whitening.T, whitening, np.ones_like(matrix))


def log_det(matrix: FloatArray) -> float:
    """Natural logarithm of the determinant of a symmetric matrix; minus infinity where it is not positive definite."""
    diagonal = np.diag(matrix)
    if not np.all(np.isfinite(matrix)) or float(diagonal.min()) <= 0.0:
        return -np.inf
    scale = 1.0 / np.sqrt(diagonal)
    eigenvalues = np.linalg.eigvalsh(matrix * np.outer(scale, scale))
    if eigenvalues[0] <= 1e-15 * eigenvalues[-1]:
        return -np.inf
    return float(np.log(eigenvalues).sum() + np.log(diagonal).sum())


@dataclass(frozen=True)
class AOptimality(SpectralCriterion):
    """-log trace G^-1: the sum of the variances of the parameters."""

    name: ClassVar[str] = "A"

    def of(self, eigenvalues: FloatArray) -> float:
        """Minus the natural logarithm of the summed variances."""
        return float(-np.log((1.0 / eigenvalues).sum()))

    def slope(self, eigenvalues: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Of ``-log sum 1/lambda``."""
        return _negative_power(eigenvalues, 1)


@dataclass(frozen=True)
class EOptimality(SpectralCriterion):
    """Log of the smallest eigenvalue of G: the worst combination of parameters.

    The smallest eigenvalue is not smooth where it is multiple; the ascent follows ``-1/k log sum lambda^-k``, which is
    within log(p)/k of it.

    Attributes:
        sharpness: k.
    """

    sharpness: int = 8

    name: ClassVar[str] = "E"

    def refined(self) -> Criterion:
        """Nearer to the smallest eigenvalue."""
        return replace(self, sharpness=_REFINED * self.sharpness)

    def of(self, eigenvalues: FloatArray) -> float:
        """Smooth minimum of the logarithms."""
        return _smallest(eigenvalues, self.sharpness)

    def slope(self, eigenvalues: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Of the smooth minimum."""
        return _negative_power(eigenvalues, self.sharpness)

    def of_report(self, eigenvalues: FloatArray) -> float:
        """Log of the smallest eigenvalue."""
        return float(np.log(eigenvalues[0]))


class Scaling(StrEnum):
    """How the columns of F are scaled before they are judged."""

    NONE = "none"
    UNIT_COLUMNS = "unit columns"


@dataclass(frozen=True)
class ConditionNumber(SpectralCriterion):
    """Minus the log of the condition number of F, sqrt(largest / smallest eigenvalue of G).

    Both ends of the spectrum are smoothed as in `EOptimality`.

    Attributes:
        columns: whether F is taken as it is, or with its columns divided by their norms (paper, section II-B).
        sharpness: k; larger follows the largest and smallest eigenvalue more closely.
    """

    columns: Scaling = Scaling.NONE
    sharpness: int = 8

    name: ClassVar[str] = "condition number"

    def refined(self) -> Criterion:
        """Nearer to the largest and smallest eigenvalues."""
        return replace(self, sharpness=_REFINED * self.sharpness)

    def scaling(self, matrix: FloatArray) -> FloatArray:
        """One, or one over the norm of each column of F."""
        if self.columns is Scaling.NONE:
            return np.ones(len(matrix))
        scale: FloatArray = 1.0 / np.sqrt(np.diag(matrix))
        return scale

    def unscale(self, matrix: FloatArray, scale: FloatArray, derivative: FloatArray) -> FloatArray:
        """Through the norms of the columns too, where these scale."""
        if self.columns is Scaling.NONE:
            return derivative
        scaled = matrix * np.outer(scale, scale)
        through = (derivative * scaled).sum(axis=1) * scale**2
        return derivative * np.outer(scale, scale) - np.diag(through)

    def of(self, eigenvalues: FloatArray) -> float:
        """Minus the logarithm of the smoothed condition number."""
        high = np.log(eigenvalues[-1]) + np.log(((eigenvalues / eigenvalues[-1]) ** self.sharpness).sum()) / (
            self.sharpness
        )
        return float(_smallest(eigenvalues, self.sharpness) - high) / 2.0

    def slope(self, eigenvalues: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Of both ends; the large end, which is not concave, counts with the curvature of its convex part."""
        k = self.sharpness
        low, weights = _negative_power(eigenvalues, k)
        share = (eigenvalues / eigenvalues[-1]) ** k
        high = share / share.sum() / eigenvalues
        curvature = _divided(eigenvalues, high, (k - 1) * high / eigenvalues)
        return (low - high) / 2.0, (weights + np.maximum(curvature, 0.0)) / 2.0

    def of_report(self, eigenvalues: FloatArray) -> float:
        """Minus the log of the condition number."""
        return -0.5 * float(np.log(eigenvalues[-1] / eigenvalues[0]))


@dataclass(frozen=True)
class Discrimination(Criterion):
    """Log det of what one effect leaves after the model and another effect have explained all they can.

    The part of the columns of `target` that lies outside the span of the model and of `against` is what tells the two
    apart: with G ordered (rest, target), ``S = G_tt - G_tr G_rr^-1 G_rt``.

    Attributes:
        target: the effect to be seen.
        against: what it must not be mistaken for; the columns of the model belong to the rest anyway.
    """

    target: Effect
    against: tuple[Effect, ...] = ()

    name: ClassVar[str] = "discrimination"

    def describe(self) -> str:
        """Which effect it tells from which."""
        others = ", ".join(effect.parameter_name() for effect in self.against)
        return f"{self.name} of {self.target.parameter_name()} from {others or 'the model'}"

    def bind(self, columns: int) -> "BoundDiscrimination":
        """For information matrices whose last `columns` belong to the target."""
        return BoundDiscrimination(self.target, self.against, columns)

    def value(self, matrix: FloatArray) -> float:
        """Not defined before `bind`."""
        raise NotImplementedError("bind the criterion to the number of columns of its target first")

    def local(self, matrix: FloatArray) -> LocalCriterion:
        """Not defined before `bind`."""
        raise NotImplementedError("bind the criterion to the number of columns of its target first")


@dataclass(frozen=True)
class BoundDiscrimination(Discrimination):
    """`Discrimination` of the last columns of a known matrix.

    Attributes:
        columns: number t of columns of the target.
    """

    columns: int = 1

    def _parts(self, matrix: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """(p, t) K with K' G K = S, (t, t) S, and the (r, r) Cholesky factor of the rest."""
        rest = len(matrix) - self.columns
        factor = np.asarray(np.linalg.cholesky(matrix[:rest, :rest]), dtype=np.float64)
        across = scipy.linalg.cho_solve((factor, True), matrix[:rest, rest:])
        left = matrix[rest:, rest:] - matrix[rest:, :rest] @ across
        return np.vstack([-across, np.eye(self.columns)]), left, factor

    def value(self, matrix: FloatArray) -> float:
        """Log det S."""
        try:
            _, left, _ = self._parts(matrix)
            factor = np.linalg.cholesky(left)
        except np.linalg.LinAlgError:
            return -np.inf
        return float(2.0 * np.log(np.diag(factor)).sum())

    def local(self, matrix: FloatArray) -> LocalCriterion:
        """S is concave in G.

        With V1 = K S^-1/2 and V2 = G_rr^-1/2, log det S bends by ``|V1' dG V1|^2 + 2 |V2' dG V1|^2``.
        """
        lever, left, factor = self._parts(matrix)
        rest = len(factor)
        root = np.linalg.inv(np.linalg.cholesky(left))
        first = lever @ root.T
        second = np.zeros((len(matrix), rest))
        second[:rest] = scipy.linalg.solve_triangular(factor, np.eye(rest), lower=True).T
        weights = np.ones((rest + self.columns,) * 2)
        weights[:rest, :rest] = 0.0
        return LocalCriterion(first @ first.T, np.hstack([second, first]), weights)


def _smallest(eigenvalues: FloatArray, k: int) -> float:
    """Smooth minimum of the logarithms."""
    ratio = (eigenvalues[0] / eigenvalues) ** k
    return float(np.log(eigenvalues[0]) - np.log(ratio.sum()) / k)


def _divided(x: FloatArray, y: FloatArray, slope: FloatArray) -> FloatArray:
    """(p, p) divided differences (y_i - y_j) / (x_i - x_j), the slope where x_i = x_j."""
    difference = x[:, None] - x[None, :]
    near = np.abs(difference) <= 1e-9 * np.abs(x[:, None] + x[None, :])
    with np.errstate(divide="ignore", invalid="ignore"):
        quotient = (y[:, None] - y[None, :]) / difference
    return np.where(near, (slope[:, None] + slope[None, :]) / 2.0, quotient)


def _negative_power(eigenvalues: FloatArray, k: int) -> tuple[FloatArray, FloatArray]:
    """Slope and concave weights of ``-1/k log sum lambda^-k``."""
    share = (eigenvalues[0] / eigenvalues) ** k
    slope = share / share.sum() / eigenvalues
    return slope, -_divided(eigenvalues, slope, -(k + 1) * slope / eigenvalues)
