"""How friction turns over is not known: what that does to an estimate is in its standard deviations."""

from dataclasses import replace

import numpy as np
import pytest

from estimation.synthetic import leg_series, record, truth_of
from sea_ident.base_parameters import find_base_parameters
from sea_ident.effects import base_effects
from sea_ident.estimation import LeastSquares, Observations, identify
from sea_ident.estimation.turning import turning_covariance
from sea_ident.processing import process
from sea_ident.regressor import build_total

pytestmark = pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")


def turning_at(leg, factor):
    """The effects of a leg with all friction turning over at another speed."""
    return tuple(
        replace(effect, smoothing=factor * effect.smoothing) if effect.name == "coulomb_friction" else effect
        for effect in base_effects(leg)
    )


def friction_of(names):
    return np.array(["friction" in name for name in names])


@pytest.mark.parametrize("factor", [0.5, 1.0, 2.0])
def test_friction_that_turns_over_at_another_speed_is_recovered_within_its_standard_deviations(leg, factor):
    """Half or twice the speed of the model: without it the friction would be off by far more than it says."""
    truth = truth_of(leg, leg_series(), samples=1000, effects=turning_at(leg, factor))
    model = identify(leg, record(leg, truth, 12, torque_noise=0.02), period=10.0)
    error = np.abs(model.values - model.base.project(truth.parameters))
    friction, repeated = friction_of(model.base.names), np.sqrt(np.diag(model.uncertainty.repeatability))
    assert np.all(error[friction] < 3.0 * model.std[friction])
    if factor == 2.0:
        assert np.max(error[friction] / repeated[friction]) > 10.0
    if factor == 1.0:
        # what the data show to be right costs next to nothing
        assert np.median(model.std / repeated) < 1.1


@pytest.fixture(scope="module", params=[0.1, 0.7], ids=["told", "open"])
def estimated(leg, request):
    """Observations of a leg, its estimate by least squares, and the residuals of its periods without their mean.

    With little noise the data tell how friction turns over, with much they leave it open.
    """
    effects = base_effects(leg)
    truth = truth_of(leg, leg_series(), samples=500)
    processed = process(record(leg, truth, 10, torque_noise=request.param), leg, period=10.0)
    observations = Observations(leg, effects, find_base_parameters(leg, effects), processed)
    estimate = LeastSquares().estimate(observations)
    residuals = observations.period_residuals(estimate.values)
    return observations, estimate, residuals - residuals.mean(axis=0)


def change_of(observations, joint, values):
    """Torque of the friction of a joint where it turns over at another speed, as it is held to be uncertain."""
    motion, k = observations.processed.motion, observations.base.names.index(f"{joint}.coulomb_friction")
    (own,) = [e for e in observations.effects if e.name == "coulomb_friction" and e.joint == joint]
    fast, slow = (
        build_total(observations.robot, (replace(own, smoothing=factor * own.smoothing),), motion)[:, :, 0]
        for factor in (2.0, 0.5)
    )
    return 0.5 * (fast - slow) * values[k]


def test_it_is_how_far_the_estimate_moves_by_as_much_as_the_data_leave_open(estimated):
    """Against the posterior of one more parameter for every joint, with the scatter of its amount between periods."""
    observations, estimate, residuals = estimated
    mean = np.random.default_rng(2).normal(0.0, 0.4, observations.torque.shape)
    expected = np.zeros_like(estimate.covariance)
    for joint in observations.robot.joint_names:
        change = change_of(observations, joint, estimate.values)
        moves = estimate.inverse @ np.tensordot(estimate.instruments, change, axes=((0, 1), (0, 1)))
        left = change - observations.rows @ moves
        weights = estimate.weights * left / np.sum(estimate.weights * left**2)
        # the noise is white: periods have no memory that softened borders would have to deal with
        each = np.array([np.sum(weights * own) for own in residuals])
        variance = np.var(each, ddof=1) / len(each)
        information = 1.0 + 1.0 / variance
        told = np.sum(weights * mean) / variance / information
        expected += np.outer(moves, moves) * (told**2 + 1.0 / information)
    found = turning_covariance(observations, estimate, mean, residuals)
    np.testing.assert_allclose(np.sqrt(np.diag(found)), np.sqrt(np.diag(expected)), rtol=0.1)
    assert np.linalg.matrix_rank(found, tol=1e-9 * np.abs(found).max()) <= 3


def test_the_estimate_moves_so_where_the_torque_changes(estimated):
    observations, estimate, _ = estimated
    change = change_of(observations, "knee", estimate.values)
    processed = observations.processed
    changed = replace(observations, processed=replace(processed, tau_motor=processed.tau_motor + change))
    moves = LeastSquares().estimate(changed).values - estimate.values
    residual = 1e3 * (change - observations.rows @ moves)
    quiet = np.tile(np.random.default_rng(3).normal(0.0, 1e-9, change.shape), (10, 1, 1))
    # a residual with a thousand of it and no scatter says that it is a thousand, of the knee
    found = turning_covariance(observations, estimate, residual, quiet - quiet.mean(axis=0))
    own = np.abs(moves) > 0.01 * np.abs(moves).max()
    np.testing.assert_allclose(np.sqrt(np.diag(found))[own], 1e3 * np.abs(moves[own]), rtol=0.02)


def test_what_does_not_turn_over_adds_nothing(leg, estimated):
    observations, _, residuals = estimated
    bodies = tuple(e for e in base_effects(leg) if e.name != "coulomb_friction")
    without = replace(observations, effects=bodies, base=find_base_parameters(leg, bodies))
    few = LeastSquares().estimate(without)
    assert not turning_covariance(without, few, np.zeros_like(without.torque), residuals).any()
