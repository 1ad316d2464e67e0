"""`write_report`: one HTML file that needs nothing but itself."""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

import sea_ident
from sea_ident.arguments import expect
from sea_ident.atomic import atomic_file
from sea_ident.discrepancy.result.diagnosis import Diagnosis
from sea_ident.estimation import Model
from sea_ident.exceptions import SeaIdentError
from sea_ident.excitation import Excitation
from sea_ident.report.content import Content
from sea_ident.report.section import DiagnosisSection, ModelSection
from sea_ident.report.sections import SECTIONS
from sea_ident.robot.describe import counted
from sea_ident.validation import Validation


@dataclass(frozen=True)
class _Rendered:
    key: str
    title: str
    body: Markup


LONGEST_WHOLE = 6
"""Digits up to which a number is written without a power of ten."""


def number(value: float | None, digits: int = 4) -> str:
    """A number for people: so many digits, a true minus sign, a dash where there is none."""
    if value is None or not math.isfinite(value):
        return "\N{EN DASH}"
    text = f"{value:.{digits}g}"
    mantissa, e, power = text.partition("e")
    if e and 0 < int(power) < LONGEST_WHOLE:
        text = f"{float(text):.0f}"
    elif e:
        text = f"{mantissa}\N{MULTIPLICATION SIGN}10{_superscript(int(power))}"
    return text.replace("-", "\N{MINUS SIGN}")


def unit(text: str) -> str:
    """A unit with raised digits: kg m2 as kg m²."""
    return re.sub(r"(?<=[a-z])([0-9])", lambda found: _superscript(int(found[1])), text)


def _superscript(value: int) -> str:
    return str(value).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))


def write_report(
    result: Model | Diagnosis,
    path: str | Path,
    *,
    excitation: Excitation | None = None,
    validations: Sequence[Validation] = (),
) -> None:
    """Write a report: one HTML file without any reference to the network.

    Args:
        result: what to report on. A diagnosis brings the repaired model with it, unless it was read from a file.
        path: file to write; it is complete or does not appear.
        excitation: trajectory that the robot was asked for, shown in its limits.
        validations: comparisons with recordings that were not used in the fit.

    Raises:
        OutputError: the file cannot be written.
        SeaIdentError: the excitation is one of other joints.
    """
    expect(result, "write_report: result", Model, Diagnosis)
    model = result.model if isinstance(result, Diagnosis) else result
    if excitation is not None and model is not None and excitation.joint_names != model.robot.joint_names:
        raise SeaIdentError(
            f"the excitation is one of {', '.join(excitation.joint_names)}, the model one of "
            f"{', '.join(model.robot.joint_names)}; give the excitation that this robot followed"
        )
    if isinstance(result, Diagnosis):
        content = Content(result.model, excitation, tuple(validations), result)
    else:
        content = Content(result, excitation, tuple(validations))
    text = render(content)
    with atomic_file(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def render(content: Content) -> str:
    """The page as text."""
    loader = PackageLoader("sea_ident.report", "templates")
    environment = Environment(
        loader=loader, autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters.update(number=number, unit=unit)

    def source(name: str) -> Markup:
        return Markup(loader.get_source(environment, name)[0])

    rendered: list[_Rendered] = []
    absent: dict[str, list[str]] = {}
    for section in SECTIONS:
        context = section.context(content)
        if context is not None:
            body = environment.get_template(f"{section.key}.html").render(context)
            rendered.append(_Rendered(section.key, section.title, Markup(body)))
        elif content.diagnosis is not None or not isinstance(section, DiagnosisSection):
            lacks = "a model" if content.model is None and isinstance(section, ModelSection) else section.needs
            absent.setdefault(lacks, []).append(section.title.lower())
    title, subtitle = _headings(content)
    return environment.get_template("page.html").render(
        title=title,
        subtitle=subtitle,
        css=source("page.css"),
        js=source("page.js") + Markup("\n") + source("viewer.js"),
        sections=rendered,
        absent=absent,
        version=sea_ident.__version__,
    )


def _headings(content: Content) -> tuple[str, str]:
    model, diagnosis = content.model, content.diagnosis
    about = ""
    if model is not None:
        about = (
            f"{counted(model.robot.n, 'joint')}, {counted(len(model.springs), 'spring')}; from "
            f"{Path(model.recording).name} by {model.estimator.replace('_', ' ')}"
        )
    if diagnosis is None:
        return (f"{model.robot.name}: identified model" if model is not None else "Report"), about
    data = Path(diagnosis.recording).name or "a recording"
    held_out = "" if diagnosis.holdout_source is None else f", held out {Path(diagnosis.holdout_source).name}"
    name = "" if model is None else f"{model.robot.name}: "
    return f"{name}what the model lacks", f"Compared with {data}{held_out}. {about}"
