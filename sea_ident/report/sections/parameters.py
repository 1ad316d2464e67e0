"""Identified parameters beside those of the robot's description."""

from collections.abc import Mapping
from dataclasses import dataclass
from html import escape
from typing import Any, ClassVar

import numpy as np
from markupsafe import Markup

from sea_ident.estimation import Model
from sea_ident.regressor import prior_parameters
from sea_ident.report.content import Content
from sea_ident.report.section import ModelSection

POOR_PERCENT = 20.0


@dataclass(frozen=True)
class Row:
    """One base parameter.

    Attributes:
        name: of the base parameter.
        combination: what is grouped in it, empty where it stands alone.
        unit: its unit.
        stated: value by the robot's description, None where it gives none.
        value: estimate.
        std: standard deviation.
        lower: end of the 95 % interval.
        upper: end of the 95 % interval.
        relative: standard deviation as a share of the estimate [%].
    """

    name: str
    combination: str
    unit: str
    stated: float | None
    value: float
    std: float
    lower: float
    upper: float
    relative: float

    @property
    def poor(self) -> bool:
        """Whether the data hardly tell it."""
        return self.relative > POOR_PERCENT

    @property
    def off(self) -> bool:
        """Whether the description lies outside the interval."""
        return self.stated is not None and not self.lower <= self.stated <= self.upper

    @property
    def bar(self) -> Markup:
        """Interval, estimate and stated value on one small axis."""
        ends = [self.lower, self.upper, *(() if self.stated is None else (self.stated,))]
        low, high = min(ends), max(ends)
        if not np.isfinite(low + high) or high <= low:
            return Markup("")
        width, pad = 120.0, 8.0

        def at(x: float) -> float:
            return float(pad + (width - 2 * pad) * (x - low) / (high - low))

        a, b, c = at(self.lower), at(self.upper), at(self.value)
        mark = ""
        if self.stated is not None:
            mark = (
                f'<path d="M{at(self.stated):.1f} 2v14" style="stroke:var(--residual);stroke-width:2"/>'
            )  # fmt: skip
        return Markup(
            f'<svg width="120" height="18" viewBox="0 0 120 18" role="img" aria-label="{escape(self.name)}">'
            f'<path d="M{a:.1f} 9H{b:.1f}" style="stroke:var(--predicted);stroke-width:3;opacity:.45"/>'
            f'<circle cx="{c:.1f}" cy="9" r="3.6" style="fill:var(--predicted)"/>{mark}</svg>'
        )


def parameter_rows(model: Model) -> list[Row]:
    """All base parameters of the model, in its order."""
    base = model.base
    stated = base.project(prior_parameters(model.robot, model.effects))
    lower, upper = model.interval()
    rows = []
    for k, name in enumerate(base.names):
        terms = base.combination(k)
        combination = "" if len(terms) == 1 else _sum(terms)
        rows.append(
            Row(
                name=name,
                combination=combination,
                unit=base.units[k],
                stated=float(stated[k]) if np.isfinite(stated[k]) else None,
                value=float(model.values[k]),
                std=float(model.std[k]),
                lower=float(lower[k]),
                upper=float(upper[k]),
                relative=float(model.relative_std_percent[k]),
            )
        )
    return rows


def _sum(terms: Mapping[str, float]) -> str:
    """A weighted sum as one writes it: a + 0.2 b − c."""
    space, parts = "\N{NO-BREAK SPACE}", []
    for name, weight in terms.items():
        sign = "\N{MINUS SIGN}" if weight < 0.0 else "+"
        size = "" if abs(abs(weight) - 1.0) < 1e-9 else f"{abs(weight):.4g}{space}"
        parts.append(f"{sign}{space}{size}{name}")
    return " ".join(parts).removeprefix(f"+{space}")


class Parameters(ModelSection):
    """Table of the base parameters with intervals, and what changes beside them."""

    key: ClassVar[str] = "parameters"
    title: ClassVar[str] = "Parameters"
    needs: ClassVar[str] = "a model"

    def of_model(self, model: Model, content: Content) -> dict[str, Any] | None:
        """The rows, and how sure they are."""
        trends = [trend.summary(model.robot) for trend in model.trends]
        return {"rows": parameter_rows(model), "kind": str(model.covariance_kind), "trends": trends}
