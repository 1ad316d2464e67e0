"""Where model and data disagree, which effect is missing, and the model with it added."""

from sea_ident.discrepancy.diagnose import diagnose
from sea_ident.discrepancy.diagnosis import (
    Alternative,
    Detectability,
    Diagnosis,
    Gap,
    LackOfFit,
    Location,
    MissingEffect,
    MissingParameter,
    NextExperiment,
    Verdict,
    Waveforms,
    read_diagnosis,
)

__all__ = [
    "Alternative",
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
    "diagnose",
    "read_diagnosis",
]
