"""Least squares: every equation weighs the same."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from sea_ident.estimation.estimators.base import Estimate, Estimator
from sea_ident.estimation.observations import Observations
from sea_ident.estimation.solve import solve_weighted


@dataclass(frozen=True)
class LeastSquares(Estimator):
    """Ordinary least squares; one noise variance for all joints, from the residual."""

    name: ClassVar[str] = "least_squares"

    def estimate(self, observations: Observations) -> Estimate:
        """Estimate; see `Estimator.estimate`."""
        rows, torque = observations.rows, observations.torque
        valid = observations.valid.astype(float)
        solution = solve_weighted(rows, torque, valid)
        residual = (torque - rows @ solution.values) * valid
        freedom = max(valid.sum() - len(solution.values), 1.0)
        variance = float((residual**2).sum()) / freedom
        weight = 1.0 / variance if variance > 0.0 else 1.0
        return Estimate(
            values=solution.values,
            instruments=rows * valid[:, :, None],
            inverse=solution.inverse,
            weights=valid * weight,
            covariance=solution.inverse * variance,
            log_det_weighted=solution.log_det + len(solution.values) * float(np.log(weight)),
        )
