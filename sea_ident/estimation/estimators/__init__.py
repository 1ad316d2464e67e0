"""Estimators, one per file."""

from sea_ident.estimation.estimators.base import Estimate, Estimator
from sea_ident.estimation.estimators.joint_wls import JointWLS
from sea_ident.estimation.estimators.least_squares import LeastSquares
from sea_ident.estimation.estimators.per_sample_wls import PerSampleWLS

__all__ = ["Estimate", "Estimator", "JointWLS", "LeastSquares", "PerSampleWLS"]
