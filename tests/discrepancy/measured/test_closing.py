"""Means and steps of periods that close: noise that is differentiated does not jump where a period was cut out."""

import numpy as np
import pytest

from sea_ident.discrepancy.measured.closing import closing_weights, mean_of_periods, successive
from sea_ident.discrepancy.measured.data import spectrum
from sea_ident.discrepancy.measured.noise import closed_freedom, closed_freedom_of_many
from sea_ident.motion import Motion

SAMPLES = 400


def rough(rng, periods):
    """(N, P) the second derivative of noise of up to 60 harmonics of a period, over a whole recording."""
    frequency = np.fft.rfftfreq(periods * SAMPLES, 1.0 / SAMPLES)
    white = np.fft.rfft(rng.standard_normal(periods * SAMPLES))
    whole = np.fft.irfft(np.where(frequency < 60.0, -(frequency**2) * white, 0.0))
    return whole.reshape(periods, SAMPLES).T


def low(values):
    """Mean power in harmonics 2 to 8 of what is periodic, as a share of all."""
    power = np.abs(spectrum(values, 100)) ** 2
    return float(power[2:9].sum() / power.sum())


@pytest.mark.parametrize("places", [range(8), (0, 1, 2, 3, 5, 6, 7, 8, 11, 12)])
def test_a_mean_ends_with_what_it_begins_with(places):
    """A path that goes on and on: the plain mean jumps by all that it goes in a period, over their number."""
    path = np.cumsum(np.random.default_rng(3).standard_normal(20)).repeat(SAMPLES)
    path = np.convolve(np.pad(path, 150, mode="edge"), np.ones(301) / 301.0, mode="valid").reshape(20, SAMPLES).T
    values = path[:, list(places)]
    weights = closing_weights(places, SAMPLES)
    np.testing.assert_allclose(weights.sum(axis=1), 1.0)
    mean = np.sum(weights * values, axis=1)
    step = np.abs(np.diff(np.concatenate([mean, mean[:1]])))
    assert step[-1] <= 1.02 * step[:-1].max()
    plain = values.mean(axis=1)
    assert abs(plain[-1] - plain[0]) > 20.0 * step[-1]


def test_it_is_as_noisy_as_it_says(nothing_missing):
    data = nothing_missing[0].data
    rng = np.random.default_rng(4)
    torque = rng.standard_normal((data.periods, data.samples, 300))
    motion = Motion(*[np.zeros(data.samples)] + [np.zeros((data.samples, 1))] * 6)
    mean = mean_of_periods([motion] * data.periods, torque, range(data.periods))[1]
    assert np.mean(mean**2) == pytest.approx(1.0 / data.averaged, rel=0.02)
    assert data.periods - 0.6 < data.averaged < data.periods - 0.2


def test_few_periods_are_averaged_as_they_are():
    np.testing.assert_allclose(closing_weights(range(5), SAMPLES), 0.2)
    values = np.random.default_rng(5).standard_normal((SAMPLES, 5))
    np.testing.assert_allclose(successive(values, range(5)), np.diff(values, axis=1) / np.sqrt(2.0))


def test_steps_have_the_energy_of_periods_at_every_phase():
    values = np.random.default_rng(6).standard_normal((SAMPLES, 20000))
    power = np.mean(successive(values, range(20000)) ** 2, axis=1)
    np.testing.assert_allclose(power, 1.0, atol=0.06)


@pytest.mark.parametrize("number", [5, 8, 20])
def test_degrees_of_freedom_of_steps_that_close(number):
    """Twice the squared mean over the variance of the estimate along a direction, from many draws."""
    draws, samples = 3000, 50
    values = np.random.default_rng(8).standard_normal((samples, number + 2, draws))
    along = successive(values, range(number + 2)).sum(axis=0)
    estimate = np.mean(along**2, axis=0)
    assert closed_freedom(number) == pytest.approx(2.0 * np.mean(estimate) ** 2 / np.var(estimate), rel=0.1)


@pytest.mark.parametrize("number", [5, 8, 20])
def test_degrees_of_freedom_of_steps_that_close_over_many_directions(number):
    """The same of the mean over all samples of a period: each has a phase of its own."""
    draws, samples = 3000, 50
    values = np.random.default_rng(9).standard_normal((samples, number + 2, draws))
    estimate = np.mean(successive(values, range(number + 2)) ** 2, axis=(0, 1))
    found = 2.0 * np.mean(estimate) ** 2 / np.var(estimate) / samples
    assert closed_freedom_of_many(number) == pytest.approx(found, rel=0.1)


def test_noise_that_is_differentiated_does_not_leak_into_low_harmonics():
    """A second derivative has hardly any power there; periods as they are cut have what jumps at their ends."""
    rng, periods = np.random.default_rng(7), 12
    shares = []
    for _ in range(20):
        values = rough(rng, periods)
        plain = low(np.diff(values, axis=1))
        mean = np.sum(closing_weights(range(periods), SAMPLES) * values, axis=1)
        shares.append((plain, low(successive(values, range(periods))), low(mean)))
    cut, steps, mean = np.mean(shares, axis=0)
    # twenty means in fourteen numbers each: to 0.06 of the noise
    assert steps == pytest.approx(mean, rel=0.25)
    assert cut > 5.0 * steps


def test_nothing_is_compared_across_a_gap():
    values = np.zeros((SAMPLES, 12))
    values[:, 7:] = 1.0
    places = (*range(7), *range(9, 14))
    steps = successive(values, places)
    assert steps.shape == (SAMPLES, 8)
    np.testing.assert_array_equal(steps, 0.0)
