"""Where model and data disagree, which effect is missing, and the model with it added."""

from sea_ident.discrepancy.close import ClosedGap, close_gap
from sea_ident.discrepancy.diagnose import diagnose
from sea_ident.discrepancy.diagnosis import Diagnosis, read_diagnosis
from sea_ident.discrepancy.findings import (
    Alternative,
    Detectability,
    LackOfFit,
    Location,
    MissingEffect,
    MissingParameter,
    NextExperiment,
    Verdict,
    Waveforms,
)
from sea_ident.discrepancy.gap import Gap

__all__ = [
    "Alternative",
    "ClosedGap",
    "Detectability",
    "Diagnosis",
    "Gap",
    "LackOfFit",
    "Location",
    "MissingEffect",
    "MissingParameter",
    "NextExperiment",
    "Verdict",
    "Waveforms",
    "close_gap",
    "diagnose",
    "read_diagnosis",
]
