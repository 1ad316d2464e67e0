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
    "SeaIdentError": "exceptions",
    "SeaIdentWarning": "exceptions",
}

__all__ = [
    "Excitation",
    "FourierSeries",
    "Motion",
    "Robot",
    "SeaIdentError",
    "SeaIdentWarning",
    "Simulation",
    "build_regressor",
    "design_excitation",
    "find_base_parameters",
    "load_robot",
    "read_excitation",
    "simulate",
]

if TYPE_CHECKING:
    from sea_ident.base_parameters import find_base_parameters
    from sea_ident.exceptions import SeaIdentError, SeaIdentWarning
    from sea_ident.excitation import Excitation, design_excitation, read_excitation
    from sea_ident.motion import FourierSeries, Motion
    from sea_ident.regressor import build_regressor
    from sea_ident.robot import Robot, load_robot
    from sea_ident.simulation import Simulation, simulate


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
