"""Weighted least squares with one variance per joint."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from sea_ident.estimation.estimators.base import Estimate, Estimator
from sea_ident.estimation.observations import Observations
from sea_ident.estimation.solve import solve_weighted


@dataclass(frozen=True)
class JointWLS(Estimator):
    """The classical weighting: the variance of every joint from the residual of a first, unweighted fit.

    References:
        Gautier, Dynamic identification of robots with power model, ICRA 1997.
    """

    name: ClassVar[str] = "joint_wls"

    def estimate(self, observations: Observations) -> Estimate:
        """Estimate; see `Estimator.estimate`."""
        rows, torque = observations.rows, observations.torque
        n, count = rows.shape[1:]
        valid = observations.valid.astype(float)
        weights = valid
        for _ in range(2):
            solution = solve_weighted(rows, torque, weights)
            residual = (torque - rows @ solution.values) * valid
            variance = (residual**2).sum(axis=0) / np.maximum(valid.sum(axis=0) - count / n, 1.0)
            positive = variance[variance > 0.0]
            variance = np.maximum(variance, 1e-12 * positive.max() if positive.size else 1.0)
            weights = valid / variance
        solution = solve_weighted(rows, torque, weights)
        return Estimate(
            values=solution.values,
            instruments=rows * weights[:, :, None],
            inverse=solution.inverse,
            weights=weights,
            covariance=solution.inverse,
            log_det_weighted=solution.log_det,
        )
