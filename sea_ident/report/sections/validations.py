"""Prediction of recordings that were not used in the fit."""

from typing import Any, ClassVar

import numpy as np

from sea_ident.estimation import Model
from sea_ident.report.chart import Chart, Line
from sea_ident.report.content import Content
from sea_ident.report.section import ModelSection


class Validations(ModelSection):
    """Measured and predicted torque of other motions."""

    key: ClassVar[str] = "validations"
    title: ClassVar[str] = "Motions that were not used in the fit"
    needs: ClassVar[str] = "a recording to predict"

    def of_model(self, model: Model, content: Content) -> dict[str, Any] | None:
        """One chart per joint and recording, with the numbers."""
        if not content.validations:
            return None
        joints = model.robot.joints
        groups = []
        for number, validation in enumerate(content.validations):
            time = validation.processed.motion.time - validation.processed.motion.time[0]
            figures, rows, away = [], [], validation.agreement
            for i, joint in enumerate(joints):
                measured, predicted = validation.processed.tau_motor[:, i], validation.predicted[:, i]
                chart = Chart(
                    [
                        Line(time, measured, "measured", "measured"),
                        Line(time, predicted, "predicted", "predicted"),
                        Line(time, np.where(validation.used, measured - predicted, 0.0), "residual", "residual"),
                    ],
                    "time [s]", f"torque [{joint.torque_unit}]", joint.name, height=200, link=f"validation{number}",
                )  # fmt: skip
                figures.append(chart.svg())
                rows.append(
                    (
                        joint.name,
                        validation.rms[i],
                        validation.noise_std[i] if away is None else away.noise[i],
                        None if away is None else away.rms[i],
                        100 * validation.nrms[i],
                        joint.torque_unit,
                    )
                )
            springs = [(s.joint, s.rms, s.noise_std, 100 * s.nrms, s.unit) for s in validation.springs]
            groups.append(
                {
                    "name": validation.recording, "figures": figures, "rows": rows, "springs": springs,
                    "legend": chart.legend(),
                }
            )  # fmt: skip
        return {"groups": groups}
