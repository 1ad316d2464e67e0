"""Estimation: base parameters, springs, and how sure both are."""

from sea_ident.estimation.agreement import Agreement
from sea_ident.estimation.estimators import (
    Estimate,
    Estimator,
    InstrumentalVariables,
    JointWLS,
    LeastSquares,
    MaximumLikelihood,
    PerSampleWLS,
    Robust,
)
from sea_ident.estimation.identify import identify
from sea_ident.estimation.knowledge import Knowledge, information_about, what_is_known
from sea_ident.estimation.long_recording import identify_stream
from sea_ident.estimation.measured_springs import identify_measured_springs
from sea_ident.estimation.model import Excerpt, Fit, Model, Parameter
from sea_ident.estimation.model_file import model_from_dict, read_model
from sea_ident.estimation.observations import Observations
from sea_ident.estimation.one_shot import identify_one_shot
from sea_ident.estimation.physical import physical_parameters
from sea_ident.estimation.physical_result import Box, PhysicalParameters, Pull
from sea_ident.estimation.spring_result import SpringResult, SpringTerm, Verdict
from sea_ident.estimation.springs import identify_springs
from sea_ident.estimation.trend_term import TrendTerm
from sea_ident.estimation.uncertainty import CovarianceKind, Uncertainty
from sea_ident.estimation.update import updated
from sea_ident.estimation.update_result import Change, Update

__all__ = [
    "Agreement",
    "Box",
    "Change",
    "CovarianceKind",
    "Estimate",
    "Estimator",
    "Excerpt",
    "Fit",
    "InstrumentalVariables",
    "JointWLS",
    "Knowledge",
    "LeastSquares",
    "MaximumLikelihood",
    "Model",
    "Observations",
    "Parameter",
    "PerSampleWLS",
    "PhysicalParameters",
    "Pull",
    "Robust",
    "SpringResult",
    "SpringTerm",
    "TrendTerm",
    "Uncertainty",
    "Update",
    "Verdict",
    "identify",
    "identify_measured_springs",
    "identify_one_shot",
    "identify_springs",
    "identify_stream",
    "information_about",
    "model_from_dict",
    "physical_parameters",
    "read_model",
    "updated",
    "what_is_known",
]
