"""Exciting trajectories: the motion that tells most about the parameters, inside every limit at every instant."""

from sea_ident.excitation.board import Progress
from sea_ident.excitation.criteria import (
    AOptimality,
    ConditionNumber,
    Criterion,
    Discrimination,
    DOptimality,
    EOptimality,
    Scaling,
)
from sea_ident.excitation.design import design_excitation
from sea_ident.excitation.design_model import reduced_effects
from sea_ident.excitation.efficiency import EfficiencyBound, bound_log_det
from sea_ident.excitation.joint_trajectory import write_trajectory_bag, write_trajectory_yaml
from sea_ident.excitation.links_inside import LinksAsPlanned, LinksInside
from sea_ident.excitation.ramp import Ramp, RampMotion
from sea_ident.excitation.result import Excitation, read_excitation
from sea_ident.excitation.springs import PredictedMotors
from sea_ident.excitation.trajectory import sample_trajectory, write_trajectory_csv

__all__ = [
    "AOptimality",
    "ConditionNumber",
    "Criterion",
    "DOptimality",
    "Discrimination",
    "EOptimality",
    "EfficiencyBound",
    "Excitation",
    "LinksAsPlanned",
    "LinksInside",
    "PredictedMotors",
    "Progress",
    "Ramp",
    "RampMotion",
    "Scaling",
    "bound_log_det",
    "design_excitation",
    "read_excitation",
    "reduced_effects",
    "sample_trajectory",
    "write_trajectory_bag",
    "write_trajectory_csv",
    "write_trajectory_yaml",
]
