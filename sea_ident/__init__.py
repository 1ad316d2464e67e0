"""Dynamic-model identification for robots with series-elastic joints."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

# Names are imported when first used, so that `sea-ident --help` answers at once.
_HOME = {
    "Excitation": "excitation",
    "design_excitation": "excitation",
    "read_excitation": "excitation",
    "load_robot": "robot",
    "Robot": "robot",
    "Motion": "motion",
    "FourierSeries": "motion",
    "build_regressor": "regressor",
    "find_base_parameters": "base_parameters",
    "simulate": "simulation",
    "Simulation": "simulation",
    "ProcessedRecording": "processing",
    "process": "processing",
    "ClockAlignment": "recordings",
    "ColumnSource": "recordings",
    "Recording": "recordings",
    "read_recording": "recordings",
    "write_recording": "recordings",
    "Model": "estimation",
    "identify": "estimation",
    "identify_springs": "estimation",
    "read_model": "estimation",
    "Validation": "validation",
    "validate": "validation",
    "identify_batch": "batch",
    "run_demo": "demo",
    "write_report": "report",
    "Diagnosis": "discrepancy",
    "close_gap": "discrepancy",
    "diagnose": "discrepancy",
    "read_diagnosis": "discrepancy",
    "export_mjcf": "export",
    "export_urdf": "export",
    "SeaIdentError": "exceptions",
    "SeaIdentWarning": "exceptions",
}

__all__ = [
    "ClockAlignment",
    "ColumnSource",
    "Diagnosis",
    "Excitation",
    "FourierSeries",
    "Model",
    "Motion",
    "ProcessedRecording",
    "Recording",
    "Robot",
    "SeaIdentError",
    "SeaIdentWarning",
    "Simulation",
    "Validation",
    "build_regressor",
    "close_gap",
    "design_excitation",
    "diagnose",
    "export_mjcf",
    "export_urdf",
    "find_base_parameters",
    "identify",
    "identify_batch",
    "identify_springs",
    "load_robot",
    "process",
    "read_diagnosis",
    "read_excitation",
    "read_model",
    "read_recording",
    "run_demo",
    "simulate",
    "validate",
    "write_recording",
    "write_report",
]

if TYPE_CHECKING:
    from sea_ident.base_parameters import find_base_parameters
    from sea_ident.batch import identify_batch
    from sea_ident.demo import run_demo
    from sea_ident.discrepancy import Diagnosis, close_gap, diagnose, read_diagnosis
    from sea_ident.estimation import Model, identify, identify_springs, read_model
    from sea_ident.exceptions import SeaIdentError, SeaIdentWarning
    from sea_ident.excitation import Excitation, design_excitation, read_excitation
    from sea_ident.export import export_mjcf, export_urdf
    from sea_ident.motion import FourierSeries, Motion
    from sea_ident.processing import ProcessedRecording, process
    from sea_ident.recordings import ClockAlignment, ColumnSource, Recording, read_recording, write_recording
    from sea_ident.regressor import build_regressor
    from sea_ident.report import write_report
    from sea_ident.robot import Robot, load_robot
    from sea_ident.simulation import Simulation, simulate
    from sea_ident.validation import Validation, validate


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
