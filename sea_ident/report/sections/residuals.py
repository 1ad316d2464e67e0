"""The residual against what it could depend on."""

from typing import Any, ClassVar

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.estimation import Model
from sea_ident.report.chart import Band, Chart, Line, Points, Rule
from sea_ident.report.content import Content
from sea_ident.report.section import ModelSection

BINS = 24
FEWEST_IN_BIN = 5
DOTS = 700


class Residuals(ModelSection):
    """Per joint the residual over velocity, position, load and time: dots, and the mean of each bin."""

    key: ClassVar[str] = "residuals"
    title: ClassVar[str] = "Residual against velocity, position, load and time"
    needs: ClassVar[str] = "the data behind the model"

    def of_model(self, model: Model, content: Content) -> dict[str, Any] | None:
        """Four charts per joint."""
        excerpt = model.excerpt
        if not len(excerpt.motion):
            return None
        motion, predicted = excerpt.motion, excerpt.tau_model
        rows = []
        for i, joint in enumerate(model.robot.joints):
            residual = excerpt.tau_motor[:, i] - predicted[:, i]
            position, torque = joint.position_unit, joint.torque_unit
            against = (
                (motion.dtheta[:, i], f"motor velocity [{position}/s]"),
                (motion.theta[:, i], f"motor position [{position}]"),
                (predicted[:, i], f"load: torque of the model [{torque}]"),
                (motion.time - motion.time[0], "time [s]"),
            )
            charts = [binned(x, residual, label, f"residual [{torque}]") for x, label in against]
            rows.append({"joint": joint.name, "charts": [chart.svg() for chart in charts]})
        return {"rows": rows, "legend": charts[0].legend()}


def binned(x: FloatArray, residual: FloatArray, x_label: str, y_label: str) -> Chart:
    """Residual (N,) over x (N,): dots, and mean with the spread in bins of equal width."""
    edges = np.linspace(x.min(), x.max() + 1e-12, BINS + 1)
    place = np.clip(np.digitize(x, edges) - 1, 0, BINS - 1)
    count = np.bincount(place, minlength=BINS)
    filled = count >= FEWEST_IN_BIN
    total = np.bincount(place, residual, minlength=BINS)
    square = np.bincount(place, residual**2, minlength=BINS)
    safe = np.maximum(count, 1)
    mean = total / safe
    # neighbouring samples are alike, so this is the spread within the bin, not the error of its mean
    spread = np.sqrt(np.maximum(square / safe - mean**2, 0.0))
    centre = (edges[:-1] + edges[1:]) / 2.0
    step = max(1, len(x) // DOTS)
    return Chart(
        [
            Rule(0.0, "reference"),
            Points(x[::step], residual[::step], "residual", "sample"),
            Band(centre[filled], (mean - spread)[filled], (mean + spread)[filled], "predicted", "spread in the bin"),
            Line(centre[filled], mean[filled], "predicted", "mean of the bin"),
        ],
        x_label, y_label, width=450, height=190,
    )  # fmt: skip
