"""Motor torque: measured, predicted, and what is left."""

from typing import Any, ClassVar

import numpy as np

from sea_ident.estimation import Model
from sea_ident.report.chart import Band, Chart, Line
from sea_ident.report.content import Content
from sea_ident.report.section import ModelSection


class Torque(ModelSection):
    """Per joint the torque of the model over the measured one, and the residual against its noise."""

    key: ClassVar[str] = "torque"
    title: ClassVar[str] = "Motor torque"
    needs: ClassVar[str] = "the data behind the model"

    def of_model(self, model: Model, content: Content) -> dict[str, Any] | None:
        """Two charts per joint, their times linked."""
        excerpt = model.excerpt
        if not len(excerpt.motion):
            return None
        time = excerpt.motion.time - excerpt.motion.time[0]
        spread = excerpt.residual_std / np.sqrt(model.fit.periods)
        figures, away = [], model.fit.agreement
        for i, joint in enumerate(model.robot.joints):
            measured, predicted = excerpt.tau_motor[:, i], excerpt.tau_model[:, i]
            residual = measured - predicted
            marks = [Line(time, measured, "measured", "measured"), Line(time, predicted, "predicted", "model")]
            upper = Chart(
                marks, "time [s]", f"torque [{joint.torque_unit}]", joint.name, height=210, link="time"
            )  # fmt: skip
            noise = Band(time, -2 * spread[:, i], 2 * spread[:, i], "reference", "\N{PLUS-MINUS SIGN}2 std of the mean")
            lower = Chart(
                [noise, Line(time, residual, "residual", "residual")],
                "time [s]", f"residual [{joint.torque_unit}]", height=130, link="time",
            )  # fmt: skip
            figures.append(
                {
                    "torque": upper.svg(),
                    "residual": lower.svg(),
                    "legend": Chart([*marks, *lower.marks], "", "").legend(),
                    "rms": model.fit.rms_residual[i],
                    "noise": model.fit.noise_std[i] if away is None else away.noise[i],
                    "away": None if away is None else away.rms[i],
                    "share": 100.0 * model.fit.rms_residual[i] / max(model.fit.rms_torque[i], 1e-300),
                    "unit": joint.torque_unit,
                    "joint": joint.name,
                }
            )
        return {"figures": figures, "periods": model.fit.periods, "period": model.fit.period}
