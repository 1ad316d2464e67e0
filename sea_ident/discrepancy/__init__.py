"""Where model and data disagree, which effect is missing, and the model with it added.

Its parts, each of which uses those before it alone:

- `measured`: a recording as models are compared with it: its periods, their noise, and checks at the border.
- `bench`: models made of effects, fitted to one recording in its noise.
- `result`: what comes of a diagnosis: its parts, and the model with what was found.
- `search`: which effects the mean of the periods lacks.
- `trends`: what changes from period to period, which the mean does not show.
- `compared`: what was found beside other data and another model: motion that was not used, and an earlier model.
- `nameless`: what the library has no name for, and what was found under a name that is not its own.
- `evidence`: what is told beside a name: where, how sure, what else, what could not be seen, what to measure next.
- `simulated`: the gap in forward simulation, before and after.

The modules of this folder put them together: `diagnose` for one recording, `close_gap` until nothing is missing.
"""

from sea_ident.discrepancy.bench.gap import Gap
from sea_ident.discrepancy.close import ClosedGap, close_gap
from sea_ident.discrepancy.diagnose import diagnose
from sea_ident.discrepancy.result.diagnosis import Diagnosis, read_diagnosis
from sea_ident.discrepancy.result.findings import (
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
