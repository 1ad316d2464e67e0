"""What an estimator is."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

from sea_ident._typing import FloatArray
from sea_ident.estimation.estimators.band import Band
from sea_ident.estimation.observations import Observations
from sea_ident.motion import Motion


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
        band: of the residuals that move the estimate; None where all do.
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
    band: Band | None = None
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
