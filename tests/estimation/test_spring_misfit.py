"""What a spring's law leaves is held against its noise: said where it is more, and counted in its intervals."""

import numpy as np
import pytest

from estimation.synthetic import leg_series, record
from sea_ident.effects import make_effect
from sea_ident.estimation import identify, identify_one_shot, read_model
from sea_ident.estimation.spring_misfit import spring_misfit
from sea_ident.estimation.uncertainty import CovarianceKind, Uncertainty
from sea_ident.processing import process
from sea_ident.simulation import PlantedEffect, simulate

pytestmark = pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")
NOISE = {"torque_noise": 0.2, "encoder_noise": 1e-5}


def drawn(rng, periods=10, samples=400, by_parameters=0.0, beyond=None, scatter=1.0, not_by_scatter=0.0):
    """A spring whose mean torque errs by noise of the samples and by two base parameters, as its periods show."""
    angle = 2.0 * np.pi * np.arange(samples) / samples
    columns = np.column_stack([np.sin(angle), np.sin(3.0 * angle), np.cos(angle)])
    # a part of what the parameters do is what the law does
    rows = np.column_stack([np.cos(2.0 * angle) + np.sin(angle), np.sin(5.0 * angle)])
    each = scatter * rng.standard_normal((periods, samples))
    moves = by_parameters * rng.standard_normal((periods, 2))
    influences = (moves - moves.mean(axis=0)) / periods
    covariance = influences.T @ influences * periods / (periods - 1.0)
    whole = covariance + not_by_scatter**2 * np.eye(2)
    known = Uncertainty(whole, periods - 1.0, CovarianceKind.PERIODS, influences, covariance)
    inverse = np.linalg.pinv(columns)
    mean = each.mean(axis=0) + rows @ moves.mean(axis=0) + (0.0 if beyond is None else beyond)
    left = mean - columns @ (inverse @ mean)
    return spring_misfit(left + each - each.mean(axis=0), inverse, columns, rows, known), inverse @ mean


@pytest.mark.scenario
@pytest.mark.parametrize("by_parameters", [0.0, 0.5, 1.0, 10.0])
def test_noise_alone_is_no_misfit_whatever_carries_it(by_parameters):
    rng = np.random.default_rng(5)
    found = [drawn(rng, by_parameters=by_parameters)[0] for _ in range(1000)]
    assert np.sqrt(np.mean([m.ratio**2 for m in found])) == pytest.approx(1.0, abs=0.25)
    # few base parameters that carry the noise make its energy vary by factors
    assert sum(m.covariance is not None for m in found) <= 20


@pytest.mark.parametrize("by_parameters", [0.0, 1.0])
def test_the_noise_is_what_the_mean_scatters_by(by_parameters):
    """With few samples the share that the law follows, and with few periods that of their mean, are large."""
    rng = np.random.default_rng(8)
    found = [drawn(rng, periods=5, samples=24, by_parameters=by_parameters)[0] for _ in range(1500)]
    noise, left = (
        np.mean([value(m) for m in found]) for value in (lambda m: m.noise**2, lambda m: (m.ratio * m.noise) ** 2)
    )
    assert left / noise == pytest.approx(1.0, abs=0.05)


def test_what_parameters_err_by_beyond_their_scatter_counts():
    plain, more = (drawn(np.random.default_rng(9), not_by_scatter=size)[0] for size in (0.0, 0.5))
    # the first column less what the law has of it leaves the wave that the law does not have; both have a power of half
    assert more.noise**2 - plain.noise**2 == pytest.approx(0.5**2 * (0.5 + 0.5), rel=1e-6)


def test_only_what_is_beyond_the_noise_is_counted():
    """The same mean residual with no scatter, and with one that is a third of its energy."""
    wave = np.sin(7.0 * 2.0 * np.pi * np.arange(400) / 400) + np.sin(3.02 * 2.0 * np.pi * np.arange(400) / 400)
    whole, part = (_of_a_wave(wave, scatter) for scatter in (1e-3, 1.4))
    share = 1.0 - 1.0 / part.ratio**2
    assert 0.5 < share < 0.8
    np.testing.assert_allclose(part.covariance, share * whole.covariance, rtol=1e-3, atol=1e-9)


def _of_a_wave(wave, scatter, periods=10):
    """The misfit of a law that lacks a wave, by periods that scatter about that very mean."""
    angle = 2.0 * np.pi * np.arange(len(wave)) / len(wave)
    columns = np.column_stack([np.sin(angle), np.sin(3.0 * angle), np.cos(angle)])
    inverse = np.linalg.pinv(columns)
    left = wave - columns @ (inverse @ wave)
    each = scatter * np.random.default_rng(4).standard_normal((periods, len(wave)))
    known = Uncertainty(np.zeros((1, 1)), 9.0, CovarianceKind.PERIODS, np.zeros((periods, 1)), np.zeros((1, 1)))
    rows = np.zeros((len(wave), 1))
    return spring_misfit(left + each - each.mean(axis=0), inverse, columns, rows, known)


