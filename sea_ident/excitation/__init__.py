"""Exciting trajectories: the motion that tells most about the parameters, inside every limit at every instant."""

from sea_ident.excitation.criteria import AOptimality, ConditionNumber, Criterion, DOptimality, EOptimality
from sea_ident.excitation.design import design_excitation, reduced_effects
from sea_ident.excitation.result import Excitation, read_excitation
from sea_ident.excitation.starts import Progress

__all__ = [
    "AOptimality",
    "ConditionNumber",
    "Criterion",
    "DOptimality",
    "EOptimality",
    "Excitation",
    "Progress",
    "design_excitation",
    "read_excitation",
    "reduced_effects",
]
