"""What the report says, in words."""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from sea_ident.estimation import Model, Verdict
from sea_ident.plain import plain
from sea_ident.report.content import Content
from sea_ident.report.section import ModelSection
from sea_ident.report.sections.parameters import POOR_PERCENT, parameter_rows
from sea_ident.robot import Joint

NAMED = 8
"""Parameters that one sentence names."""

WHOLE = 0.995
"""Share of the samples from which on all of them count."""

POOR_SPRING = 0.05
"""Share of its torque that a spring may leave."""

EXACT = 1e-6
"""A gap below this share of the torque is rounding."""


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
        findings = [*_fit(model), *_parameters(model), *_springs(model), *_validations(model.robot.joints, content)]
        findings.extend(Finding("warn", "Warning", text) for text in model.warnings)
        share = fit.rms_residual / np.maximum(fit.rms_torque, 1e-300)
        tiles = [
            (f"{plain(100 * float(share.max()))} %", "largest residual, as a share of the torque"),
            (str(model.base.rank), "base parameters"),
            (f"{fit.condition_number:.3g}", "condition number of F"),
            (f"{fit.log_det:.1f}", "log det F\N{PRIME}F"),
            (f"{fit.periods} \N{MULTIPLICATION SIGN} {fit.samples}", "periods and samples of each"),
        ]
        repaired = content.diagnosis is not None and bool(content.diagnosis.missing)
        return {"findings": findings, "tiles": tiles, "repaired": repaired}


def _fit(model: Model) -> list[Finding]:
    fit = model.fit
    found = [_agreement(model, i) for i in range(model.robot.n)]
    if fit.agreement is not None and np.any(fit.agreement.share < WHOLE):
        found.append(
            Finding(
                "",
                "Around reversals",
                "friction may be anything up to breakaway and differ from pass to pass; no function of velocity can be "
                "right there, so those samples do not count in the judgement.",
            )
        )
    return found


def _agreement(model: Model, index: int) -> Finding:
    """Whether the residual of a joint is more than its noise away from reversals."""
    fit, joint = model.fit, model.robot.joints[index]
    rms, torque, unit = float(fit.rms_residual[index]), float(fit.rms_torque[index]), joint.torque_unit
    text = f"the model leaves {rms:.3g} of {torque:.3g} {unit} rms ({plain(100.0 * rms / max(torque, 1e-300))} %)"
    if fit.agreement is None:
        return Finding("", joint.name, f"{text}; with one period its noise is not known.")
    away, noise, share = fit.agreement.rms[index], fit.agreement.noise[index], fit.agreement.share[index]
    if share < WHOLE:
        around = fit.agreement.around_reversals(fit.rms_residual)[index]
        text += (
            f": {away:.3g} away from reversals ({100.0 * share:.0f} % of the samples), where noise alone is {noise:.3g}"
            f", and {around:.3g} around them."
        )
    else:
        text += f"; noise alone is {noise:.3g}."
    if fit.agreement.within_noise[index] or fit.agreement.gap[index] < EXACT * torque:
        return Finding("good", joint.name, f"{text} Nothing stands out of the noise.")
    return Finding("warn", joint.name, f"{text} {fit.agreement.gap[index]:.3g} {unit} is not explained.")


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
    found = []
    for spring in model.springs:
        unit = model.robot.joints[model.robot.index(spring.joint)].torque_unit
        share = spring.rms_residual / max(spring.rms_torque, 1e-300)
        good = spring.verdict in (Verdict.LINEAR, Verdict.STIFFENING) and share < POOR_SPRING and spring.stiffness > 0.0
        good = good and not spring.misfit
        noise = "" if spring.noise is None else f", noise {spring.noise:.2g} {unit}"
        text = (
            f"{str(spring.verdict).replace('_', ' ')}: {spring.note}; it leaves {spring.rms_residual:.3g} of "
            f"{spring.rms_torque:.3g} {unit} rms ({plain(100.0 * share)} %{noise})."
        )
        found.append(Finding("good" if good else "warn", f"{spring.joint} spring", text))
    return found


def _validations(joints: tuple[Joint, ...], content: Content) -> list[Finding]:
    found = []
    for validation in content.validations:
        worst = int(np.argmax(validation.nrms))
        text = (
            f"{validation.recording}, which was not used: at worst {plain(100 * validation.nrms[worst])} % of the "
            f"torque, at the {validation.joint_names[worst]}"
        )
        away = validation.agreement
        level = ""
        if away is not None:
            beyond = [
                f"{joint.name} {away.gap[i]:.2g} {joint.torque_unit}"
                for i, joint in enumerate(joints)
                if not away.within_noise[i]
            ]
            level = "warn" if beyond else "good"
            text += "; away from reversals "
            text += f"beyond the noise: {', '.join(beyond)}" if beyond else "nothing stands out of the noise"
        found.append(Finding(level, "Prediction", f"{text}."))
        warned = [spring.warning for spring in validation.springs if spring.warning]
        found.extend(Finding("warn", "Prediction", f"{validation.recording}: {warning}.") for warning in warned)
    return found
