"""What the report says, in words."""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from sea_ident.estimation import Model, Verdict
from sea_ident.report.content import Content
from sea_ident.report.section import ModelSection
from sea_ident.report.sections.parameters import POOR_PERCENT, parameter_rows

NAMED = 8
"""Parameters that one sentence names."""

NEAR_NOISE = 1.5
"""A residual within this many times its noise is called explained."""


@dataclass(frozen=True)
class Finding:
    """A sentence with how much it should worry: good, warn, bad or empty for neither."""

    level: str
    head: str
    text: str


class Findings(ModelSection):
    """Sentences that a person can act on, and the figures in large."""

    key: ClassVar[str] = "findings"
    title: ClassVar[str] = "Findings"
    needs: ClassVar[str] = "a model"

    def of_model(self, model: Model, content: Content) -> dict[str, Any] | None:
        """Fit, parameters, springs and warnings."""
        fit = model.fit
        findings = [*_fit(model), *_parameters(model), *_springs(model), *_validations(content)]
        findings.extend(Finding("warn", "Warning", text) for text in model.warnings)
        share = fit.rms_residual / np.maximum(fit.rms_torque, 1e-300)
        tiles = [
            (f"{100 * float(share.max()):.2g} %", "largest residual, as a share of the torque"),
            (str(model.base.rank), "base parameters"),
            (f"{fit.condition_number:.3g}", "condition number of F"),
            (f"{fit.log_det:.1f}", "log det F\N{PRIME}F"),
            (f"{fit.periods} \N{MULTIPLICATION SIGN} {fit.samples}", "periods and samples of each"),
        ]
        return {"findings": findings, "tiles": tiles}


def _fit(model: Model) -> list[Finding]:
    fit = model.fit
    found = []
    for i, joint in enumerate(model.robot.joints):
        rms, noise, torque = float(fit.rms_residual[i]), float(fit.noise_std[i]), float(fit.rms_torque[i])
        share = 100.0 * rms / max(torque, 1e-300)
        text = f"the model leaves {rms:.3g} of {torque:.3g} {joint.torque_unit} rms ({share:.2g} %)"
        if fit.periods < 2 or noise <= 0.0:
            found.append(Finding("", joint.name, f"{text}; with one period its noise is not known."))
        elif rms <= NEAR_NOISE * noise:
            found.append(Finding("good", joint.name, f"{text}; noise alone is {noise:.3g}: nothing left to explain."))
        else:
            beyond = float(np.sqrt(max(rms**2 - noise**2, 0.0)))
            found.append(
                Finding(
                    "warn",
                    joint.name,
                    f"{text}; noise alone is {noise:.3g}, so {beyond:.3g} {joint.torque_unit} is not explained.",
                )
            )
    return found


def _parameters(model: Model) -> list[Finding]:
    rows = parameter_rows(model)
    poor = [row for row in rows if row.poor]
    off = [row for row in rows if row.off]
    known = [row for row in rows if row.stated is not None]
    found = []
    if poor:
        worst = sorted(poor, key=lambda row: -row.relative)
        names = ", ".join(f"{row.name} ({row.relative:.0f} %)" for row in worst[:NAMED])
        if len(worst) > NAMED:
            names += f" and {len(worst) - NAMED} more"
        found.append(
            Finding(
                "warn",
                "Poorly determined",
                f"{len(poor)} of {len(rows)} parameters have a standard deviation above {POOR_PERCENT:.0f} %: {names}. "
                "Do not use them one by one.",
            )
        )
    else:
        found.append(
            Finding("good", "Parameters", f"all {len(rows)} are known to better than {POOR_PERCENT:.0f} % (one std).")
        )
    if known and off:
        furthest = sorted(off, key=lambda row: -abs(row.value - (row.stated or 0.0)) / max(row.std, 1e-300))[:4]
        names = ", ".join(f"{row.name} ({row.value:.4g} instead of {row.stated:.4g} {row.unit})" for row in furthest)
        found.append(
            Finding(
                "",
                "Against the description",
                f"{len(off)} of {len(known)} stated values lie outside the 95 % intervals, most of all {names}.",
            )
        )
    elif known:
        found.append(
            Finding("good", "Against the description", f"all {len(known)} stated values lie in their 95 % intervals.")
        )
    return found


def _springs(model: Model) -> list[Finding]:
    levels = {Verdict.LINEAR: "good", Verdict.STIFFENING: "good"}
    return [
        Finding(
            levels.get(spring.verdict, "warn"),
            f"{spring.joint} spring",
            f"{str(spring.verdict).replace('_', ' ')}: {spring.note}.",
        )
        for spring in model.springs
    ]


def _validations(content: Content) -> list[Finding]:
    found = []
    for validation in content.validations:
        worst = int(np.argmax(validation.nrms))
        found.append(
            Finding(
                "",
                "Prediction",
                f"{validation.recording}, which was not used: at worst {100 * validation.nrms[worst]:.2g} % of the "
                f"torque, at the {validation.joint_names[worst]}.",
            )
        )
    return found
