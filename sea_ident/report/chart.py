"""Charts as inline SVG that follow the colours of the page and can be zoomed.

The marks lie in an inner SVG whose viewBox is the window of data that is shown; a script changes that window and the
tick labels, nothing else, so that a chart is complete without any script, in light and dark and on paper.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from itertools import pairwise

import numpy as np
from markupsafe import Markup

from sea_ident._typing import FloatArray

GRID = 10_000
"""Units of the inner coordinate system along each axis: more than the pixels of any screen."""

MOST_POINTS = 2_000
"""Points drawn of one line; more are thinned to the extremes of each bin."""


@dataclass(frozen=True, eq=False)
class Line:
    """A curve (N,) over (N,); `role` names its colour in the style sheet."""

    x: FloatArray
    y: FloatArray
    role: str
    label: str = ""


@dataclass(frozen=True, eq=False)
class Band:
    """The area between two curves (N,)."""

    x: FloatArray
    lower: FloatArray
    upper: FloatArray
    role: str
    label: str = ""


@dataclass(frozen=True, eq=False)
class Points:
    """Dots at (N,) over (N,)."""

    x: FloatArray
    y: FloatArray
    role: str
    label: str = ""


@dataclass(frozen=True)
class Rule:
    """A horizontal line at a value, such as a limit."""

    y: float
    role: str = "limit"
    label: str = ""


Mark = Line | Band | Points | Rule


@dataclass(frozen=True, eq=False)
class Chart:
    """A chart of several marks over one pair of axes.

    Attributes:
        marks: drawn in this order.
        x_label: with its unit.
        y_label: with its unit.
        title: shown above; also its accessible name.
        width: of the drawing [px]; it shrinks with the page.
        height: of the drawing [px].
        link: charts of the same link zoom along x together.
        x_range: window; the extent of the data by default.
        y_range: window; the extent of the data by default.
    """

    marks: Sequence[Mark]
    x_label: str
    y_label: str
    title: str = ""
    width: int = 900
    height: int = 240
    link: str = ""
    x_range: tuple[float, float] | None = None
    y_range: tuple[float, float] | None = None

    def svg(self) -> Markup:
        """The chart."""
        left, right, top, bottom = 66, 12, 22 if self.title else 8, 34
        inner_width, inner_height = self.width - left - right, self.height - top - bottom
        (x0, x1), (y0, y1) = self._windows()
        to_x, to_y = _Scale(x0, x1, GRID), _Scale(y1, y0, GRID)
        out = [
            f'<svg class="chart" viewBox="0 0 {self.width} {self.height}" style="--own:{self.width}px" role="img" '
            f'aria-label="{escape(self.title or self.y_label)}" data-link="{escape(self.link)}" '
            f'data-window="{x0:.9g} {x1:.9g} {y0:.9g} {y1:.9g}" '
            f'data-frame="{left} {top} {inner_width} {inner_height}">'
        ]
        if self.title:
            out.append(f'<text class="chart-title" x="{left}" y="14">{escape(self.title)}</text>')
        out.append('<g class="ticks">')
        x_of, y_of = _Scale(x0, x1, inner_width, left), _Scale(y1, y0, inner_height, top)
        for tick in nice_ticks(x0, x1, max(3, inner_width // 80)):
            x = x_of(tick)
            out.append(f'<line x1="{x:.1f}" y1="{top}" x2="{x:.1f}" y2="{top + inner_height}"/>')
            out.append(f'<text class="tx" x="{x:.1f}" y="{top + inner_height + 14}">{tick_text(tick)}</text>')
        for tick in nice_ticks(y0, y1, max(4, inner_height // 32)):
            y = y_of(tick)
            out.append(f'<line x1="{left}" y1="{y:.1f}" x2="{left + inner_width}" y2="{y:.1f}"/>')
            out.append(f'<text class="ty" x="{left - 6}" y="{y + 3.5:.1f}">{tick_text(tick)}</text>')
        out.append("</g>")
        out.append(
            f'<svg class="plot" x="{left}" y="{top}" width="{inner_width}" height="{inner_height}" '
            f'viewBox="0 0 {GRID} {GRID}" preserveAspectRatio="none">'
        )
        out.extend(_draw(mark, to_x, to_y) for mark in self.marks)
        out.append("</svg>")
        out.append(f'<rect class="frame" x="{left}" y="{top}" width="{inner_width}" height="{inner_height}"/>')
        middle = left + inner_width / 2
        out.append(f'<text class="label" x="{middle:.0f}" y="{self.height - 4}">{escape(self.x_label)}</text>')
        middle = top + inner_height / 2
        out.append(
            f'<text class="label" transform="rotate(-90)" x="{-middle:.0f}" y="12">{escape(self.y_label)}</text></svg>'
        )
        return Markup("".join(out))

    def legend(self) -> Markup:
        """Labels of the marks, each with its colour, in the order in which they were drawn."""
        seen: dict[str, str] = {}
        for mark in self.marks:
            if mark.label:
                kind = type(mark).__name__.lower()
                seen.setdefault(mark.label, f"key key-{kind} s-{mark.role}")
        items = "".join(
            f'<span class="item"><svg class="{c}" viewBox="0 0 22 10"><path d="M1 5H21"/></svg>{escape(t)}</span>'
            for t, c in seen.items()
        )
        return Markup(f'<div class="legend">{items}</div>')

    def _windows(self) -> tuple[tuple[float, float], tuple[float, float]]:
        xs = [mark.x for mark in self.marks if not isinstance(mark, Rule)]
        ys: list[FloatArray] = []
        for mark in self.marks:
            if isinstance(mark, Band):
                ys.extend((mark.lower, mark.upper))
            else:
                ys.append(np.atleast_1d(np.asarray(mark.y, dtype=float)))
        return self.x_range or _extent(xs, 0.0), self.y_range or _extent(ys, 0.05)


class _Scale:
    """A linear map of [first, last] onto [start, start + length]."""

    def __init__(self, first: float, last: float, length: float, start: float = 0.0) -> None:
        self.gain = length / (last - first)
        self.shift = start - self.gain * first

    def __call__(self, value: float) -> float:
        return self.gain * value + self.shift

    def whole(self, values: FloatArray) -> list[int]:
        """Rounded to whole units, kept within what renderers take."""
        scaled = np.clip(self.gain * values + self.shift, -50 * GRID, 50 * GRID)
        return [int(v) for v in np.rint(scaled)]


def _draw(mark: Mark, to_x: _Scale, to_y: _Scale) -> str:
    if isinstance(mark, Rule):
        y = round(to_y(mark.y))
        return f'<path class="rule s-{mark.role}" d="M{-10 * GRID} {y}H{20 * GRID}"/>'
    if isinstance(mark, Band):
        keep = thin(mark.upper)
        up = _path(to_x.whole(mark.x[keep]), to_y.whole(mark.upper[keep]))
        down = _path(to_x.whole(mark.x[keep][::-1]), to_y.whole(mark.lower[keep][::-1])).replace("M", "L", 1)
        return f'<path class="band s-{mark.role}" d="{up}{down}z"/>'
    if isinstance(mark, Points):
        dots = "".join(f"M{x} {y}h0" for x, y in zip(to_x.whole(mark.x), to_y.whole(mark.y), strict=True))
        return f'<path class="dots s-{mark.role}" d="{dots}"/>'
    keep = thin(mark.y)
    path = _path(to_x.whole(mark.x[keep]), to_y.whole(mark.y[keep]))
    return f'<path class="line s-{mark.role}" data-label="{escape(mark.label)}" d="{path}"/>'


def _path(xs: list[int], ys: list[int]) -> str:
    """Absolute start, then relative steps: a third of the size."""
    if not xs:
        return ""
    steps = [f"M{xs[0]} {ys[0]}l"]
    steps.append(
        " ".join(
            f"{xs[k] - xs[k - 1]} {ys[k] - ys[k - 1]}" for k in range(1, len(xs))
        ) or "0 0"
    )  # fmt: skip
    return "".join(steps)


def thin(values: FloatArray, most: int = MOST_POINTS) -> slice | FloatArray:
    """Indices that keep the look of a curve: first, smallest and largest sample of every bin, in order."""
    count = len(values)
    if count <= most:
        return slice(None)
    edges = np.linspace(0, count, most // 2 + 1).astype(int)
    keep = {0, count - 1}
    for start, stop in pairwise(edges):
        part = values[start:stop]
        keep.update((start + int(np.argmin(part)), start + int(np.argmax(part))))
    indices: FloatArray = np.array(sorted(keep))
    return indices


def _extent(arrays: Sequence[FloatArray], margin: float) -> tuple[float, float]:
    """Smallest interval that holds all finite values, widened by a share of its length."""
    values = np.concatenate([np.ravel(a) for a in arrays]) if arrays else np.zeros(0)
    values = values[np.isfinite(values)]
    if values.size == 0:
        return 0.0, 1.0
    low, high = float(values.min()), float(values.max())
    if high - low <= 1e-12 * max(abs(low), abs(high), 1e-9):
        pad = max(abs(low) * 0.1, 1e-3)
        return low - pad, high + pad
    return low - margin * (high - low), high + margin * (high - low)


def nice_ticks(low: float, high: float, most: int) -> list[float]:
    """At most about `most` round numbers between two values."""
    step = (high - low) / max(most, 1)
    power = 10.0 ** math.floor(math.log10(step))
    step = next(factor * power for factor in (1.0, 2.0, 2.5, 5.0, 10.0) if factor * power >= step * 0.999)
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [k * step for k in range(first, last + 1)]


def tick_text(value: float) -> str:
    """A tick label without noise digits."""
    text = f"{value:.6g}" if abs(value) > 1e-12 else "0"
    return text.replace("-", "\N{MINUS SIGN}")
