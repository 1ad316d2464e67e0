import numpy as np
import pytest

from estimation.synthetic import record
from sea_ident.base_parameters import find_base_parameters
from sea_ident.effects import base_effects
from sea_ident.estimation import CovarianceKind, InstrumentalVariables, LeastSquares, Observations, identify
from sea_ident.estimation.uncertainty import honest_uncertainty
from sea_ident.processing import process

pytestmark = pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")


def coverage(leg, truth, seeds, periods=8, **noise):
    """Shares of 95 % intervals that hold the truth: as reported, and by eq. 13."""
    effects = base_effects(leg)
    base = find_base_parameters(leg, effects)
    inside, inside_model = [], []
    for seed in range(seeds):
        processed = process(record(leg, truth, periods, seed=seed, **noise), leg, period=10.0)
        observations = Observations(leg, effects, base, processed)
        estimate = InstrumentalVariables().estimate(observations)
        error = np.abs(estimate.values - base.project(truth.parameters))
        inside.append(error <= honest_uncertainty(observations, estimate).half_width())
        inside_model.append(error <= 1.96 * np.sqrt(np.diag(estimate.covariance)))
    return np.mean(inside), np.mean(inside_model)


def test_intervals_hold_the_truth_under_white_noise(leg, coarse):
    reported, model = coverage(leg, coarse, 30, torque_noise=0.2)
    assert 0.92 <= reported <= 0.98
    assert 0.90 <= model <= 0.98


def test_coloured_noise_deceives_eq_13_but_not_the_periods(leg, coarse):
    reported, model = coverage(leg, coarse, 20, torque_noise=0.2, correlation=0.98)
    assert 0.90 <= reported <= 0.985
    assert model < 0.75


def test_the_disagreement_is_told(leg, coarse):
    recording = record(leg, coarse, 12, torque_noise=0.2, correlation=0.98)
    model = identify(leg, recording, period=10.0)
    assert any("eq. 13" in text for text in model.warnings)
    assert model.covariance_kind is CovarianceKind.PERIODS


def test_few_periods_are_judged_piece_by_piece(leg, coarse):
    model = identify(leg, record(leg, coarse, 3, torque_noise=0.2), period=10.0)
    assert model.covariance_kind is CovarianceKind.BLOCKS
    reported, _ = coverage(leg, coarse, 20, periods=3, torque_noise=0.2)
    assert 0.90 <= reported <= 0.99


def drifting(leg, coarse, seed, size):
    """Three periods; the torque of every joint has another gain in each of them."""
    recording = record(leg, coarse, 3, seed=seed, torque_noise=0.2)
    rng = np.random.default_rng(1000 + seed)
    columns = {}
    for joint in leg.joint_names:
        torque = recording.columns[f"tau_motor_{joint}"]
        columns[f"tau_motor_{joint}"] = torque * np.repeat(1.0 + size * rng.standard_normal(3), len(torque) // 3)
    return recording.replace_columns(columns)


def test_a_gain_that_drifts_from_period_to_period_is_inside_the_intervals_of_few_periods(leg, coarse):
    inside = []
    for seed in range(12):
        model = identify(leg, drifting(leg, coarse, seed, 0.01), period=10.0)
        error = np.abs(model.values - model.base.project(coarse.parameters))
        inside.append(error <= model.uncertainty.half_width())
    assert np.mean(inside) > 0.88


@pytest.mark.scenario
def test_nothing_drifts(leg, coarse):
    told = [
        any("whole periods differ" in text for text in identify(leg, drifting(leg, coarse, seed, 0.0)).warnings)
        for seed in range(12)
    ]
    assert np.mean(told) < 0.3


@pytest.mark.scenario
def test_stated_deviations_match_the_scatter_between_repeats(leg, coarse):
    models = [
        identify(leg, record(leg, coarse, 10, seed=seed, torque_noise=0.2, reversal_noise=0.5), period=10.0)
        for seed in range(12)
    ]
    scatter = np.std([m.values for m in models], axis=0, ddof=1)
    stated = np.sqrt(np.mean([m.std**2 for m in models], axis=0))
    assert np.median(stated / scatter) == pytest.approx(1.0, abs=0.25)


def test_what_the_model_lacks_widens_the_intervals(leg, truth):
    recording = record(leg, truth, 10, torque_noise=0.05)
    ripple = 0.5 * np.sin(7.0 * recording.columns["theta_hip"])
    bent = recording.replace_columns({"tau_motor_hip": recording.columns["tau_motor_hip"] + ripple})
    good = identify(leg, recording, period=10.0)
    bad = identify(leg, bent, period=10.0, estimator=LeastSquares())
    assert bad.covariance_kind is CovarianceKind.REMAINDER
    assert any("the model lacks something" in text for text in bad.warnings)
    exact = good.base.project(truth.parameters)
    alone = np.sqrt(np.diag(bad.uncertainty.repeatability))
    assert np.abs((bad.values - exact) / alone).max() > 10.0
    assert np.mean(np.abs(bad.values - exact) <= bad.uncertainty.half_width()) > 0.5


def test_what_is_left_counts_though_it_is_too_little_to_be_told(leg, truth):
    """A ripple of less than the noise of the mean: no warning, and wider intervals where it moves the estimate."""
    recording = record(leg, truth, 10, torque_noise=0.4)
    ripple = 0.07 * np.sin(7.0 * recording.columns["theta_hip"])
    bent = recording.replace_columns({"tau_motor_hip": recording.columns["tau_motor_hip"] + ripple})
    plain, more = (identify(leg, each, period=10.0, estimator=LeastSquares()) for each in (recording, bent))
    assert plain.covariance_kind is more.covariance_kind is CovarianceKind.PERIODS
    assert not any("the model lacks something" in text for text in more.warnings)
    np.testing.assert_allclose(more.uncertainty.repeatability, plain.uncertainty.repeatability, rtol=0.01)
    hip = [name.startswith(("hip.", "thigh.")) for name in more.names]
    assert np.max((more.std / plain.std)[hip]) > 1.1
