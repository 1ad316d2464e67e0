"""Whitened columns in parts add up to those that are whitened as a whole."""

import numpy as np
import pytest

import sea_ident
from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.settle import settle
from sea_ident.discrepancy.bench.whitening import Whitening
from sea_ident.discrepancy.diagnose import model_effects
from sea_ident.discrepancy.measured.data import period_data, spectrum, wide_processing

PERIOD = 5.0


@pytest.fixture(scope="module")
def settled(laboratory, leg):
    recording = laboratory.record()
    model = sea_ident.identify(leg, recording, period=PERIOD)
    bench = Bench(period_data(wide_processing(recording, leg, PERIOD), leg), model_effects(model))
    return bench, settle(bench, bench.effects)


def test_parts_in_any_scale_add_up(settled):
    bench, now = settled
    whitening = bench.whitening(now.noise)
    rng = np.random.default_rng(5)
    shape = (bench.data.harmonics + 1, len(bench.data.equations), 3)
    values = rng.standard_normal(shape) + 1j * rng.standard_normal(shape)
    # only equations with a spring have a scale of their own
    scale = np.where(whitening.parts > 0, rng.uniform(0.2, 5.0, shape[1]), 1.0)
    assert np.count_nonzero(scale != 1.0) == 3
    parts = whitening.in_parts(values).scaled(whitening.factors(scale))
    np.testing.assert_allclose(parts, whitening.flat(values * scale[:, None]), atol=1e-9 * np.abs(parts).max())


def test_columns_of_a_model_are_those_of_its_effects_in_their_order(settled):
    bench, now = settled
    whitening, effects = bench.whitening(now.noise), now.fit.effects
    rng = np.random.default_rng(6)
    scale = np.where(whitening.parts > 0, rng.uniform(0.2, 5.0, len(whitening.parts)), 1.0)
    # a part of the model was asked for before
    parts = [whitening.design(chosen) for chosen in (effects[1::2], effects)][1]
    expected = whitening.flat(bench.design(effects) * scale[:, None])
    np.testing.assert_allclose(
        parts.scaled(whitening.factors(scale)), expected, atol=1e-9 * np.linalg.norm(expected, axis=0).max()
    )
    values = rng.standard_normal(expected.shape[1])
    torque = whitening.factors(scale) @ (parts @ values)
    np.testing.assert_allclose(torque, expected @ values, atol=1e-9 * np.abs(expected @ values).max())


def test_no_digit_depends_on_what_was_asked_for_before(settled):
    """Two processes that were asked for different things have to say the same of a model."""
    bench, now = settled
    whole, single = (Whitening(bench, now.noise.whitener(), bench._free) for _ in range(2))
    for effect in now.fit.effects:
        single.design([effect])
    parts = [each.design(now.fit.effects).scaled(each.factors(now.fit.scale)) for each in (whole, single)]
    np.testing.assert_array_equal(parts[0], parts[1])


def test_a_fit_says_the_same_of_its_residual_as_a_plain_projection(settled):
    bench, now = settled
    fit = now.fit
    target = spectrum(bench.data.target(bench.data.tau_motor), bench.data.harmonics)
    residual = target - bench.design(fit.effects) @ fit.values
    np.testing.assert_allclose(residual, fit.residual, atol=1e-9 * np.abs(target).max())
    whitened = bench.whitening(now.noise).flat(residual * fit.scale)
    np.testing.assert_allclose(whitened, fit.whitened, atol=1e-6 * np.abs(fit.whitened).max())
    assert bench.statistic(fit, now.noise) == pytest.approx(fit.statistic, rel=1e-9)


def test_a_noise_floor_is_applied_once(settled):
    bench, now = settled
    assert bench.whitening(now.noise) is bench.whitening(now.noise)
