"""The excitation and its limits."""

from typing import Any, ClassVar

import numpy as np

from sea_ident.estimation import Model
from sea_ident.report.chart import Chart, Line, Mark, Rule
from sea_ident.report.content import Content
from sea_ident.report.section import ModelSection
from sea_ident.robot import Limits

POINTS = 600


class ExcitationSection(ModelSection):
    """Position, velocity and acceleration that were asked for, in their limits."""

    key: ClassVar[str] = "excitation"
    title: ClassVar[str] = "Excitation and its limits"
    needs: ClassVar[str] = "the excitation"

    def of_model(self, model: Model, content: Content) -> dict[str, Any] | None:
        """Three charts per joint, and one per limited combination of joints."""
        excitation = content.excitation
        if excitation is None:
            return None
        series = excitation.series
        robot = model.robot
        limits: Limits = robot.limits
        time = np.linspace(0.0, series.period, POINTS)
        values = [series.evaluate(time, derivative) for derivative in range(3)]
        rows = []
        for i, joint in enumerate(robot.joints):
            unit = joint.position_unit
            bounds = (
                (limits.lower[i], limits.upper[i]),
                (-limits.velocity[i], limits.velocity[i]),
                (-limits.acceleration[i], limits.acceleration[i]),
            )
            kinds = (f"position [{unit}]", f"velocity [{unit}/s]", f"acceleration [{unit}/s\N{SUPERSCRIPT TWO}]")
            charts = []
            for k, (label, pair) in enumerate(zip(kinds, bounds, strict=True)):
                marks: list[Mark] = [Rule(float(v), "limit", "limit") for v in pair if np.isfinite(v)]
                marks.insert(0, Line(time, values[k][:, i], f"j{i % 7}", ""))
                charts.append(Chart(marks, "time [s]", label, width=320, height=170, link="excitation").svg())
            rows.append({"joint": joint.name, "charts": charts})
        combined = []
        for c, name in enumerate(limits.combination_names):
            combination = values[0] @ limits.combinations[c]
            marks = [Line(time, combination, "j3", "")]
            for value in (limits.combination_lower[c], limits.combination_upper[c]):
                if np.isfinite(value):
                    marks.append(Rule(float(value), "limit", "limit"))
            combined.append(
                Chart(marks, "time [s]", name.replace("_", " "), width=450, height=170, link="excitation").svg()
            )
        return {"rows": rows, "combined": combined, "excitation": excitation}
