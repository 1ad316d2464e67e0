"""What a good excitation is: functions of the information matrix G = F' F.

All are functions of the eigenvalues of G alone, written so that larger is better. In the basis of the eigenvectors the
slope of such a function is diagonal, and so is the curvature that a quadratic model needs.

References:
    Pukelsheim, Optimal Design of Experiments, SIAM, 2006.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from sea_ident._typing import FloatArray


@dataclass(frozen=True)
class Criterion(ABC):
    """A function of the information matrix that is to be made large."""

    name: ClassVar[str]

    @abstractmethod
    def value(self, eigenvalues: FloatArray) -> float:
        """The criterion; larger is better."""

    @abstractmethod
    def slope(self, eigenvalues: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Derivatives in the basis of the eigenvectors.

        Args:
            eigenvalues: (p,) of G, ascending.

        Returns:
            (p,) derivative with respect to each eigenvalue, and (p, p) nonnegative weights w of a concave model:
            ``value + sum_i slope_i dG_ii - 1/2 sum_ij w_ij dG_ij^2``.
        """

    def reported(self, eigenvalues: FloatArray) -> float:
        """The number by which designs of this criterion are compared in reports."""
        return self.value(eigenvalues)


@dataclass(frozen=True)
class DOptimality(Criterion):
    """log det G: the volume of the confidence ellipsoid (paper, eq. 18)."""

    name: ClassVar[str] = "D"

    def value(self, eigenvalues: FloatArray) -> float:
        """Natural logarithm of the determinant."""
        return float(np.log(eigenvalues).sum()) if eigenvalues[0] > 0.0 else -np.inf

    def slope(self, eigenvalues: FloatArray) -> tuple[FloatArray, FloatArray]:
        """1 / lambda, and 1 / (lambda_i lambda_j)."""
        inverse = 1.0 / eigenvalues
        return inverse, np.outer(inverse, inverse)


@dataclass(frozen=True)
class AOptimality(Criterion):
    """-log trace G^-1: the sum of the variances of the parameters."""

    name: ClassVar[str] = "A"

    def value(self, eigenvalues: FloatArray) -> float:
        """Minus the natural logarithm of the summed variances."""
        return float(-np.log((1.0 / eigenvalues).sum())) if eigenvalues[0] > 0.0 else -np.inf

    def slope(self, eigenvalues: FloatArray) -> tuple[FloatArray, FloatArray]:
        """From the divided differences of -1/lambda."""
        return _negative_power(eigenvalues, 1)


@dataclass(frozen=True)
class EOptimality(Criterion):
    """Log of the smallest eigenvalue of G: the worst combination of parameters.

    The smallest eigenvalue is not smooth where it is multiple; the ascent follows ``-1/k log sum lambda^-k``, which is
    within log(p)/k of it.

    Attributes:
        sharpness: k.
    """

    sharpness: int = 8

    name: ClassVar[str] = "E"

    def value(self, eigenvalues: FloatArray) -> float:
        """Smooth minimum of the logarithms."""
        if eigenvalues[0] <= 0.0:
            return -np.inf
        ratio = (eigenvalues[0] / eigenvalues) ** self.sharpness
        return float(np.log(eigenvalues[0]) - np.log(ratio.sum()) / self.sharpness)

    def slope(self, eigenvalues: FloatArray) -> tuple[FloatArray, FloatArray]:
        """From the divided differences of -lambda^-k."""
        return _negative_power(eigenvalues, self.sharpness)

    def reported(self, eigenvalues: FloatArray) -> float:
        """Log of the smallest eigenvalue."""
        return float(np.log(eigenvalues[0])) if eigenvalues[0] > 0.0 else -np.inf


@dataclass(frozen=True)
class ConditionNumber(Criterion):
    """Minus the log of the condition number of F, sqrt(largest / smallest eigenvalue of G).

    Both ends of the spectrum are smoothed as in `EOptimality`.

    Attributes:
        sharpness: k; larger follows the largest and smallest eigenvalue more closely.
    """

    sharpness: int = 8

    name: ClassVar[str] = "condition number"

    def value(self, eigenvalues: FloatArray) -> float:
        """Minus the logarithm of the smoothed condition number."""
        if eigenvalues[0] <= 0.0:
            return -np.inf
        k = self.sharpness
        low = np.log(eigenvalues[0]) - np.log(((eigenvalues[0] / eigenvalues) ** k).sum()) / k
        high = np.log(eigenvalues[-1]) + np.log(((eigenvalues / eigenvalues[-1]) ** k).sum()) / k
        return float(low - high) / 2.0

    def slope(self, eigenvalues: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Concave part from the small end; the large end adds its slope and a positive curvature."""
        k = self.sharpness
        low, weights = _negative_power(eigenvalues, k)
        share = (eigenvalues / eigenvalues[-1]) ** k
        high = share / share.sum() / eigenvalues
        # divided differences of high: the curvature of the convex function of the large end
        curvature = _divided(eigenvalues, high, (k - 1) * high / eigenvalues)
        return (low - high) / 2.0, (weights + np.maximum(curvature, 0.0)) / 2.0

    def reported(self, eigenvalues: FloatArray) -> float:
        """Minus the log of the condition number."""
        if eigenvalues[0] <= 0.0:
            return -np.inf
        return -0.5 * float(np.log(eigenvalues[-1] / eigenvalues[0]))


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
