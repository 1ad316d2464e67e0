import warnings
from dataclasses import replace

import numpy as np
import pytest

from estimation.synthetic import record
from sea_ident.estimation import JointWLS, LeastSquares, PerSampleWLS, identify
from sea_ident.exceptions import IdentificationError, RecordingError, SeaIdentWarning
from sea_ident.processing import process
from sea_ident.processing.doubt import Doubt, DoubtKind, texts_of


@pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")
@pytest.mark.parametrize("estimator", [LeastSquares(), JointWLS(), PerSampleWLS()], ids=lambda e: e.name)
def test_exact_data_give_exact_parameters(leg, truth, estimator):
    recording = record(leg, truth, 2)
    model = identify(leg, recording, period=10.0, link_harmonics=100, motor_harmonics=100, estimator=estimator)
    np.testing.assert_allclose(model.values, model.base.project(truth.parameters), rtol=1e-9)
    found = [(s.stiffness, s.cubic_stiffness, s.damping) for s in model.springs]
    given = [(s.stiffness, s.cubic_stiffness, s.damping) for s in map(leg.spring, leg.joint_names)]
    np.testing.assert_allclose(found, given, rtol=1e-8)


def test_noisy_data_give_parameters_within_their_intervals(leg, truth):
    recording = record(leg, truth, 10, torque_noise=0.2, reversal_noise=0.5, encoder_noise=1e-5)
    model = identify(leg, recording, period=10.0)
    error = (model.values - model.base.project(truth.parameters)) / model.std
    assert np.sqrt(np.mean(error**2)) < 1.8
    assert np.abs(error).max() < 4.0
    assert model.relative_std_percent.max() < 20.0


def test_wrong_sign_of_the_torque_is_found(leg, truth):
    recording = record(leg, truth, 4, torque_noise=0.1)
    flipped = recording.replace_columns(
        {f"tau_motor_{j}": -recording.columns[f"tau_motor_{j}"] for j in leg.joint_names}
    )
    with pytest.raises(IdentificationError, match="negative in every joint"):
        identify(leg, flipped, period=10.0)


def test_a_period_in_doubt_is_told_where_every_sign_seems_wrong(leg, truth):
    recording = record(leg, truth, 4, torque_noise=0.1)
    flipped = recording.replace_columns(
        {f"tau_motor_{j}": -recording.columns[f"tau_motor_{j}"] for j in leg.joint_names}
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        processed = process(flipped, leg, period=10.0)
    still = Doubt(DoubtKind.SENSOR, "r: an encoder stands still")
    doubt = Doubt(DoubtKind.PERIOD, "r: q_hip differs between periods: is that the period?")
    for doubts, said in (((), False), ((still,), False), ((still, doubt), True)):
        with pytest.raises(IdentificationError, match="negative in every joint") as raised:
            identify(leg, replace(processed, doubts=doubts))
        text = str(raised.value)
        assert ("Or is the period another one: r: q_hip differs" in text) == ("is the period" in text) == said
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        wrong = process(recording, leg, period=7.0)
    doubted = texts_of(wrong.doubts, DoubtKind.PERIOD)
    assert doubted
    assert set(doubted) <= set(wrong.warnings)


@pytest.mark.parametrize(
    ("joint", "text"),
    [
        ("hip", "tau_motor_hip has the other sign, by the other joints"),
        # what it moves is too little for the others to tell
        ("ankle", "'ankle' moves comes out negative"),
    ],
)
def test_wrong_sign_in_one_joint_is_named(leg, truth, joint, text):
    recording = record(leg, truth, 8, torque_noise=0.1)
    flipped = recording.replace_columns({f"tau_motor_{joint}": -recording.columns[f"tau_motor_{joint}"]})
    with pytest.warns(SeaIdentWarning) as caught:
        identify(leg, flipped, period=10.0)
    assert any(text in str(w.message) for w in caught)


def test_shorter_than_a_period(leg, truth):
    with pytest.raises(RecordingError, match="less than one period of 30 s"):
        identify(leg, record(leg, truth, 2), period=30.0)
