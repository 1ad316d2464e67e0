"""Weighted least squares with the torque variance of every sample."""

from dataclasses import dataclass
from typing import ClassVar

from sea_ident.estimation.estimators.base import Estimate, Estimator
from sea_ident.estimation.estimators.weights import sample_weights
from sea_ident.estimation.observations import Observations
from sea_ident.processing.process import SMOOTHING


@dataclass(frozen=True)
class PerSampleWLS(Estimator):
    """The paper's weighting: samples count less where the torque scatters more between periods (eqs. 9, 20).

    What the model lacks adds to the variance, see `sample_weights`; where it lacks nothing this is the paper's
    estimator.

    Attributes:
        smoothing: width of the window over which the variance is averaged [s]; 0 is the paper's raw variance, which
            from few periods is itself noisy, so that the weights follow the noise and eq. 13 is over-confident.
    """

    smoothing: float = SMOOTHING

    name: ClassVar[str] = "per_sample_wls"

    def estimate(self, observations: Observations) -> Estimate:
        """Estimate; see `Estimator.estimate`."""
        found = sample_weights(observations, self.smoothing)
        return Estimate(
            values=found.solution.values,
            instruments=observations.rows * found.weights[:, :, None],
            inverse=found.solution.inverse,
            weights=found.weights,
            covariance=found.solution.inverse,
            log_det_weighted=found.solution.log_det,
            notes=found.notes,
            warnings=found.warnings,
        )
