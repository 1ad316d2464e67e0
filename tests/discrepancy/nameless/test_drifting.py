"""A drift that the library does not have is not named by what was found of it in the mean and over the periods."""

from dataclasses import replace

import numpy as np
import pytest

import sea_ident.discrepancy.nameless.drifting as drifting_module
from sea_ident.discrepancy import Verdict
from sea_ident.discrepancy.bench.settle import settle, settle_again
from sea_ident.discrepancy.conclude import conclude
from sea_ident.discrepancy.measured.check import Findings
from sea_ident.discrepancy.nameless.drifting import drifting
from sea_ident.discrepancy.search.confirm import Confirmed
from sea_ident.discrepancy.search.search import Selection
from sea_ident.discrepancy.trends.trend import LEVEL, Trend, TrendTest, compare_periods
from sea_ident.effects import effect_classes, make_effect


def compared(laboratory, planted, found):
    """A recording with what was found in its mean, and the comparison of its periods."""
    bench = laboratory.bench(laboratory.record(planted, periods=8))
    start = settle(bench, bench.effects)
    begun = bench.anchored((*start.fit.effects, make_effect(*found)), start.fit.parameters)
    now = settle_again(bench, bench.fit(begun, start.noise, start=start.fit.parameters))
    return bench, start, now, compare_periods(bench, now.fit)


@pytest.fixture
def without_drift_of_torque(monkeypatch):
    """The library without the drift of a torque constant."""
    less = {name: kind for name, kind in effect_classes().items() if name != "torque_constant_drift"}
    monkeypatch.setattr("sea_ident.discrepancy.trends.trend_directions.effect_classes", lambda: less)


@pytest.mark.scenario
def test_a_torque_constant_that_drifts_is_no_friction_that_does(laboratory, without_drift_of_torque):
    planted = [("torque_constant_drift", "knee", [-0.4], {})]
    bench, start, now, trends = compared(laboratory, planted, ("torque_constant", "knee"))
    # something changes, and whether it got the nearest name or none hangs on how much that leaves
    assert trends.p_value < 1e-3
    nearest = TrendTest(trends.p_value, (), True)
    for said in (trends, nearest):
        (one,) = drifting(bench, now, said)
        assert (one.relative, one.joint) == ("torque_constant", "knee")
        assert "the torque_constant at knee drifts explains what changes from period to period" in one.sentence
    selection = Selection(start, now, 1, (0.0,))
    confirmed = Confirmed(selection, bench, start, now)
    diagnosis = conclude(bench, confirmed, nearest, {}, None, None, Findings(), (one,))
    assert diagnosis.verdict is Verdict.NOT_IN_LIBRARY
    assert one.sentence in diagnosis.text


@pytest.mark.scenario
@pytest.mark.parametrize(
    ("drift", "found"),
    [
        (("friction_drift", "knee", [0.0, -0.6], {}), ("torque_constant", "knee")),
        (("torque_constant_drift", "knee", [-0.4], {}), ("torque_constant", "knee")),
    ],
)
def test_a_drift_of_the_library_keeps_its_name_beside_what_was_found(laboratory, drift, found):
    planted = [drift, (*found, [0.05], {})]
    bench, _, now, trends = compared(laboratory, planted, found)
    assert [(t.effect.name, t.effect.joint) for t in trends.trends] == [drift[:2]]
    assert drifting(bench, now, trends) == ()


@pytest.mark.parametrize(("gains", "other"), [((21800.0, 21850.0), 0), ((21800.0, 24000.0), 1), ((40.0, 60.0), 1)])
def test_a_large_drift_keeps_its_name_where_another_explains_little_more(nothing_missing, monkeypatch, gains, other):
    """It is seen so well that how its columns are taken is more than noise."""
    bench, start = nothing_missing
    found = bench.anchored((*start.fit.effects, make_effect("torque_constant", "hip")), start.fit.parameters)
    now = settle_again(bench, bench.fit(found, start.noise, start=start.fit.parameters))
    drift = make_effect("torque_constant_drift", "hip")
    trend = Trend(drift, np.array([-0.1]), np.array([0.002]), gains[0], 0.0, 0.03)
    monkeypatch.setattr(drifting_module._Drifts, "gains", lambda *_: list(gains))
    assert len(drifting(bench, now, TrendTest(0.0, (trend,), False))) == other


@pytest.mark.scenario
def test_an_encoder_that_slips_is_no_spring_that_drifts(laboratory):
    """It shows at other joints too, as the drift of whatever is nearest there."""
    recording = laboratory.record(periods=8)
    slip = 1e-3 * np.linspace(0.0, 1.0, recording.samples)
    slipped = replace(recording, columns={**recording.columns, "q_knee": recording.columns["q_knee"] + slip})
    bench = laboratory.bench(slipped)
    start = settle(bench, bench.effects)
    found = bench.anchored((*start.fit.effects, make_effect("encoder_offset", "knee")), start.fit.parameters)
    now = settle_again(bench, bench.refine(found, start.noise, start=start.fit.parameters))
    trends = compare_periods(bench, now.fit)
    assert trends.p_value < LEVEL
    nearest = Trend(make_effect("stiffness_drift", "hip"), np.array([-1.0]), np.array([0.1]), 80.0, 1e-9, 0.001)
    for said in (TrendTest(trends.p_value, (), True), TrendTest(trends.p_value, (nearest,), True)):
        (one,) = drifting(bench, now, said)
        assert one.relative == "encoder_offset"
        assert "That the encoder_offset at knee drifts" in one.sentence


@pytest.mark.scenario
def test_what_stays_as_it_is_does_not_drift(laboratory):
    bench, _, now, trends = compared(laboratory, [("torque_constant", "knee", [0.05], {})], ("torque_constant", "knee"))
    assert drifting(bench, now, TrendTest(trends.p_value, (), True)) == ()
