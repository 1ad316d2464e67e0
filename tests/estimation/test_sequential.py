"""A recording that leaves parameters unknown, the excitation designed for them, and the estimate from both."""

from dataclasses import replace

import numpy as np
import pytest

from estimation.synthetic import record, truth_of
from sea_ident.effects import base_effects
from sea_ident.estimation import identify, information_about, what_is_known
from sea_ident.excitation import design_excitation, reduced_effects
from sea_ident.motion import FourierSeries

pytestmark = pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")

HOW = {"harmonics": 5, "starts": 4, "rate": 50.0, "seed": 0, "jobs": 1}
NOISE = 0.2
SECOND = 3
"""Periods of the second recording; the first has twenty."""


@pytest.fixture(scope="module")
def campaign(leg):
    """Identifies the second recording of a series, alone and with the first, in which the ankle hardly moved."""
    limits, ankle = leg.limits, np.array([False, False, True])
    held = replace(limits, lower=np.where(ankle, -0.02, limits.lower), upper=np.where(ankle, 0.02, limits.upper))
    first = design_excitation(leg, limits=held, **HOW).series
    effects, truths = base_effects(leg), {}

    def recorded(series, periods, seed):
        key = series.coefficients.tobytes()
        truths.setdefault(key, truth_of(leg, series, samples=1000))
        return record(leg, truths[key], periods, seed=seed, torque_noise=NOISE, encoder_noise=1e-5)

    before = identify(leg, recorded(first, 20, 1), period=10.0, effects=effects)

    def after(series):
        recording = recorded(series, SECOND, 2)
        alone = identify(leg, recording, period=10.0, effects=effects)
        return alone, identify(leg, recording, period=10.0, effects=effects, prior=before)

    return first, before, after


@pytest.fixture(scope="module")
def sequential(leg, campaign):
    _, before, after = campaign
    noise = np.full(3, NOISE / np.sqrt(SECOND))
    information = information_about(before, reduced_effects(leg))
    return after(design_excitation(leg, information=information, noise=noise, **HOW).series)


def expected_std(before, alone):
    """Standard deviations of both recordings together under eq. 13, which have no chance in them."""
    together = np.linalg.inv(before.model_covariance) + np.linalg.inv(alone.model_covariance)
    return dict(zip(before.names, np.sqrt(np.diag(np.linalg.inv(together))), strict=True)), np.linalg.slogdet(together)[
        1
    ]


WEAK = ("foot.mz", "foot.Iyy", "ankle.viscous_friction", "ankle.coulomb_friction")


def test_the_first_recording_says_what_it_does_not_tell(campaign):
    _, before, _ = campaign
    known = what_is_known(before)
    assert known.weakest[0][0] in WEAK
    assert known.weakest_percent > 20.0


def test_the_designed_recording_beats_another_of_the_first(campaign, sequential):
    first, before, after = campaign
    repeated, _ = after(first)
    designed, determinant = expected_std(before, sequential[0])
    again, usual = expected_std(before, repeated)
    for name in WEAK:
        assert designed[name] < again[name] / 2.5
    assert designed["ankle.viscous_friction"] < again["ankle.viscous_friction"] / 20.0
    assert determinant > usual + 10.0


def test_the_designed_recording_beats_excitations_that_do_not_know(leg, campaign, sequential):
    _, before, after = campaign
    determinant = expected_std(before, sequential[0])[1]
    for seed in range(2):  # these need not even respect the limits
        a, b = np.random.default_rng(seed).normal(0.0, 0.25, (2, 3, 5))
        assert (
            determinant > expected_std(before, after(FourierSeries(0.1, np.array([0.5, -0.3, 0.4]), a, b))[0])[1] + 1.0
        )
    blind, _ = after(design_excitation(leg, **HOW).series)
    assert determinant > expected_std(before, blind)[1] + 0.2


def test_the_estimate_from_both_recordings_holds_the_truth(leg, campaign, sequential, truth):
    _, before, _ = campaign
    _, joint = sequential
    exact = joint.base.project(truth.parameters)
    assert joint.update.changed == ()
    error = (joint.values - exact) / joint.std
    assert np.sqrt(np.mean(error**2)) < 1.6
    for name in WEAK:
        k = joint.names.index(name)
        assert joint.std[k] < before.std[k] / 2.0
