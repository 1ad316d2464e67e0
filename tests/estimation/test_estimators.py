import warnings

import numpy as np
import pytest

from estimation.synthetic import record
from sea_ident.base_parameters import find_base_parameters
from sea_ident.effects import base_effects
from sea_ident.estimation import (
    InstrumentalVariables,
    JointWLS,
    LeastSquares,
    MaximumLikelihood,
    Observations,
    PerSampleWLS,
    Robust,
    identify,
)
from sea_ident.estimation.estimators.instrumental_variables import _invertible
from sea_ident.exceptions import IdentificationError, SeaIdentWarning
from sea_ident.processing import process

pytestmark = pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")


def values_over_seeds(leg, truth, estimators, seeds, harmonics=None, **noise):
    """Per estimator, (S, b) errors of the base parameters relative to eq. 13 of the first one and seed."""
    effects = base_effects(leg)
    base = find_base_parameters(leg, effects)
    exact, scale = base.project(truth.parameters), None
    found = {estimator: [] for estimator in estimators}
    for seed in seeds:
        recording = record(leg, truth, 8, seed=seed, **noise)
        processed = process(recording, leg, period=10.0, link_harmonics=harmonics, motor_harmonics=harmonics)
        observations = Observations(leg, effects, base, processed)
        for estimator in estimators:
            estimate = estimator.estimate(observations)
            scale = np.sqrt(np.diag(estimate.covariance)) if scale is None else scale
            found[estimator].append((estimate.values - exact) / scale)
    return {estimator: np.array(rows) for estimator, rows in found.items()}


def rms(values):
    return np.sqrt(np.mean(np.square(values)))


def test_spikes_do_not_spoil_the_robust_estimate(leg, coarse):
    recording = record(leg, coarse, 8, torque_noise=0.1)
    rng = np.random.default_rng(0)
    columns = {}
    for joint in leg.joint_names:
        torque = recording.columns[f"tau_motor_{joint}"].copy()
        torque[rng.choice(len(torque), 60, replace=False)] += 40.0 * rng.standard_normal(60)
        columns[f"tau_motor_{joint}"] = torque
    spiked = process(recording.replace_columns(columns), leg, period=10.0)
    clean = identify(leg, recording, period=10.0, estimator=PerSampleWLS())
    plain = identify(leg, spiked, estimator=LeastSquares())
    robust = identify(leg, spiked, estimator=Robust())
    exact = clean.base.project(coarse.parameters)
    assert np.abs((plain.values - exact) / clean.std).mean() > 5.0
    assert np.abs((robust.values - exact) / clean.std).mean() < 1.6
    # and it knows: its intervals are those of clean data, not of spiked data
    assert np.median(robust.std / clean.std) < 1.5
    assert np.median(plain.std / clean.std) > 4.0


@pytest.mark.scenario
def test_noise_in_the_regressor_biases_least_squares_but_not_instruments_nor_likelihood(leg, coarse):
    plain, instruments, simulated = (
        JointWLS(),
        InstrumentalVariables(),
        InstrumentalVariables(simulator=lambda observations, values: coarse.motion),
    )
    setting = {"harmonics": 80, "torque_noise": 0.05, "encoder_noise": 4e-4}
    found = values_over_seeds(leg, coarse, (plain, instruments, simulated), range(8), **setting)
    bias = {estimator: rms(rows.mean(axis=0)) for estimator, rows in found.items()}
    scatter = rms(found[instruments].std(axis=0)) / np.sqrt(8)
    assert bias[plain] > 3.5 * scatter
    assert bias[instruments] < 2.0 * scatter
    assert bias[simulated] < 1.6 * scatter
    likely = MaximumLikelihood(rounds=5)
    few = values_over_seeds(leg, coarse, (plain, likely), range(3), **setting)
    assert rms(few[likely].mean(axis=0)) < 0.6 * rms(few[plain].mean(axis=0))


def test_simulated_motion_must_have_the_samples_of_the_period(leg, coarse):
    wrong = InstrumentalVariables(simulator=lambda observations, values: coarse.motion[:10])
    with pytest.raises(IdentificationError, match="10 samples"):
        values_over_seeds(leg, coarse, (wrong,), [0], torque_noise=0.1)


def test_weighting_by_sample_beats_weighting_by_joint_where_noise_depends_on_the_phase(leg, coarse):
    joint, sample = JointWLS(), PerSampleWLS()
    found = values_over_seeds(leg, coarse, (joint, sample), range(10), torque_noise=0.05, reversal_noise=1.5)
    assert rms(found[sample]) < 0.8 * rms(found[joint])


def test_weighting_by_sample_costs_nothing_on_white_noise(leg, coarse):
    joint, smooth, raw = JointWLS(), PerSampleWLS(), PerSampleWLS(smoothing=0.0)
    found = values_over_seeds(leg, coarse, (joint, smooth, raw), range(12), torque_noise=0.2)
    assert rms(found[smooth]) < 1.02 * rms(found[joint])
    # the raw variance of eight periods is itself noise, and the weights follow it
    assert rms(found[smooth]) < rms(found[raw])


def test_one_period_falls_back_and_says_so(leg, truth):
    recording = record(leg, truth, 1, torque_noise=0.1)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        model = identify(leg, recording, period=10.0)
    texts = " ".join(str(w.message) for w in caught if issubclass(w.category, SeaIdentWarning))
    assert "one period only" in texts
    assert "correlation of the residual" in texts
    assert model.covariance_kind == "correlated residual"
    error = (model.values - model.base.project(truth.parameters)) / model.std
    assert np.sqrt(np.mean(error**2)) < 2.0


@pytest.mark.parametrize("estimator", [InstrumentalVariables(), MaximumLikelihood()], ids=lambda e: e.name)
def test_what_needs_periods_says_so(leg, truth, estimator):
    with pytest.raises(IdentificationError, match="at least two periods"):
        identify(leg, record(leg, truth, 1, torque_noise=0.1), period=10.0, estimator=estimator)


def test_samples_without_scatter_do_not_count_for_ever(leg, truth):
    recording = record(leg, truth, 4, torque_noise=0.1)
    columns = {}
    for joint in leg.joint_names:
        torque = recording.columns[f"tau_motor_{joint}"].reshape(4, -1).copy()
        torque[:, 300:500] = torque[0, 300:500]
        columns[f"tau_motor_{joint}"] = torque.ravel()
    dead = recording.replace_columns(columns)
    model = identify(leg, dead, period=10.0, estimator=PerSampleWLS(smoothing=0.0))
    assert any("no scatter" in text for text in model.warnings)
    error = (model.values - model.base.project(truth.parameters)) / np.abs(model.base.project(truth.parameters))
    assert np.abs(error).max() < 0.5


def test_columns_that_are_hardly_told_apart_are_uncertain_and_no_crash():
    rng = np.random.default_rng(4)
    columns = rng.standard_normal((200, 3))
    apart = columns.T @ columns
    assert _invertible(apart) is apart
    columns[:, 2] = 1e3 * columns[:, 1]
    cross = _invertible(columns.T @ columns)
    inverse = np.linalg.inv(cross)
    assert np.all(np.isfinite(inverse))
    # the one that is told keeps its variance, the pair is as good as unknown
    assert inverse[0, 0] == pytest.approx(np.linalg.inv(apart)[0, 0], rel=0.1)
    assert inverse[1, 1] > 1e6 * inverse[0, 0]
