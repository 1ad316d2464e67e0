"""Charts: what is drawn is where the data say."""

import re
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest

from sea_ident.report.chart import GRID, Band, Chart, Line, Points, Rule, nice_ticks, thin


def drawn(svg: str, kind: str) -> np.ndarray:
    """(N, 2) data coordinates of the first path of a class, through the chart's own window."""
    root = ElementTree.fromstring(svg)
    x0, x1, y0, y1 = map(float, root.attrib["data-window"].split())
    path = next(e for e in root.iter("path") if kind in e.attrib["class"].split())
    numbers = np.array([int(v) for v in re.findall(r"-?\d+", path.attrib["d"])]).reshape(-1, 2)
    points = np.cumsum(numbers, axis=0)
    return np.stack([x0 + points[:, 0] / GRID * (x1 - x0), y1 - points[:, 1] / GRID * (y1 - y0)], axis=1)


def test_a_line_is_drawn_at_its_data():
    x = np.linspace(-3.0, 7.0, 400)
    y = 5.0 * np.sin(x) - 2.0
    points = drawn(Chart([Line(x, y, "measured", "m")], "x", "y").svg(), "line")
    np.testing.assert_allclose(points[:, 0], x, atol=10.0 / GRID)
    np.testing.assert_allclose(points[:, 1], y, atol=2 * 11.0 / GRID)


def test_the_window_holds_all_marks_but_not_what_is_not_finite():
    x = np.array([0.0, 1.0, 2.0])
    chart = Chart(
        [Line(x, np.array([0.0, np.nan, 1.0]), "measured"), Band(x, x - 9.0, x + 4.0, "noise"), Rule(11.0)], "x", "y"
    )
    (low, high), (bottom, top) = chart._windows()
    assert (low, high) == (0.0, 2.0)
    assert bottom < -9.0
    assert top > 11.0


def test_thinning_keeps_a_spike_and_the_ends():
    values = np.zeros(50_000)
    values[31_234] = 7.0
    values[40_001] = -3.0
    kept = thin(values, most=200)
    assert len(kept) <= 200 + 4
    assert {0, 31_234, 40_001, 49_999} <= set(np.asarray(kept).tolist())
    assert np.all(np.diff(kept) > 0)


@pytest.mark.parametrize(
    ("low", "high", "most"), [(0.0, 1.0, 5), (-3.3e-7, 8.1e-7, 4), (120.0, 187_000.0, 6), (-2, -1, 3)]
)
def test_ticks_are_round_inside_and_few(low, high, most):
    ticks = nice_ticks(low, high, most)
    assert 1 <= len(ticks) <= most + 1
    assert all(low - 1e-9 * (high - low) <= t <= high + 1e-9 * (high - low) for t in ticks)
    step = np.diff(ticks)[0] if len(ticks) > 1 else ticks[0]
    mantissa = step / 10.0 ** np.floor(np.log10(abs(step)))
    assert min(abs(mantissa - round_one) for round_one in (1.0, 2.0, 2.5, 5.0, 10.0)) < 1e-6


def test_labels_are_escaped_and_the_legend_names_every_mark_once():
    x = np.arange(3.0)
    marks = [Line(x, x, "measured", "a < b & c"), Line(x, x, "measured", "a < b & c"), Points(x, x, "residual", "dots")]
    chart = Chart(marks, "<x>", "y & z", "t")
    ElementTree.fromstring(chart.svg())  # well-formed although the labels hold markup
    legend = str(chart.legend())
    assert legend.count("a &lt; b &amp; c") == 1
    assert legend.count("dots</span>") == 1
