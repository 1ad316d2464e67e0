"""Spring curves with their confidence."""

from typing import Any, ClassVar

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.estimation import Model, SpringResult, Verdict
from sea_ident.estimation.uncertainty import student_factor
from sea_ident.report.chart import Band, Chart, Line, Mark, Points
from sea_ident.report.content import Content
from sea_ident.report.section import ModelSection

POINTS = 121
LEVEL = 0.95
GOOD = (Verdict.LINEAR, Verdict.STIFFENING)


class Springs(ModelSection):
    """Per elastic joint the torque over the deflection, with the 95 % band of the curve."""

    key: ClassVar[str] = "springs"
    title: ClassVar[str] = "Springs"
    needs: ClassVar[str] = "an elastic joint"

    def of_model(self, model: Model, content: Content) -> dict[str, Any] | None:
        """A chart per spring and a table of all."""
        if not model.springs:
            return None
        charts: list[Chart] = []
        linked: list[Chart] = []
        rows = []
        for k, spring in enumerate(model.springs):
            i = model.robot.index(spring.joint)
            joint, actuator = model.robot.joints[i], model.robot.spring(spring.joint)
            d = model.excerpt.motion.deflection[:, i] - spring.zero
            x = np.linspace(min(d.min(), 0.0), max(d.max(), 0.0), POINTS) if len(d) else _symmetric(spring)
            curve, half = spring_curve(spring, x)
            marks: list[Mark] = []
            beyond: list[Mark] = []
            if model.excerpt.tau_spring.shape[1] == len(model.springs):
                static = model.excerpt.tau_spring[:, k] - spring.damping * model.excerpt.motion.deflection_rate[:, i]
                marks.append(Points(d, static, "measured", "torque without damping"))
                beyond.append(Points(d, static - spring.stiffness * d, "measured", "torque without damping"))
            linear = spring.stiffness * x
            for chosen, shift in ((marks, 0.0 * x), (beyond, linear)):
                chosen.append(Band(x, curve - half - shift, curve + half - shift, f"j{k % 7}", "95 % of the curve"))
                chosen.append(Line(x, curve - shift, f"j{k % 7}", "identified"))
                if actuator.stiffness is not None:
                    stated = actuator.stiffness * x + (actuator.cubic_stiffness or 0.0) * x**3 - shift
                    chosen.append(Line(x, stated, "reference", "robot description"))
            axis, torque = f"deflection [{joint.position_unit}]", joint.torque_unit
            charts.append(Chart(marks, axis, f"spring torque [{torque}]", spring.joint, width=330, height=220))
            linked.append(Chart(beyond, axis, f"less K\N{SUBSCRIPT ONE} d [{torque}]", width=330, height=200))
            wide = spring.half_width(LEVEL)
            units = [f"{joint.torque_unit}/{joint.position_unit}{p}" for p in ("", "\N{SUPERSCRIPT THREE}")]
            units.append(f"{joint.torque_unit} s/{joint.position_unit}")
            rows.append(
                {
                    "joint": spring.joint,
                    "verdict": str(spring.verdict).replace("_", " "),
                    "level": "good" if spring.verdict in GOOD else "warn",
                    "note": spring.note,
                    "values": [
                        ("K\N{SUBSCRIPT ONE}", actuator.stiffness, spring.stiffness, wide[0], units[0]),
                        ("K\N{SUBSCRIPT THREE}", actuator.cubic_stiffness, spring.cubic_stiffness, wide[1], units[1]),
                        ("D", actuator.damping, spring.damping, wide[2], units[2]),
                    ],
                }
            )
        return {
            "charts": [(chart.svg(), beside.svg()) for chart, beside in zip(charts, linked, strict=True)],
            "legend": charts[0].legend(),
            "rows": rows,
        }


def _symmetric(spring: SpringResult) -> FloatArray:
    return np.linspace(-spring.largest_deflection, spring.largest_deflection, POINTS)


def spring_curve(spring: SpringResult, deflection: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Static torque (N,) of the full law over the deflection (N,), and the half width of its 95 % band [N m]."""
    curve = spring.stiffness * deflection + spring.cubic_stiffness * deflection**3
    slope = np.stack([deflection, deflection**3, np.zeros_like(deflection)], axis=1)
    variance = np.einsum("ni,ij,nj->n", slope, np.asarray(spring.covariance), slope)
    half = student_factor(spring.degrees_of_freedom, LEVEL) * np.sqrt(np.maximum(variance, 0.0))
    return curve, half
