"""Weighted least squares with the torque variance of every sample."""

from dataclasses import dataclass
from typing import ClassVar

from sea_ident.estimation.estimators.base import Estimate, Estimator, floored
from sea_ident.estimation.observations import Observations
from sea_ident.estimation.solve import solve_weighted
from sea_ident.processing.process import SMOOTHING
from sea_ident.processing.variance import smooth_over_phase


@dataclass(frozen=True)
class PerSampleWLS(Estimator):
    """The paper's weighting: samples count less where the torque scatters more between periods (eqs. 9, 20).

    Attributes:
        smoothing: width of the window over which the variance is averaged [s]; 0 is the paper's raw variance, which
            from few periods is itself noisy, so that the weights follow the noise and eq. 13 is over-confident.
    """

    smoothing: float = SMOOTHING

    name: ClassVar[str] = "per_sample_wls"

    def estimate(self, observations: Observations) -> Estimate:
        """Estimate; see `Estimator.estimate`."""
        processed = observations.processed
        variance = processed.raw_tau_variance
        if processed.periods > 1:
            variance = smooth_over_phase(variance, processed.interval, self.smoothing)
        variance, warnings = floored(variance / processed.periods)
        rows, torque = observations.rows, observations.torque
        weights = 1.0 / variance
        solution = solve_weighted(rows, torque, weights)
        return Estimate(
            values=solution.values,
            instruments=rows * weights[:, :, None],
            inverse=solution.inverse,
            weights=weights,
            covariance=solution.inverse,
            log_det_weighted=solution.log_det,
            warnings=warnings,
        )
