import json
from dataclasses import replace

import numpy as np
import pytest

from estimation.synthetic import leg_series, record, truth_of
from sea_ident.base_parameters import find_base_parameters
from sea_ident.discrepancy.measured.data import around_reversals, period_data
from sea_ident.effects import base_effects
from sea_ident.estimation import Agreement, identify
from sea_ident.estimation.agreement import agreement
from sea_ident.estimation.observations import Observations, friction_is_modelled
from sea_ident.processing import process
from sea_ident.reversals import around_reversal
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


@pytest.fixture(scope="module")
def recorded(leg):
    """A motion, and eight periods of what sensors see of it."""
    truth = truth_of(leg, leg_series())
    return truth, record(leg, truth, 8, torque_noise=0.02)


def with_torque(recording, joint, more):
    """The recording with more torque (N,) in every period."""
    name = f"tau_motor_{joint}"
    columns = {**recording.columns, name: recording.columns[name] + np.tile(more, 8)}
    return replace(recording, columns=columns)


HOW = {"period": 10.0, "link_harmonics": 150, "motor_harmonics": 150}


def test_the_samples_that_count_are_those_of_a_diagnosis(leg, recorded):
    processed = process(recorded[1], leg, **HOW)
    effects = base_effects(leg)
    observations = Observations(leg, effects, find_base_parameters(leg, effects), processed)
    data = period_data(processed, leg)
    around = around_reversals(processed.motion, data.equations, processed.period_motions)
    motors = [k for k, equation in enumerate(data.equations) if equation.kind == "motor"]
    holds = friction_is_modelled(leg, effects, processed.motion)
    np.testing.assert_array_equal(observations.judged, holds & ~around[:, motors])
    assert np.any(holds & around[:, motors])


@pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")
def test_what_rings_from_reversals_is_no_gap_and_what_does_not_is(leg, recorded):
    truth, recording = recorded
    speed = truth.motion.dtheta[:, leg.index("hip")]
    pulses = np.random.default_rng(5).normal(size=len(speed))
    pulses = np.fft.rfft(np.where(around_reversal(speed), pulses, 0.0))
    pulses[HOW["motor_harmonics"] + 1 :] = 0.0
    rings = np.fft.irfft(pulses, len(speed))
    assert np.sqrt(np.mean(rings[~around_reversal(speed)] ** 2)) > 2.0 * 0.02 / np.sqrt(8.0)
    model = identify(leg, with_torque(recording, "hip", rings), **HOW)
    assert model.fit.agreement.within_noise.all()
    assert validate(model, with_torque(recording, "hip", rings), **HOW).agreement.within_noise.all()
    wave = 0.05 * np.sin(2.0 * np.pi * 37.0 * np.arange(len(speed)) / len(speed))
    fit = identify(leg, with_torque(recording, "hip", wave), **HOW).fit
    assert fit.agreement.within_noise.tolist() == [False, True, True]
    assert fit.agreement.gap[0] == pytest.approx(0.05 / np.sqrt(2.0), rel=0.1)
