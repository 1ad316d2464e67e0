"""Matrices as coloured cells, with the value of each under the pointer."""

from collections.abc import Sequence
from html import escape

from markupsafe import Markup

from sea_ident._typing import FloatArray

LARGEST_CELL, SMALLEST_CELL, ROOM = 26, 9, 620
CHARACTER = 6.2
"""Width of a character of a label [px]."""


def matrix(
    values: FloatArray, rows: Sequence[str], columns: Sequence[str], tips: Sequence[Sequence[str]], label: str
) -> Markup:
    """A matrix as coloured cells.

    Args:
        values: (R, C) from -1 (orange) over 0 (pale) to 1 (blue); not a number leaves a cell empty.
        rows: (R,) names.
        columns: (C,) names.
        tips: (R, C) text under the pointer.
        label: accessible name.

    Returns:
        The SVG.
    """
    cell = min(LARGEST_CELL, max(SMALLEST_CELL, ROOM // max(len(rows), len(columns), 1)))
    left = 8 + CHARACTER * max(map(len, rows))
    bottom = CHARACTER * 0.72 * max(map(len, columns)) + 16
    width, height = left + len(columns) * cell + 4, len(rows) * cell + bottom
    out = [f'<svg class="matrix" viewBox="0 0 {width:.0f} {height:.0f}" role="img" aria-label="{escape(label)}"']
    out.append(f' style="max-width:{width:.0f}px;--own:{width:.0f}px">')
    for i, name in enumerate(rows):
        out.append(f'<text class="ty" x="{left - 6:.0f}" y="{(i + 0.5) * cell + 4:.1f}">{escape(name)}</text>')
    for j, name in enumerate(columns):
        x, y = left + (j + 0.65) * cell, len(rows) * cell + 12
        turn = f"rotate(-45 {x:.1f} {y - 2:.1f})"
        out.append(f'<text class="ty" x="{x:.1f}" y="{y:.1f}" transform="{turn}">{escape(name)}</text>')
    for i in range(len(rows)):
        for j in range(len(columns)):
            value = float(values[i, j])
            if value != value:
                continue
            color = "var(--plus)" if value > 0 else "var(--minus)"
            out.append(
                f'<rect x="{left + j * cell:.0f}" y="{i * cell}" width="{cell - 1}" height="{cell - 1}" rx="2" '
                f'style="fill:{color};fill-opacity:{min(max(abs(value), 0.03), 1.0):.2f}" '
                f'data-tip="{escape(tips[i][j])}"/>'
            )
    out.append("</svg>")
    return Markup("".join(out))
