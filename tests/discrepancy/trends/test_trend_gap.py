"""The gap in the course of a recording, against what drifts there."""

from dataclasses import replace

import numpy as np
import pytest

from sea_ident.discrepancy.bench.settle import settle
from sea_ident.discrepancy.trends.trend import Trend
from sea_ident.discrepancy.trends.trend_gap import trend_gap
from sea_ident.effects import make_effect
from sea_ident.effects.drift import warming

RATE = 3.2


def trend(rate, **shape):
    values = np.array([0.0, rate])
    return Trend(make_effect("friction_drift", "knee", **shape), values, 0.01 * values, 100.0, 1e-9, 0.02)


def drifting(laboratory, periods, **options):
    planted = [("friction_drift", "knee", [0.0, RATE], {})]
    bench = laboratory.bench(laboratory.record(planted, periods=periods, **options))
    return bench, settle(bench, bench.effects).fit


@pytest.mark.scenario
def test_what_drifts_goes_with_its_values_and_has_the_size_of_its_torque(laboratory):
    bench, fit = drifting(laboratory, 12)
    gap = trend_gap(bench, fit, [trend(RATE)])
    change = warming(bench.data.starts + 0.5 * bench.data.period, 1e4)
    # as much of the sign as is compared
    coulomb = next(e for e in fit.effects if (e.name, e.joint) == ("coulomb_friction", "knee"))
    sign = bench.cleaned(bench.column_spectra(coulomb, fit.effects)[:, :, 0])
    size = np.sqrt(np.sum(np.abs(sign) ** 2))
    assert 0.8 < size < 1.0
    assert gap.before["knee"] == pytest.approx(RATE * np.std(change) * size, rel=0.02)
    assert gap.before["knee"] > 10.0 * gap.noise["knee"]
    assert gap.after["knee"] < gap.noise["knee"]
    assert gap.shrink > 0.95
    # nothing drifts there
    assert [gap.before[joint] for joint in ("hip", "ankle")] == [0.0, 0.0]


@pytest.mark.scenario
def test_half_a_drift_leaves_the_other_half(laboratory):
    bench, fit = drifting(laboratory, 12)
    assert trend_gap(bench, fit, [trend(0.5 * RATE)]).shrink == pytest.approx(0.5, abs=0.03)
    assert trend_gap(bench, fit, [trend(-RATE)]).shrink == pytest.approx(-1.0, abs=0.06)


def test_what_goes_straight_on_is_there_whatever_course_is_named(laboratory):
    """One that is over within a period explains none of it, and has none of it along its own course."""
    bench, fit = drifting(laboratory, 12)
    straight, soon = (trend_gap(bench, fit, [trend(1e-9, **shape)]) for shape in ({}, {"time_constant": 1.0}))
    assert soon.before["knee"] == pytest.approx(straight.before["knee"], rel=0.05)
    assert soon.after["knee"] == pytest.approx(straight.before["knee"], rel=0.05)


@pytest.mark.scenario
def test_noise_is_that_of_the_periods_and_of_every_course(laboratory):
    """Without a drift: as much of the scatter of one period as there are courses, over the root of their number."""
    bench = laboratory.bench(laboratory.record(periods=12))
    fit = settle(bench, bench.effects).fit
    one, two = (trend_gap(bench, fit, each) for each in ([trend(1e-9)], [trend(1e-9), trend(1e-9, time_constant=20.0)]))
    assert (one.before["knee"], one.after["knee"]) == (0.0, 0.0)
    scatter = np.stack([bench.cleaned(each) for each in np.diff(bench.period_residuals(fit) / fit.scale, axis=0)])
    of_knee = [e for e, equation in enumerate(bench.data.equations) if equation.joint == "knee"]
    power = 0.5 * np.sum(np.mean(np.abs(scatter[:, :, of_knee]) ** 2, axis=0))
    assert one.noise["knee"] == pytest.approx(np.sqrt(power / 12.0), rel=1e-6)
    assert two.noise["knee"] == pytest.approx(np.sqrt(2.0) * one.noise["knee"], rel=1e-6)


@pytest.mark.scenario
def test_another_motion_that_begins_as_the_first_did_drifts_as_far(laboratory):
    bench, fit = drifting(laboratory, 8, motion=1, seed=9)
    gap = trend_gap(bench, fit, [trend(RATE)])
    assert gap.after["knee"] < gap.noise["knee"]
    assert gap.shrink > 0.9


@pytest.mark.scenario
@pytest.mark.parametrize(
    ("name", "joint", "rate"), [("torque_constant_drift", "knee", 0.6), ("stiffness_drift", "hip", -150.0)]
)
def test_columns_that_drift_themselves_are_those_of_every_period(laboratory, name, joint, rate):
    bench = laboratory.bench(laboratory.record([(name, joint, [rate], {})], periods=12))
    values = np.array([rate])
    found = Trend(make_effect(name, joint), values, 0.01 * np.abs(values), 100.0, 1e-9, 0.02)
    gap = trend_gap(bench, settle(bench, bench.effects).fit, [found])
    assert gap.before[joint] > 10.0 * gap.noise[joint]
    assert gap.after[joint] < gap.noise[joint]


def test_without_trends_or_periods_there_is_no_course(laboratory):
    bench, fit = drifting(laboratory, 12)
    assert trend_gap(bench, fit, []) is None
    few = laboratory.bench(laboratory.record(periods=3))
    assert trend_gap(few, settle(few, few.effects).fit, [trend(RATE)]) is None
    unlike = replace(trend(RATE), effect=make_effect("torque_offset", "knee"))
    assert trend_gap(bench, fit, [unlike]) is None
