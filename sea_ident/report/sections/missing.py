"""The effects that are missing, each with its curve over the residual that it explains."""

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.result.diagnosis import Diagnosis, torque_unit, units_by_joint
from sea_ident.discrepancy.result.findings import MissingEffect, Waveforms
from sea_ident.report.chart import Band, Chart, Line, Mark, Points
from sea_ident.report.section import DiagnosisSection

NEIGHBOURS = 5
"""Samples that make up a point of a curve."""

DOTS = 700

FUNCTION = 0.9
"""Share of an effect that a quantity explains from which on the effect is drawn over it."""


class Missing(DiagnosisSection):
    """Per effect its parameters, its share, its curve and what it could be taken for."""

    key: ClassVar[str] = "missing"
    title: ClassVar[str] = "What is missing"
    needs: ClassVar[str] = "an effect that was found missing"

    def of_diagnosis(self, diagnosis: Diagnosis) -> dict[str, Any] | None:
        """One block per effect."""
        if not diagnosis.missing:
            return None
        blocks = []
        for effect in diagnosis.missing:
            chart = None if diagnosis.waveforms is None else curve(effect, diagnosis.waveforms, diagnosis.units)
            name, _, joint = effect.title.partition(" at ")
            blocks.append(
                {
                    "name": name.replace("_", " ") + (f" at the {joint}" if joint else ""),
                    "effect": effect,
                    "chart": None if chart is None else {"svg": chart.svg(), "legend": chart.legend()},
                }
            )
        return {"blocks": blocks}


def curve(effect: MissingEffect, waves: Waveforms, units: Mapping[str, str]) -> Chart | None:
    """What the effect explains, over the quantity that it depends on most clearly.

    The dots are the residual of the final model plus the effect: what is left for this effect to explain once the
    others have explained theirs.

    Args:
        effect: the effect.
        waves: of the diagnosis.
        units: unit of the torque of each joint.

    Returns:
        The chart, None where the effect explains nothing.
    """
    explained = waves.explained.get(effect.title)
    if explained is None:
        return None
    e = int(np.argmax((explained**2).sum(axis=0)))
    torque = explained[:, e]
    if not np.any(torque):
        return None
    axis, label = _abscissa(effect, waves, e, torque, units)
    unit = units.get(waves.equations[e].rpartition(" ")[0], torque_unit({}))
    torque_label = f"torque [{unit}], {waves.equations[e]}"
    if unit == "N":
        torque_label = f"force [N], {waves.equations[e]}"
    left = waves.after[:, e] + torque
    step = max(1, len(torque) // DOTS)
    order = np.argsort(axis, kind="stable")
    over_time = label.startswith("time")
    marks: list[Mark] = [Points(axis[::step], left[::step], "before", "residual left to it")]
    line = Line(axis[order], torque[order], "after", "the effect") if over_time else _smoothed(axis, torque)
    if effect.title in waves.bands:
        std = waves.bands[effect.title][:, e]
        half = 2.0 * (std[order] if over_time else _smoothed(axis, std).y)
        marks.append(Band(line.x, line.y - half, line.y + half, "after", "\N{PLUS-MINUS SIGN}2 std of the effect"))
    return Chart(
        [*marks, line],
        label, torque_label, width=900, height=260,
    )  # fmt: skip


def _abscissa(
    effect: MissingEffect, waves: Waveforms, equation: int, torque: FloatArray, units: Mapping[str, str]
) -> tuple[FloatArray, str]:
    """Of velocity, positions and deflection of its joint the one that the torque is a function of, else time.

    Over what it depends on in part only, a line would jump from sample to sample.
    """
    joints = list(dict.fromkeys(name.rpartition(" ")[0] for name in waves.equations))
    joint = effect.joint if effect.joint in joints else waves.equations[equation].rpartition(" ")[0]
    i = min(joints.index(joint), waves.q.shape[1] - 1)
    unit = units_by_joint(units, [joint], positions=True)[joint]
    speed = " or ".join(f"{part}/s" for part in unit.split(" or "))
    candidates = [
        (waves.dtheta[:, i], f"motor velocity of the {joint} [{speed}]"),
        (waves.deflection[:, i], f"deflection of the {joint} [{unit}]"),
        (waves.q[:, i], f"position of the {joint} [{unit}]"),
        (waves.q[:, i] + waves.deflection[:, i], f"motor position of the {joint} [{unit}]"),
    ]
    scores = [_share_explained(x, torque) for x, _ in candidates]
    best = int(np.argmax(scores))
    return candidates[best] if scores[best] > FUNCTION else (waves.time - waves.time[0], "time [s]")


def _share_explained(x: FloatArray, values: FloatArray) -> float:
    """How far values (N,) are a function of x (N,): 1 less the jumps between neighbours in x over their variance."""
    if np.ptp(x) == 0.0 or np.var(values) == 0.0:
        return 0.0
    jumps = np.diff(values[np.argsort(x, kind="stable")])
    return float(1.0 - np.mean(jumps**2) / (2.0 * np.var(values)))


def _smoothed(x: FloatArray, values: FloatArray) -> Line:
    """Means of groups of neighbours in x: as fine as there are samples, however steep the curve."""
    order = np.argsort(x, kind="stable")
    groups = np.array_split(order, max(1, len(x) // NEIGHBOURS))
    centre = np.array([x[group].mean() for group in groups])
    return Line(centre, np.array([values[group].mean() for group in groups]), "after", "the effect")
