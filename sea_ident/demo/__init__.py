"""The paper's whole experiment on the exoskeleton leg: excite, simulate, identify, validate, report."""

from sea_ident.demo.gait import gait
from sea_ident.demo.run import STEPS, Demo, run_demo
from sea_ident.demo.tables import ParameterRow, PerformanceRow

__all__ = ["STEPS", "Demo", "ParameterRow", "PerformanceRow", "gait", "run_demo"]
