"""Recordings are read with zeros of their own where a model does not know them."""

import numpy as np
import pytest

from estimation.synthetic import record
from sea_ident.estimation import identify
from sea_ident.estimation.unknown_zeros import unknown_zeros, with_common_zeros, with_its_zeros, with_zeros, zeros_of
from sea_ident.processing import process

pytestmark = pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")
NOISE = {"torque_noise": 0.2, "encoder_noise": 1e-5}


def shifted(recording, **zeros):
    return recording.replace_columns({f"theta_{j}": recording.columns[f"theta_{j}"] + z for j, z in zeros.items()})


@pytest.fixture(scope="module")
def recordings(leg, truth):
    return [record(leg, truth, 8, seed=seed, **NOISE) for seed in (0, 1)]


@pytest.fixture(scope="module")
def model(leg, recordings):
    return identify(leg, shifted(recordings[0], knee=0.3, hip=-0.1), period=10.0, unknown_zero=["knee", "hip"])


def test_every_recording_is_read_with_its_own_zero(leg, recordings, model):
    assert unknown_zeros(model) == ("hip", "knee")
    other = shifted(recordings[1], knee=-0.8, hip=0.02)
    zeros = zeros_of(model, process(other, leg, period=10.0))
    assert zeros == pytest.approx({"hip": 0.02, "knee": -0.8}, abs=2e-4)
    read, same = with_its_zeros(model, other, 10.0)
    assert same == zeros
    for joint in leg.joint_names:
        given = recordings[1].columns[f"theta_{joint}"]
        assert read.columns[f"theta_{joint}"] == pytest.approx(given, abs=2e-4)
        assert np.array_equal(read.columns[f"q_{joint}"], other.columns[f"q_{joint}"])


def test_a_recording_that_is_processed_already_is_read_alike(leg, recordings, model):
    processed = process(shifted(recordings[1], knee=0.5), leg, period=10.0)
    read, zeros = with_its_zeros(model, processed, None)
    assert zeros["knee"] == pytest.approx(0.5, abs=2e-4)
    plain, knee = process(recordings[1], leg, period=10.0), leg.index("knee")
    assert read.motion.theta[:, knee] == pytest.approx(plain.motion.theta[:, knee], abs=2e-4)
    assert read.channels["deflection"][:, knee] == pytest.approx(plain.channels["deflection"][:, knee], abs=2e-4)
    for own, known in zip(read.period_motions, plain.period_motions, strict=True):
        assert own.theta[:, knee] == pytest.approx(known.theta[:, knee], abs=2e-4)
        np.testing.assert_allclose(own.dtheta, known.dtheta, atol=1e-9)


def test_a_reference_of_the_motor_is_moved_with_it(leg, recordings):
    given = recordings[0].replace_columns({"theta_reference_knee": recordings[0].columns["theta_knee"]})
    read = with_common_zeros(given, {"knee": 0.25})
    assert np.array_equal(read.columns["theta_reference_knee"], read.columns["theta_knee"])
    assert read.columns["theta_knee"] + 0.25 == pytest.approx(given.columns["theta_knee"])


def test_a_model_that_knows_its_zeros_reads_a_recording_as_it_is(leg, recordings):
    known = identify(leg, recordings[0], period=10.0)
    assert unknown_zeros(known) == ()
    read, zeros = with_its_zeros(known, recordings[1], 10.0)
    assert read is recordings[1]
    assert zeros == {}
    assert zeros_of(known, process(recordings[1], leg, period=10.0)) == {}


def test_the_model_of_a_recording_that_was_read_less_a_zero_has_it(model):
    moved = with_zeros(model, {"knee": 0.1})
    before, after = ({s.joint: s.zero for s in each.springs} for each in (model, moved))
    assert after == pytest.approx({**before, "knee": before["knee"] + 0.1})
