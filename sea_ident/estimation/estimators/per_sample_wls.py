"""Weighted least squares with the torque variance of every sample."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from sea_ident.estimation.estimators.base import Estimate, Estimator, floored
from sea_ident.estimation.observations import Observations
from sea_ident.estimation.solve import solve_weighted
from sea_ident.processing.process import SMOOTHING
from sea_ident.processing.variance import smooth_over_phase

ROUNDS = 5
"""Rounds in which the rest of the residual is found."""

LEAST_REST = 0.2
"""A rest below this share of the noise variance is chance."""


@dataclass(frozen=True)
class PerSampleWLS(Estimator):
    """The paper's weighting: samples count less where the torque scatters more between periods (eqs. 9, 20).

    The scatter says nothing of what the model lacks. Where the residual is larger than the scatter of the mean, the
    rest is added to the variance of every sample of that joint; without a rest this is the paper's estimator.

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
        rows, torque, valid = observations.rows, observations.torque, observations.valid
        count = np.maximum(valid.sum(axis=0) - rows.shape[-1] / rows.shape[1], 1.0)
        noise = (variance * valid).sum(axis=0) / np.maximum(valid.sum(axis=0), 1)
        rest = np.zeros(rows.shape[1])
        for _ in range(ROUNDS):
            weights = valid / (variance + rest)
            solution = solve_weighted(rows, torque, weights)
            residual = torque - rows @ solution.values
            excess = (residual**2 * valid).sum(axis=0) / count - noise
            before, rest = rest, np.where(excess > LEAST_REST * noise, excess, 0.0)
            if np.allclose(rest, before, rtol=1e-3):
                break
        notes = tuple(
            f"{name}: {r**0.5:.3g} of the residual is beyond the scatter between periods and adds to the weighting"
            for name, r in zip(observations.robot.joint_names, rest, strict=True)
            if r > 0.0 and processed.periods > 1
        )
        return Estimate(
            values=solution.values,
            instruments=rows * weights[:, :, None],
            inverse=solution.inverse,
            weights=weights,
            covariance=solution.inverse,
            log_det_weighted=solution.log_det,
            notes=notes,
            warnings=warnings,
        )
