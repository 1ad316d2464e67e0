"""How far the estimates depend on each other."""

from html import escape
from typing import Any, ClassVar

import numpy as np
from markupsafe import Markup

from sea_ident._typing import FloatArray
from sea_ident.report.content import Content
from sea_ident.report.section import Section

STRONG = 0.9


class Correlation(Section):
    """Correlation matrix of the base parameters, and the pairs that can hardly be told apart."""

    key: ClassVar[str] = "correlation"
    title: ClassVar[str] = "Correlation of the parameters"
    needs: ClassVar[str] = "a covariance"

    def context(self, content: Content) -> dict[str, Any] | None:
        """The matrix as a picture, and the strongest pairs."""
        model = content.model
        covariance = model.covariance
        std = np.sqrt(np.diag(covariance))
        if not np.all(std > 0.0) or not np.all(np.isfinite(covariance)):
            return None
        correlation = covariance / np.outer(std, std)
        names = model.base.names
        rows, columns = np.triu_indices(len(names), 1)
        order = np.argsort(-np.abs(correlation[rows, columns]))[:6]
        pairs = [(names[rows[k]], names[columns[k]], float(correlation[rows[k], columns[k]])) for k in order]
        return {
            "matrix": heat_map(correlation, names),
            "pairs": pairs,
            "strong": [pair for pair in pairs if abs(pair[2]) > STRONG],
            "limit": STRONG,
        }


def heat_map(matrix: FloatArray, names: tuple[str, ...]) -> Markup:
    """A square matrix of values from -1 to 1 as coloured cells."""
    n = len(names)
    cell = 26 if n <= 24 else max(9, 620 // n)
    label = 8 + 6.2 * max(map(len, names))
    width, height = label + n * cell + 4, n * cell + label * 0.72 + 8
    out = [f'<svg class="matrix" viewBox="0 0 {width:.0f} {height:.0f}" role="img" aria-label="Correlation matrix"']
    out.append(f' style="max-width:{width:.0f}px">')
    for i, name in enumerate(names):
        y = (i + 0.5) * cell + 4
        out.append(f'<text class="ty" x="{label - 6:.0f}" y="{y:.1f}">{escape(name)}</text>')
        x = label + (i + 0.65) * cell
        turn = f"rotate(-45 {x:.1f} {n * cell + 10})"
        out.append(f'<text class="ty" x="{x:.1f}" y="{n * cell + 12}" transform="{turn}">{escape(name)}</text>')
    for i in range(n):
        for j in range(n):
            value = float(matrix[i, j])
            color = "var(--plus)" if value > 0 else "var(--minus)"
            tip = escape(f"{names[i]}\n{names[j]}\n{value:+.3f}")
            out.append(
                f'<rect x="{label + j * cell:.0f}" y="{i * cell}" width="{cell - 1}" height="{cell - 1}" rx="2" '
                f'style="fill:{color};fill-opacity:{max(abs(value), 0.03):.2f}" data-tip="{tip}"/>'
            )
    out.append("</svg>")
    return Markup("".join(out))
