"""The effects that are missing, each with its curve over the residual that it explains."""

from typing import Any, ClassVar

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.diagnosis import Diagnosis, MissingEffect, Waveforms
from sea_ident.report.chart import Chart, Line, Points
from sea_ident.report.section import DiagnosisSection

BINS = 24
DOTS = 700


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
            chart = None if diagnosis.waveforms is None else curve(effect, diagnosis.waveforms)
            where = f" at the {effect.joint}" if effect.joint else ""
            blocks.append(
                {
                    "name": effect.effect.replace("_", " ") + where,
                    "effect": effect,
                    "chart": None if chart is None else {"svg": chart.svg(), "legend": chart.legend()},
                }
            )
        return {"blocks": blocks}


def curve(effect: MissingEffect, waves: Waveforms) -> Chart | None:
    """What the effect explains, over the quantity that it depends on most clearly.

    The dots are the residual of the final model plus the effect: what is left for this effect to explain once the
    others have explained theirs.
    """
    explained = _explained(effect, waves)
    if explained is None:
        return None
    e = int(np.argmax((explained**2).sum(axis=0)))
    torque = explained[:, e]
    if not np.any(torque):
        return None
    axis, label = _abscissa(effect, waves, e, torque)
    left = waves.after[:, e] + torque
    step = max(1, len(torque) // DOTS)
    order = np.argsort(axis, kind="stable")
    ties_in_time = label.startswith("time")
    line = Line(axis[order], torque[order], "after", "the effect") if ties_in_time else _binned(axis, torque)
    return Chart(
        [Points(axis[::step], left[::step], "before", "residual left to it"), line],
        label, f"torque [N m], {waves.equations[e]}", width=620, height=240,
    )  # fmt: skip


def _explained(effect: MissingEffect, waves: Waveforms) -> FloatArray | None:
    names = [name for name in waves.explained if effect.effect in name]
    if len(names) > 1:
        names = [name for name in names if effect.joint is None or effect.joint in name] or names
    return waves.explained[names[0]] if names else None


def _abscissa(effect: MissingEffect, waves: Waveforms, equation: int, torque: FloatArray) -> tuple[FloatArray, str]:
    """Of velocity, position and deflection of its joint and of time, the one whose bins explain the torque best."""
    joints = list(dict.fromkeys(name.rpartition(" ")[0] for name in waves.equations))
    joint = effect.joint if effect.joint in joints else waves.equations[equation].rpartition(" ")[0]
    i = min(joints.index(joint), waves.q.shape[1] - 1)
    candidates = [
        (waves.dtheta[:, i], f"motor velocity of the {joint} [rad/s]"),
        (waves.deflection[:, i], f"deflection of the {joint} [rad]"),
        (waves.q[:, i], f"position of the {joint} [rad]"),
    ]
    scores = [_share_by_bins(x, torque) for x, _ in candidates]
    best = int(np.argmax(scores))
    return candidates[best] if scores[best] > 0.5 else (waves.time - waves.time[0], "time [s]")


def _share_by_bins(x: FloatArray, values: FloatArray) -> float:
    """Share of the variance of values (N,) that their means over bins of x (N,) explain."""
    if np.ptp(x) == 0.0 or np.var(values) == 0.0:
        return 0.0
    place = np.clip(((x - x.min()) / np.ptp(x) * BINS).astype(int), 0, BINS - 1)
    count = np.maximum(np.bincount(place, minlength=BINS), 1)
    mean = np.bincount(place, values, minlength=BINS) / count
    return float(1.0 - np.mean((values - mean[place]) ** 2) / np.var(values))


def _binned(x: FloatArray, values: FloatArray) -> Line:
    edges = np.linspace(x.min(), x.max(), 4 * BINS + 1)
    place = np.clip(np.digitize(x, edges) - 1, 0, 4 * BINS - 1)
    count = np.bincount(place, minlength=4 * BINS)
    filled = count > 0
    mean = np.bincount(place, values, minlength=4 * BINS)[filled] / count[filled]
    centre = ((edges[:-1] + edges[1:]) / 2.0)[filled]
    return Line(centre, mean, "after", "the effect")
