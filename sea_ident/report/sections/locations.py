"""Where model and data disagree, as a map."""

from typing import Any, ClassVar

import numpy as np

from sea_ident.discrepancy.result.diagnosis import Diagnosis, units_by_joint
from sea_ident.report.matrix import matrix
from sea_ident.report.section import DiagnosisSection

SATURATED = 50.0
"""z-score that is drawn in full colour."""


class Locations(DiagnosisSection):
    """z-scores by joint and equation over parts of the motion, and the strongest in a table."""

    key: ClassVar[str] = "locations"
    title: ClassVar[str] = "Where model and data disagree"
    needs: ClassVar[str] = "a disagreement beyond the noise"

    def of_diagnosis(self, diagnosis: Diagnosis) -> dict[str, Any] | None:
        """The map and the table."""
        found = diagnosis.locations
        if not found:
            return None
        rows = sorted({(x.joint, x.equation) for x in found}, key=lambda pair: _joint_order(diagnosis, pair))
        regimes = list(dict.fromkeys(x.regime for x in sorted(found, key=lambda x: _regime_order(x.regime))))
        units = units_by_joint(diagnosis.units, (x.joint for x in found))
        values = np.full((len(rows), len(regimes)), np.nan)
        tips = [[""] * len(regimes) for _ in rows]
        for x in found:
            i, j = rows.index((x.joint, x.equation)), regimes.index(x.regime)
            # a logarithm, so that the weaker ones do not vanish beside the strongest
            values[i, j] = -np.log1p(x.z) / np.log1p(max(SATURATED, found[0].z))
            tips[i][j] = (
                f"{x.joint}, {x.equation} equation\n{x.regime}\n{x.excess_rms:.3g} "
                f"{units[x.joint]} beyond noise, z = {x.z:.3g}"
            )
        names = [f"{joint}, {equation}" for joint, equation in rows]
        return {
            "map": matrix(values, names, regimes, tips, "Excess of the residual by joint and part of the motion"),
            "strongest": found[:8],
            "units": units,
        }


def _joint_order(diagnosis: Diagnosis, pair: tuple[str, str]) -> tuple[int, str]:
    joints = list(diagnosis.lack_of_fit.per_joint)
    return (joints.index(pair[0]) if pair[0] in joints else len(joints), pair[1])


def _regime_order(regime: str) -> tuple[int, str]:
    kinds = ("all", "reversal", "slow", "fast", "forwards", "backwards", "load", "position", "deflection", "time")
    return (next((k for k, kind in enumerate(kinds) if kind in regime), len(kinds)), regime)
