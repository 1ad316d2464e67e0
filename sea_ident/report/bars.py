"""Groups of bars as inline SVG."""

from collections.abc import Mapping, Sequence
from html import escape

from markupsafe import Markup

from sea_ident.report.chart import nice_ticks, tick_text

_HEIGHT, _LEFT, _TOP, _BOTTOM, _BAR = 190, 66, 22, 40, 22


def bars(
    groups: Sequence[str], series: Mapping[str, Sequence[float]], roles: Sequence[str], title: str, units: Sequence[str]
) -> Markup:
    """Bars from zero, side by side.

    Args:
        groups: (G,) names under the axis.
        series: name -> (G,) values, not negative.
        roles: colour of each series.
        title: shown above.
        units: (G,) of the values of each group.

    Returns:
        The SVG.
    """
    count = len(series)
    pitch = count * _BAR + 26
    width = _LEFT + len(groups) * pitch + 12
    top = max((max(values, default=0.0) for values in series.values()), default=0.0) or 1.0
    inner = _HEIGHT - _TOP - _BOTTOM

    def y(value: float) -> float:
        return _TOP + inner * (1.0 - value / top)

    out = [f'<svg class="bars" viewBox="0 0 {width} {_HEIGHT}" style="max-width:{width}px;--own:{width}px" role="img" ']
    out.append(f'aria-label="{escape(title)}"><text class="chart-title" x="{_LEFT}" y="14">{escape(title)}</text>')
    out.append('<g class="ticks">')
    for tick in nice_ticks(0.0, top, 4):
        out.append(f'<line x1="{_LEFT}" y1="{y(tick):.1f}" x2="{width - 8}" y2="{y(tick):.1f}"/>')
        out.append(f'<text class="ty" x="{_LEFT - 6}" y="{y(tick) + 3.5:.1f}">{tick_text(tick)}</text>')
    out.append("</g>")
    for g, name in enumerate(groups):
        x = _LEFT + 13 + g * pitch
        for k, (label, values) in enumerate(series.items()):
            value = float(values[g])
            tip = escape(f"{name}, {label}: {value:.3g} {units[g]}")
            out.append(
                f'<rect class="bar s-{roles[k]}" x="{x + k * _BAR}" y="{y(value):.1f}" width="{_BAR - 3}" '
                f'height="{max(inner * value / top, 0.8):.1f}"><title>{tip}</title></rect>'
            )
        middle = x + count * _BAR / 2
        out.append(f'<text class="tx" x="{middle:.0f}" y="{_HEIGHT - 22}">{escape(name)}</text>')
    label = escape(" or ".join(dict.fromkeys(units)))
    out.append(f'<text class="label" transform="rotate(-90)" x="{-(_TOP + inner / 2):.0f}" y="12">{label}</text></svg>')
    return Markup("".join(out))


def bars_legend(series: Sequence[str], roles: Sequence[str]) -> Markup:
    """What the colours mean."""
    items = "".join(
        f'<span class="item"><svg class="key key-bar s-{role}" viewBox="0 0 22 10"><path d="M4 5H18"/></svg>'
        f"{escape(name)}</span>"
        for name, role in zip(series, roles, strict=True)
    )
    return Markup(f'<div class="legend">{items}</div>')
