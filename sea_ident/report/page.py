"""`write_report`: one HTML file that needs nothing but itself."""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

import sea_ident
from sea_ident.atomic import atomic_file
from sea_ident.estimation import Model
from sea_ident.excitation import Excitation
from sea_ident.report.content import Content
from sea_ident.report.section import Section
from sea_ident.report.sections import SECTIONS
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
    result: Model,
    path: str | Path,
    *,
    excitation: Excitation | None = None,
    validations: Sequence[Validation] = (),
) -> None:
    """Write a report: one HTML file without any reference to the network.

    Args:
        result: what to report on.
        path: file to write; it is complete or does not appear.
        excitation: trajectory that the robot was asked for, shown in its limits.
        validations: comparisons with recordings that were not used in the fit.

    Raises:
        OutputError: the file cannot be written.
    """
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
    absent: list[Section] = []
    for section in SECTIONS:
        context = section.context(content)
        if context is None:
            absent.append(section)
        else:
            body = environment.get_template(f"{section.key}.html").render(context)
            rendered.append(_Rendered(section.key, section.title, Markup(body)))
    model = content.model
    return environment.get_template("page.html").render(
        title=f"{model.robot.name}: identified model",
        subtitle=f"{model.robot.n} joints, {len(model.springs)} springs; from {Path(model.recording).name} "
        f"by {model.estimator.replace('_', ' ')}",
        css=source("page.css"),
        js=source("page.js") + Markup("\n") + source("viewer.js"),
        sections=rendered,
        absent=absent,
        version=sea_ident.__version__,
    )
