"""What trends do to the mean of the periods, against truth."""

from dataclasses import replace

import numpy as np
import pytest

from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.settle import settle
from sea_ident.discrepancy.measured.closing import closing_weights, mean_of_periods
from sea_ident.discrepancy.trends import trend_within
from sea_ident.discrepancy.trends.trend import Trend, compare_periods
from sea_ident.discrepancy.trends.trend_within import within_periods
from sea_ident.effects import make_effect

KNEE = 2  # equation of the motor of the knee


@pytest.fixture(scope="module")
def softening(laboratory):
    """Bench and settled model of a leg whose hip spring loses a third of its stiffness within a minute."""
    bench = laboratory.bench(laboratory.record([("stiffness_drift", "hip", [-150.0], {})], periods=12))
    return bench, settle(bench, bench.effects)


def in_the_mean(data, each):
    """(N,) mean of what grows by one in every period times (N, P) what each has, without the mean of that growth."""
    time = np.arange(data.periods) + ((np.arange(data.samples) + 0.5) / data.samples)[:, None]
    weights = closing_weights(range(data.periods), data.samples)
    return np.sum(weights * (time - np.mean(np.sum(weights * time, axis=1))) * each, axis=1)


def beyond_the_mean(data, each, law):
    """(N,) mean of a law of signals (N, P) of the periods, beyond that of their mean."""
    weights = closing_weights(range(data.periods), data.samples)
    return np.sum(weights * law(each), axis=1) - law(np.sum(weights * each, axis=1))


def of_trends_alone(monkeypatch, *given):
    """The torque of trends, without what all else does on a motion that drifts."""
    with monkeypatch.context() as held:
        held.setattr(trend_within, "_on_a_motion_that_drifts", lambda *_: 0.0)
        return within_periods(*given)


@pytest.mark.scenario
def test_a_drift_within_a_period_is_no_effect_of_its_own(softening, monkeypatch):
    """Stiffness that falls all the time is lower at the end of every period: that alone lies far beyond the noise."""
    bench, now = softening
    trends = compare_periods(bench, now.fit).trends
    assert [(t.effect.name, t.effect.joint) for t in trends] == [("stiffness_drift", "hip")]
    known = within_periods(bench, now.fit, trends)
    less = Bench(replace(bench.data, known=known), bench.effects)
    then = settle(less, less.effects)
    assert then.fit.statistic < now.fit.statistic
    assert then.fit.statistic / then.fit.dof == pytest.approx(1.0, abs=0.2)
    # each period's stiffness on its own deflection, but for their means, opposite in the two equations of the hip
    deflections = np.stack([motion.deflection[:, 0] for motion in bench.data.period_motions], axis=1)
    torque = -150.0 * bench.data.period / 60.0 * in_the_mean(bench.data, deflections)
    alone = of_trends_alone(monkeypatch, bench, now.fit, trends)
    np.testing.assert_allclose(alone[:, 0], torque, rtol=0.1, atol=2e-3)
    np.testing.assert_allclose(alone[:, 1], -alone[:, 0])
    np.testing.assert_array_equal(alone[:, 2:], 0.0)
    # and what stiffens in it, on deflections that grow
    stiffening = now.fit.parameters["hip.spring_stiffening"]
    torque += stiffening * beyond_the_mean(bench.data, deflections, lambda deflection: deflection**3)
    np.testing.assert_allclose(known[:, 1], -torque, rtol=0.1, atol=2e-3)


