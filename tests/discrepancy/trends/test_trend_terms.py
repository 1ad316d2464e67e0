"""What a model holds of a trend: none in the mean of the recording."""

import numpy as np
import pytest

from sea_ident.discrepancy.bench.settle import settle
from sea_ident.discrepancy.trends.trend import Trend
from sea_ident.discrepancy.trends.trend_terms import trend_terms
from sea_ident.effects import make_effect
from sea_ident.effects.drift import warming


def trend(name, *values, **shape):
    numbers = np.array(values)
    return Trend(make_effect(name, "knee", **shape), numbers, 0.1 * np.abs(numbers), 100.0, 1e-9, 0.02)


@pytest.fixture(scope="module")
def settled(laboratory):
    bench = laboratory.bench(laboratory.record(periods=12))
    return bench, settle(bench, bench.effects).fit


@pytest.mark.scenario
def test_a_drift_is_none_in_the_mean_of_the_recording_and_has_the_smoothing_of_the_model(settled):
    bench, fit = settled
    (term,) = trend_terms(bench, fit, [trend("friction_drift", 0.1, 0.5, time_constant=30.0)])
    time = (np.arange(12 * bench.data.samples) + 0.5) / bench.data.samples * bench.data.period
    assert np.mean(term.effect.change(time, None)) == pytest.approx(0.0, abs=1e-9)
    assert (term.values, term.stds) == ((0.1, 0.5), (0.1 * 0.1, 0.1 * 0.5))
    coulomb = next(e for e in fit.effects if (e.name, e.joint) == ("coulomb_friction", "knee"))
    assert term.effect.smoothing == coulomb.smoothing


@pytest.mark.scenario
def test_a_share_of_a_torque_that_drifts_itself_is_that_of_the_mean(settled):
    """Of what was recorded a share v w(t) is lost: of what is there in the mean it is (w(t) - w) v / (1 - v w)."""
    bench, fit = settled
    (term,) = trend_terms(bench, fit, [trend("torque_constant_drift", 0.4, time_constant=30.0)])
    time = (np.arange(12 * bench.data.samples) + 0.5) / bench.data.samples * bench.data.period
    lost = warming(time, 30.0)
    level = np.mean(lost)
    (value,), (std,) = term.values, term.stds
    assert value == pytest.approx(0.4 / (1.0 - 0.4 * level), rel=1e-9)
    np.testing.assert_allclose(
        (1.0 - 0.4 * lost) / (1.0 - 0.4 * level), 1.0 - value * term.effect.change(time, None), atol=1e-12
    )
    moved = 0.4 * (1.0 + 1e-6)
    assert std == pytest.approx(0.1 * (moved / (1.0 - moved * level) - value) / 1e-6, rel=1e-4)
    # and knows the friction and the spring of its motor
    assert term.effect.coulomb == pytest.approx(fit.parameters["knee.coulomb_friction"])


@pytest.mark.scenario
def test_what_is_told_as_nothing_is_as_unsure_as_before(settled):
    bench, fit = settled
    found = Trend(make_effect("friction_drift", "knee"), np.array([0.0, 0.5]), np.array([0.1, 0.05]), 100.0, 1e-9, 0.02)
    (term,) = trend_terms(bench, fit, [found])
    assert term.stds == (0.1, 0.05)


@pytest.mark.scenario
def test_friction_by_temperature_is_none_at_the_mean_temperature(settled):
    bench, fit = settled
    temperature = np.full((12, 3), 20.0) + np.linspace(0.0, 11.0, 12)[:, None]
    (term,) = trend_terms(bench, fit, [trend("temperature_friction", 0.0, 0.1)], temperature)
    assert term.effect.reference == pytest.approx(25.5)
    assert trend_terms(bench, fit, []) == ()
