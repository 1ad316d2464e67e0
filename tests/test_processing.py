import numpy as np
import pytest
from estimation.synthetic import leg_series, record, truth_of

from sea_ident.exceptions import RecordingError, SeaIdentWarning
from sea_ident.processing import process
from sea_ident.recordings import Recording
from sea_ident.robot import load_robot


@pytest.fixture(scope="module")
def leg():
    return load_robot("exo_leg")


@pytest.fixture(scope="module")
def truth(leg):
    return truth_of(leg, leg_series())


def test_mean_motion_and_derivatives(leg, truth):
    found = process(record(leg, truth, 8, torque_noise=0.1, encoder_noise=1e-6), leg, period=10.0)
    assert found.periods == 8
    for name, tolerance in (("q", 3e-6), ("dq", 1e-5), ("ddq", 1e-4), ("theta", 1e-5), ("dtheta", 1e-3)):
        np.testing.assert_allclose(getattr(found.motion, name), getattr(truth.motion, name), atol=tolerance)
    assert found.link_harmonics == 5  # as many as the motion has
    assert found.motor_harmonics > found.link_harmonics
    np.testing.assert_allclose(found.tau_motor, truth.tau_motor, atol=0.25)
    # variance of one period: planted 0.1^2
    np.testing.assert_allclose(found.tau_variance.mean(axis=0), 0.01, rtol=0.03)


def test_period_is_found_from_the_data(leg, truth):
    found = process(record(leg, truth, 4, encoder_noise=1e-5, torque_noise=0.1), leg)
    assert found.period == pytest.approx(10.0)
    assert any("period 10 s found" in note for note in found.notes)


def test_noise_near_reversal_shows_in_the_variance(leg, truth):
    found = process(record(leg, truth, 20, torque_noise=0.1, reversal_noise=1.0), leg, period=10.0)
    slow = np.abs(truth.motion.dtheta) < 0.02
    fast = np.abs(truth.motion.dtheta) > 0.3
    for i in range(3):
        assert found.tau_variance[slow[:, i], i].mean() > 5.0 * found.tau_variance[fast[:, i], i].mean()


def test_copies_of_a_period_are_left_out(leg, truth):
    recording = record(leg, truth, 4, torque_noise=0.1)
    columns = {name: np.concatenate([values, values[-2000:]]) for name, values in recording.columns.items()}
    time = np.arange(10000) * 0.005
    with pytest.warns(SeaIdentWarning, match="the same numbers"):
        found = process(Recording(time, columns, "copied"), leg, period=10.0)
    assert found.periods == 4


def test_nothing_moves(leg, truth):
    recording = record(leg, truth, 2, torque_noise=0.1)
    still = {f"q_{j}": np.full(4000, 0.1) for j in leg.joint_names}
    with pytest.raises(RecordingError, match="no joint moves"):
        process(recording.replace_columns(still), leg, period=10.0)


def test_no_torque(leg, truth):
    recording = record(leg, truth, 2)
    columns = {k: v for k, v in recording.columns.items() if k != "tau_motor_knee"}
    with pytest.raises(RecordingError, match=r"'knee' has neither tau_motor_knee nor current_knee"):
        process(Recording(recording.time, columns, "some.csv"), leg, period=10.0)