@pytest.mark.scenario
def test_where_the_motion_drifts_with_its_torque_the_mean_of_the_product_is_not_that_of_the_means(
    laboratory, monkeypatch
):
    """A motor that turns later from pass to pass while its friction grows: no friction of the mean motion does that."""
    data = laboratory.data(laboratory.record(periods=8))
    later = [
        replace(motion, dtheta=motion.dtheta + 0.05 * (p - 3.5 - 0.2 * (p - 3.5) ** 2) * np.array([0.0, 1.0, 0.0]))
        for p, motion in enumerate(data.period_motions)
    ]
    mean, _ = mean_of_periods(later, data.period_tau_motor, range(8))
    drifting = replace(data, motion=mean, period_motions=tuple(later))
    bench = Bench(drifting, laboratory.effects)
    now = settle(bench, bench.effects)
    effect = bench.anchored(
        (*now.fit.effects, make_effect("friction_drift", "knee", time_constant=1e8)), now.fit.parameters
    )[-1]
    trend = Trend(effect, np.array([0.0, 0.6]), np.zeros(2), 1.0, 0.0, 0.1)
    known = within_periods(bench, now.fit, [trend])
    signs = np.stack([np.tanh(motion.dtheta[:, 1] / effect.smoothing) for motion in later], axis=1)
    expected = 0.6 * data.period / 60.0 * in_the_mean(drifting, signs)
    alone = of_trends_alone(monkeypatch, bench, now.fit, [trend])
    np.testing.assert_allclose(alone[:, KNEE], expected, rtol=1e-6, atol=1e-9)
    # another trend of the same course tells no more of how the motion goes
    twice = within_periods(bench, now.fit, [trend, replace(trend, values=np.zeros(2))])
    np.testing.assert_allclose(twice, known, atol=1e-9)
    # much of it is what the mean motion has nothing of
    means = 0.6 * data.period / 60.0 * in_the_mean(drifting, np.repeat(signs.mean(axis=1, keepdims=True), 8, axis=1))
    assert np.linalg.norm(means - expected) > 0.5 * np.linalg.norm(expected)


def test_friction_that_does_not_drift_on_a_motor_that_turns_later_and_later(laboratory):
    """Its mean over the periods is not that on their mean motion: to the last digits where nothing goes by chance."""
    usual = laboratory.bench(laboratory.record(periods=8))
    fit, data = settle(usual, usual.effects).fit, usual.data
    later = [
        replace(data.motion, dtheta=data.motion.dtheta + 0.05 * (p - 0.2 * p**2) * np.array([0.0, 1.0, 0.0]))
        for p in range(8)
    ]
    mean, _ = mean_of_periods(later, data.period_tau_motor, range(8))
    bench = Bench(replace(data, motion=mean, period_motions=tuple(later)), laboratory.effects)
    effect = make_effect("friction_drift", "hip", time_constant=1e8)
    known = within_periods(bench, fit, [Trend(effect, np.zeros(2), np.zeros(2), 1.0, 0.0, 0.1)])
    speeds = np.stack([motion.dtheta[:, 1] for motion in later], axis=1)
    smoothing = next(e.smoothing for e in fit.effects if (e.name, e.joint) == ("coulomb_friction", "knee"))
    turned = beyond_the_mean(bench.data, speeds, lambda speed: np.tanh(speed / smoothing))
    expected = fit.parameters["knee.coulomb_friction"] * turned
    assert np.max(np.abs(expected)) > 0.1
    np.testing.assert_allclose(known[:, KNEE], expected, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(np.delete(known, KNEE, axis=1), 0.0, atol=1e-9)


def test_a_measured_temperature_is_drawn_through_the_periods(laboratory, monkeypatch):
    """Friction of a motor that warms up: its course within a period is that of the temperature, not of a time."""
    bench = laboratory.bench(laboratory.record(periods=8))
    now = settle(bench, bench.effects)
    effect = bench.anchored((*now.fit.effects, make_effect("temperature_friction", "knee")), now.fit.parameters)[-1]
    trend = Trend(effect, np.array([0.0, 0.1]), np.zeros(2), 1.0, 0.0, 0.1)
    temperature = np.tile(25.0 + 2.0 * np.arange(8.0)[:, None], (1, 3))
    known = of_trends_alone(monkeypatch, bench, now.fit, [trend], temperature)
    signs = np.stack([np.tanh(motion.dtheta[:, 1] / effect.smoothing) for motion in bench.data.period_motions], axis=1)
    np.testing.assert_allclose(known[:, KNEE], 0.1 * 2.0 * in_the_mean(bench.data, signs), atol=1e-12)
