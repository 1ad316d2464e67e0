"""Readings of an encoder that are filtered are late by more than one time."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

from sea_ident.discrepancy import diagnose
from sea_ident.discrepancy.bench.settle import settle, settle_again
from sea_ident.discrepancy.search.lags import with_their_lags
from sea_ident.effects import make_effect
from sea_ident.estimation import identify
from sea_ident.exceptions import SeaIdentWarning
from sea_ident.motion import Motion

DELAY, LAG = 0.02, 0.016


def late(laboratory, lag, **options):
    """A knee whose encoder is read late."""
    return laboratory.record([("position_delay", "knee", [], {"delay": DELAY, "lag": lag})], **options)


def delayed(laboratory, recording):
    """Bench, and the leg with one delay fitted."""
    bench = laboratory.bench(recording)
    start = settle(bench, bench.effects)
    effects = (*start.fit.effects, make_effect("position_delay", "knee", delay=DELAY))
    now = settle_again(bench, bench.refine(effects, start.noise, start=start.fit.parameters, only=len(bench.effects)))
    return bench, settle_again(bench, now.fit)


@pytest.mark.scenario
def test_delays_that_spread_are_told_from_one(laboratory):
    bench, now = delayed(laboratory, late(laboratory, LAG))
    after = with_their_lags(bench, now, len(bench.effects))
    found = after.fit.effects[-1]
    assert found.lag == pytest.approx(LAG, rel=0.1)
    assert found.delay == pytest.approx(DELAY, rel=0.02)
    assert after.fit.statistic / after.fit.dof < 1.3 < now.fit.statistic / now.fit.dof
    # what was found already is left
    assert with_their_lags(bench, after, len(bench.effects)) is after


@pytest.mark.scenario
def test_one_delay_stays_one(laboratory):
    bench, now = delayed(laboratory, late(laboratory, 0.0))
    assert with_their_lags(bench, now, len(bench.effects)) is now


@pytest.mark.scenario
def test_a_filtered_encoder_is_named_with_its_time_constant(laboratory, leg):
    """Beside one delay a coupling was named that is not there, with confidence."""
    recording, holdout = (late(laboratory, LAG, periods=p, seed=s, motion=m) for p, s, m in ((10, 3, 0), (6, 7, 1)))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        found = diagnose(identify(leg, recording, period=5.0), recording, holdout=holdout)
    assert found.verdict == "named"
    (missing,) = found.missing
    assert (missing.effect, missing.joint) == ("position_delay", "knee")
    delay, lag = missing.parameters
    assert delay.value == pytest.approx(DELAY, abs=4.0 * delay.std)
    assert lag.value == pytest.approx(LAG, abs=4.0 * lag.std)
    assert lag.std < 0.1 * LAG
    assert found.holdout.shrink > 0.9
    kept = next(effect for effect in found.model.effects if effect.name == "position_delay")
    assert kept.lag == pytest.approx(LAG, rel=0.1)


@pytest.mark.parametrize("closed", [True, False])
@pytest.mark.parametrize("lag", [0.0, 0.02])
def test_a_filter_is_taken_out_of_what_it_shows(leg, closed, lag):
    effect, knee = make_effect("position_delay", "knee", delay=0.03, lag=lag), leg.index("knee")
    time = np.arange(1000) / 200.0
    speed = 2.0 * np.pi / 5.0 * (np.arange(1, 4) if closed else np.array([0.7, 1.3, 2.1]))
    sizes = np.array([0.3, 0.2, 0.1])
    true = np.zeros((len(time), leg.n))
    true[:, knee] = np.sin(np.outer(time, speed)) @ sizes
    shown = effect.measured(leg, time, {"q": true, "theta": true})
    assert np.array_equal(shown["theta"], true)
    # the steady answer of the filter, by its gain and phase
    answer = np.exp(-1j * speed * (0.03 - lag)) / (1.0 + 1j * speed * lag)
    waves = np.exp(1j * np.outer(time, speed)) * sizes * answer
    away = slice(100, -100)
    np.testing.assert_allclose(shown["q"][away, knee], waves.imag.sum(axis=1)[away], atol=1e-9 if closed else 2e-5)
    rates = [shown["q"].copy() for _ in range(2)]
    for order, rate in enumerate(rates, 1):
        rate[:, knee] = (waves * (1j * speed) ** order).imag.sum(axis=1)
    seen = replace(Motion.rigid(time, shown["q"], *rates), theta=true)
    again = effect.corrected(leg, seen)
    np.testing.assert_allclose(again.q[away, knee], true[away, knee], atol=1e-9 if closed else 1e-4)


def test_a_spread_is_free_where_there_is_one():
    assert [shape.name for shape in make_effect("position_delay", "knee", delay=0.01).ranges] == ["delay"]
    assert [s.name for s in make_effect("position_delay", "knee", delay=0.01, lag=0.01).ranges] == ["delay", "lag"]
