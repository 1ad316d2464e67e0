import json

import numpy as np
import pytest

from estimation.synthetic import leg_series, record, truth_of
from sea_ident.estimation import Agreement, identify
from sea_ident.estimation.agreement import agreement
from sea_ident.robot import load_robot
from sea_ident.validation import validate

PERIODS = 12


def scatter(samples=4000, seed=0, shape=None):
    """Residuals of periods whose mean is a shape (N, 1), with noise of one."""
    noise = np.random.default_rng(seed).standard_normal((PERIODS, samples, 1))
    return noise if shape is None else noise + shape


def test_noise_alone_is_within_the_noise():
    periods = scatter()
    found = agreement(periods.mean(axis=0), periods, np.ones((4000, 1), dtype=bool))
    assert found.noise == pytest.approx([PERIODS**-0.5], rel=0.02)
    assert found.rms == pytest.approx(found.noise, rel=0.05)
    assert found.within_noise.all()


def test_what_repeats_is_the_gap():
    shape = 0.5 * np.sin(np.linspace(0.0, 2.0 * np.pi, 4000, endpoint=False))[:, None]
    periods = scatter(shape=shape)
    found = agreement(periods.mean(axis=0), periods, np.ones((4000, 1), dtype=bool))
    assert not found.within_noise.any()
    assert found.gap == pytest.approx([0.5 / 2**0.5], rel=0.03)


def test_a_spike_at_reversals_is_told_apart():
    shape = np.zeros((4000, 1))
    shape[1000:1100] = 3.0
    periods = scatter(shape=shape)
    mean = periods.mean(axis=0)
    found = agreement(mean, periods, shape == 0.0)
    assert found.within_noise.all()
    assert found.share == pytest.approx([0.975])
    whole = np.sqrt(np.mean(mean**2, axis=0))
    assert found.around_reversals(whole) == pytest.approx([np.sqrt(np.mean(mean[1000:1100] ** 2))])


def test_one_period_says_nothing_of_noise():
    assert agreement(np.zeros((5, 1)), np.zeros((1, 5, 1)), np.ones((5, 1), dtype=bool)) is None


def test_a_joint_that_rests_counts_as_a_whole():
    periods = scatter()
    found = agreement(periods.mean(axis=0), periods, np.zeros((4000, 1), dtype=bool))
    assert found.share == pytest.approx([1.0])
    assert found.within_noise.all()


def test_it_survives_being_written():
    found = Agreement(np.array([0.1, 0.2]), np.array([0.3, 0.4]), np.array([0.5, 1.0]))
    again = Agreement.from_dict(json.loads(json.dumps(found.to_dict(("a", "b")))), ("a", "b"))
    for key in ("rms", "noise", "share"):
        np.testing.assert_array_equal(getattr(again, key), getattr(found, key))
    assert Agreement.from_dict(None, ("a",)) is None


@pytest.fixture(scope="module")
def leg():
    return load_robot("exo_leg")


def test_noise_of_encoders_is_noise_of_the_residual(leg):
    """Where encoders and not the torque make the noise, scatter of the torque alone would call it a gap."""
    truth, other = truth_of(leg, leg_series()), truth_of(leg, leg_series(seed=11))
    noise = {"torque_noise": 0.02, "encoder_noise": 2e-5}
    how = {"period": 10.0, "link_harmonics": 150, "motor_harmonics": 150}
    model = identify(leg, record(leg, truth, 8, **noise), **how)
    assert np.any(model.fit.rms_residual > 2.0 * model.fit.noise_std)
    assert model.fit.agreement.within_noise.all()
    found = validate(model, record(leg, other, 8, seed=1, **noise), **how)
    assert found.agreement.within_noise.all()
    assert found.to_dict()["agreement"]["noise"]["knee"] == pytest.approx(found.agreement.noise[1])
