"""Estimators, one per file."""

from sea_ident.estimation.estimators.base import Estimate, Estimator
from sea_ident.estimation.estimators.instrumental_variables import InstrumentalVariables
from sea_ident.estimation.estimators.joint_wls import JointWLS
from sea_ident.estimation.estimators.least_squares import LeastSquares
from sea_ident.estimation.estimators.maximum_likelihood import MaximumLikelihood
from sea_ident.estimation.estimators.per_sample_wls import PerSampleWLS
from sea_ident.estimation.estimators.robust import Robust

__all__ = [
    "Estimate",
    "Estimator",
    "InstrumentalVariables",
    "JointWLS",
    "LeastSquares",
    "MaximumLikelihood",
    "PerSampleWLS",
    "Robust",
]