def test_a_ratio_that_base_parameters_reach_by_chance_is_none_where_samples_carry_the_noise():
    rng = np.random.default_rng(6)
    wave = np.sin(7.0 * 2.0 * np.pi * np.arange(400) / 400)
    found, _ = drawn(rng, beyond=0.5 * wave)
    assert 1.3 < found.ratio < 2.0
    assert found.covariance is not None
    by_parameters = [drawn(rng, by_parameters=5.0)[0].ratio for _ in range(100)]
    assert max(by_parameters) > found.ratio


def test_what_is_left_counts_as_random():
    """A drift back and forth along the period, which the law does not have, moves its values by about what is said."""
    rng = np.random.default_rng(7)
    errors, said = [], []
    for _ in range(200):
        beyond = np.cumsum(rng.standard_normal(40)).repeat(10)
        beyond -= np.linspace(beyond[0], beyond[-1], 400)
        found, values = drawn(rng, beyond=beyond - beyond.mean())
        errors.append(values)
        said.append(np.zeros(3) if found.covariance is None else np.diag(found.covariance))
    actual, stated = np.sqrt(np.mean(np.square(errors), axis=0)), np.sqrt(np.mean(said, axis=0))
    assert np.all(stated < 2.0 * actual)
    # of what is as slow as the law itself most is taken for it; the third harmonic has it beside itself
    assert stated[1] > 0.5 * actual[1]


def test_a_clean_leg_leaves_no_more_than_noise(leg, coarse):
    for seed in range(4):
        model = identify(leg, record(leg, coarse, 8, seed=seed, **NOISE), period=10.0)
        for spring in model.springs:
            assert spring.misfit == ()
            assert spring.doubt() is None
            assert 0.5 < spring.rms_residual / spring.noise < 1.6
        assert not any("its law leaves" in text for text in model.warnings)


def test_one_period_has_no_noise_to_compare_with(leg, coarse):
    model = identify(leg, record(leg, coarse, 1, **NOISE), period=10.0)
    assert [spring.noise for spring in model.springs] == [None] * 3
    assert [spring.doubt() for spring in model.springs] == [None] * 3


@pytest.fixture(scope="module")
def slipping(leg):
    effect = PlantedEffect(make_effect("spring_hysteresis", "knee", slip=0.004), np.array([2.0, 1.0]))
    recording = simulate(leg, leg_series(), periods=6, seed=3, effects=(effect,)).recording
    return process(recording, leg, period=leg_series().period)


@pytest.mark.scenario
def test_a_spring_that_lacks_something_says_so_and_its_intervals_hold_the_truth(leg, slipping, tmp_path):
    model = identify(leg, slipping)
    springs = {spring.joint: spring for spring in model.springs}
    knee = springs["knee"]
    assert [joint for joint, spring in springs.items() if spring.doubt()] == ["knee"]
    told = [text for text in model.warnings if "its law leaves" in text]
    assert told == [knee.doubt()]
    assert told[0].startswith(f"spring of knee: its law leaves {knee.rms_residual / knee.noise:.2g} times the noise")
    truth = leg.spring("knee")
    without = np.sqrt(np.diag(np.array(knee.covariance) - np.array(knee.misfit)))
    assert abs(knee.stiffness - truth.stiffness) < 4.0 * knee.stiffness_std
    assert abs(knee.stiffness - truth.stiffness) > 10.0 * without[0]
    assert np.sqrt(np.array(knee.covariance)[0, 0]) == knee.stiffness_std
    model.save(tmp_path / "m.json")
    again = next(spring for spring in read_model(tmp_path / "m.json").springs if spring.joint == "knee")
    assert (again.noise, again.misfit) == (knee.noise, knee.misfit)
    assert again.doubt() == knee.doubt()


@pytest.mark.scenario
def test_one_shot_counts_it_too(leg, slipping):
    knee = next(spring for spring in identify_one_shot(leg, slipping).springs if spring.joint == "knee")
    assert knee.doubt() is not None
    assert knee.stiffness_std >= np.sqrt(np.array(knee.misfit)[0, 0])


@pytest.mark.scenario
def test_with_the_effect_nothing_is_left(leg, slipping):
    effects = (*identify(leg, slipping).effects, make_effect("spring_hysteresis", "knee", slip=0.004))
    model = identify(leg, slipping, effects=effects)
    assert not any("its law leaves" in text for text in model.warnings)
