"""The gap between model and data, before and after the repair."""

from collections.abc import Mapping
from typing import Any, ClassVar

from sea_ident.discrepancy.bench.gap import Gap
from sea_ident.discrepancy.result.diagnosis import Diagnosis, torque_unit, units_by_joint
from sea_ident.report.bars import bars, bars_legend
from sea_ident.report.chart import Band, Chart, Line
from sea_ident.report.section import DiagnosisSection

DATA = {"training": "the recording that was diagnosed", "holdout": "data that were held out"}
PERIODS_OF = {**DATA, "training": "the recording"}
IN_COURSE = "What is named changes in the course of the recording, and the mean of its periods hides it."
ROLES = ("before", "after", "noise")
POSITIONS = ("q", "theta")
NAMES = ("as it was", "with the effects", "noise")


class GapSection(DiagnosisSection):
    """Bars per joint, and the residuals over a period."""

    key: ClassVar[str] = "gap"
    title: ClassVar[str] = "The gap, before and after"
    needs: ClassVar[str] = "a diagnosis"

    def of_diagnosis(self, diagnosis: Diagnosis) -> dict[str, Any] | None:
        """Bars of every gap that was measured, and waveforms."""
        groups = []
        for label, words in DATA.items():
            held = label == "holdout"
            gap = diagnosis.holdout if held else diagnosis.training
            if gap is not None:
                units = units_by_joint(diagnosis.units, gap.before)
                shows = diagnosis.adds_to_held_out if held else diagnosis.adds_to_mean
                closed = _closed(gap, diagnosis.adds) if shows or not diagnosis.adds else IN_COURSE
                groups.append((_bars(gap, f"On {words}", units), closed))
        for label, gap in diagnosis.trend_gap.items():
            units = units_by_joint(diagnosis.units, gap.before)
            title = f"From period to period, on {PERIODS_OF[label]}"
            # the time in another recording is not that in this one
            began = "" if label == "training" else "As if it began at the same time: "
            groups.append((_bars(gap, title, units), began + _closed(gap, True)))
        for signal, gap in diagnosis.simulation_gap.items():
            units, scale = units_by_joint(diagnosis.units, gap.before, positions=signal in POSITIONS), 1.0
            if signal in POSITIONS:
                units, scale = {j: " or ".join(f"m{u}" for u in unit.split(" or ")) for j, unit in units.items()}, 1e3
            groups.append((_bars(gap, f"Forward simulation, {signal}", units, scale), _closed(gap, diagnosis.adds)))
        if not groups:
            return None
        return {
            "groups": groups,
            "legend": bars_legend(NAMES, ROLES),
            "waves": _waves(diagnosis),
        }


def _closed(gap: Gap, added: bool) -> str:
    """How much of a gap is closed, in words."""
    if not any(value > 0.0 for value in gap.before.values()):
        return f"The model was within the noise before already{', and is no longer' if gap.opens else ''}."
    if not added:
        return "No effect is named that the model lacks, so nothing was added."
    if gap.shrink < 0.0:
        return f"The gap is {-100.0 * gap.shrink:.0f} % larger."
    return f"{100.0 * gap.shrink:.0f} % of the gap is closed."


def _bars(gap: Gap, title: str, units: Mapping[str, str], scale: float = 1.0) -> Any:
    joints = list(gap.before)
    series = {
        name: [scale * part[joint] for joint in joints]
        for name, part in zip(NAMES, (gap.before, gap.after, gap.noise), strict=True)
    }
    return bars(joints, series, ROLES, title, [units[joint] for joint in joints])


def _waves(diagnosis: Diagnosis) -> list[Any]:
    waves = diagnosis.waveforms
    if waves is None:
        return []
    time = waves.time - waves.time[0]
    found = []
    for e, name in enumerate(waves.equations):
        unit = diagnosis.units.get(name.rpartition(" ")[0], torque_unit({}))
        band = 2.0 * float(waves.noise[e])
        chart = Chart(
            [
                Band(time, 0.0 * time - band, 0.0 * time + band, "reference", "\N{PLUS-MINUS SIGN}2 std of the noise"),
                Line(time, waves.before[:, e], "before", "residual as it was"),
                Line(time, waves.after[:, e], "after", "residual with the effects"),
            ],
            "time [s]", f"residual [{unit}]", f"{name} equation", height=150, link="diagnosis",
        )  # fmt: skip
        found.append({"svg": chart.svg(), "legend": chart.legend()})
    return found
