"""What an estimator is."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.estimation.observations import Observations
from sea_ident.motion import Motion

VARIANCE_FLOOR = 1e-6
"""Smallest variance of a sample as a share of the mean variance of its joint."""


@dataclass(frozen=True, eq=False)
class Estimate:
    """What an estimator found.

    An estimate is a zero of ``instruments' (torque - rows @ values)``; from that follow all covariances.

    Attributes:
        values: (b,) base parameters.
        instruments: (N, n, b) weighted regressor or instruments Z: ``Z' (torque - F values) = 0``.
        inverse: (b, b) (Z' F)^-1.
        weights: (N, n) weights of the residuals, inverse variances of the mean torque where they are known.
        covariance: (b, b) model-based covariance (paper, eq. 13).
        log_det_weighted: natural logarithm of det F' Sigma^-1 F.
        period_torque: (P, N, n) torques that were used in place of the measured ones, None where those were used.
        motion: motion that was used in place of the mean one, None where that was used.
        notes: what was done.
        warnings: what a user should know.
    """

    values: FloatArray
    instruments: FloatArray
    inverse: FloatArray
    weights: FloatArray
    covariance: FloatArray
    log_det_weighted: float
    period_torque: FloatArray | None = None
    motion: Motion | None = None
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True)
class Estimator(ABC):
    """A way to find base parameters from observations; one class per way."""

    name: ClassVar[str]

    @abstractmethod
    def estimate(self, observations: Observations) -> Estimate:
        """Estimate the base parameters.

        Raises:
            IdentificationError: if the data do not determine them.
        """


def floored(variance: FloatArray) -> tuple[FloatArray, tuple[str, ...]]:
    """Variances that can be divided by: none below a small share of the joint's mean.

    Args:
        variance: (N, n).

    Returns:
        (N, n) positive variances, and warnings. A joint without any scatter gets the smallest scatter of the others;
        where there is none at all every sample counts alike.
    """
    mean = variance.mean(axis=0)
    warnings = []
    dead = mean <= 0.0
    if np.all(dead):
        return np.ones_like(variance), ("the torque does not scatter between periods: all samples weigh the same",)
    if np.any(dead):
        warnings.append("the torque of some joints does not scatter between periods: they weigh as the quietest other")
        mean = np.where(dead, mean[~dead].min(), mean)
        variance = np.where(dead, mean, variance)
    zero = np.count_nonzero(variance <= 0.0)
    if zero:
        warnings.append(
            f"{zero} samples have no scatter between periods; they weigh as if it were {VARIANCE_FLOOR**0.5:g} of the "
            "joint's usual scatter"
        )
    return np.maximum(variance, VARIANCE_FLOOR * mean), tuple(warnings)
