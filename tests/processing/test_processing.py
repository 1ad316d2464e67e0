import warnings

import numpy as np
import pytest
from estimation.synthetic import record

from sea_ident.exceptions import RecordingError, SeaIdentWarning
from sea_ident.processing import process
from sea_ident.recordings import Recording


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


def test_saturated_current_is_named(leg, truth):
    recording = record(leg, truth, 4, torque_noise=0.05)
    torque = recording.columns["tau_motor_hip"]
    cut = recording.replace_columns({"tau_motor_hip": np.minimum(torque, 0.7 * torque.max())})
    with pytest.warns(SeaIdentWarning, match="tau_motor_hip stays at its highest value"):
        process(cut, leg, period=10.0)


def test_one_joint_that_never_moves_is_named(leg, truth):
    recording = record(leg, truth, 4, torque_noise=0.05)
    held = recording.replace_columns({"q_knee": np.full(8000, -0.2), "theta_knee": np.full(8000, -0.2)})
    with pytest.warns(SeaIdentWarning) as caught:
        process(held, leg, period=10.0)
    assert any("q_knee constant" in str(w.message) for w in caught)


def test_period_that_is_no_multiple_of_the_sample_time_is_resampled(leg, truth):
    # the same motion, sampled 3 % more slowly than a whole number of times per period
    recording = record(leg, truth, 6)
    time = np.arange(0.0, 59.9, 0.00515)
    columns = {name: np.interp(time, recording.time, values) for name, values in recording.columns.items()}
    found = process(Recording(time, columns, "odd"), leg, period=10.0, link_harmonics=5, motor_harmonics=30)
    assert any("no multiple of the sample time" in note for note in found.notes)
    start = time[-1] + 0.00515 - found.periods * 10.0
    phase = start + found.motion.time
    expected = np.interp(phase % 10.0, truth.motion.time, truth.motion.q[:, 0], period=10.0)
    np.testing.assert_allclose(found.motion.q[:, 0], expected, atol=2e-4)


def test_uneven_samples_are_resampled(leg, truth):
    rng = np.random.default_rng(0)
    recording = record(leg, truth, 4)
    time = np.sort(rng.uniform(0.0, 39.99, 8000))
    time = time[np.concatenate([[True], np.diff(time) > 1e-6])]
    columns = {name: np.interp(time, recording.time, values) for name, values in recording.columns.items()}
    uneven = process(Recording(time, columns, "uneven"), leg, period=10.0, link_harmonics=5, motor_harmonics=30)
    assert any("not evenly spaced" in note for note in uneven.notes)


def test_leading_transient_is_left_out(leg, truth):
    recording = record(leg, truth, 8, torque_noise=0.05, encoder_noise=1e-5)
    swing = 0.2 * np.exp(-recording.time / 3.0)
    started = recording.replace_columns({"q_hip": recording.columns["q_hip"] + swing})
    found = process(started, leg, period=10.0)
    assert found.periods < 8
    assert any("left out as transient" in note for note in found.notes)


def test_recording_without_a_period_is_filtered_and_says_so(leg, truth):
    recording = record(leg, truth, 1, torque_noise=0.05, encoder_noise=1e-6)
    with pytest.warns(SeaIdentWarning, match="no period: positions filtered"):
        found = process(recording, leg)
    assert not found.periodic
    middle = slice(300, -300)
    inside = np.searchsorted(truth.motion.time, found.motion.time)[middle]
    np.testing.assert_allclose(found.motion.dq[middle], truth.motion.dq[inside], atol=0.02)


def test_motor_torque_from_current_by_direction(leg, truth):
    recording = record(leg, truth, 4)
    columns = {k: v for k, v in recording.columns.items() if not k.startswith("tau_motor")}
    for i, joint in enumerate(leg.joints):
        actuator = joint.actuator
        driving = np.sign(truth.tau_motor[:, i] * truth.motion.dtheta[:, i])
        current = truth.tau_motor[:, i] / (
            actuator.gear_ratio * actuator.torque_constant * actuator.efficiency**driving
        )
        columns[f"current_{joint.name}"] = np.tile(current, 4)
    noise = 1e-9 * np.random.default_rng(0).standard_normal(8000)
    columns["q_hip"] = columns["q_hip"] + noise  # so that periods are no copies
    found = process(Recording(recording.time, columns, "currents"), leg, period=10.0, motor_harmonics=60)
    moving = np.abs(truth.motion.dtheta) > 0.01
    np.testing.assert_allclose(found.tau_motor[moving], truth.tau_motor[moving], rtol=1e-6, atol=1e-6)


def test_torques_that_never_change_are_refused(leg, truth):
    recording = record(leg, truth, 2, torque_noise=0.1)
    dead = recording.replace_columns({f"tau_motor_{j}": np.full(4000, 0.5) for j in leg.joint_names})
    with pytest.raises(RecordingError, match=r"joints are constant \(tau_motor_hip, tau_motor_knee, tau_motor_ankle"):
        process(dead, leg, period=10.0)


def test_one_torque_that_never_changes_is_named(leg, truth):
    recording = record(leg, truth, 2, torque_noise=0.1)
    with pytest.warns(SeaIdentWarning, match="column tau_motor_knee is constant, 0.5: it is no measured torque"):
        process(recording.replace_columns({"tau_motor_knee": np.full(4000, 0.5)}), leg, period=10.0)


def test_a_motor_position_that_never_changes_is_named(leg, truth):
    recording = record(leg, truth, 2, torque_noise=0.1)
    with pytest.warns(SeaIdentWarning, match="theta_knee constant while q_knee moves"):
        process(recording.replace_columns({"theta_knee": np.full(4000, 0.1)}), leg, period=10.0)


def test_period_is_that_of_the_reference_where_elastic_and_rigid_joints_mix(leg, truth):
    """Elastic joints have a reference of the motor, rigid ones of the link: together they are one."""
    recording = record(leg, truth, 6, torque_noise=0.2, encoder_noise=1e-6)
    samples = np.arange(recording.samples)
    kinds = ("theta_reference", "theta_reference", "q_reference")
    wave = np.sin(2.0 * np.pi * samples / (recording.samples // 6))
    reference = {f"{kind}_{name}": wave for kind, name in zip(kinds, leg.joint_names, strict=True)}
    told = process(Recording(recording.time, {**recording.columns, **reference}, "test"), leg)
    assert told.period == pytest.approx(10.0)
    assert any("found from the reference" in note for note in told.notes)


def with_hole(recording, first, last):
    seen = np.r_[0:first, last : recording.samples]
    columns = {name: values[seen] for name, values in recording.columns.items()}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return Recording(recording.time[seen], columns, recording.source)


def process_quietly(recording, robot):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        return process(recording, robot)


def test_samples_beside_a_gap_stay_where_they_are(leg, truth):
    """Where a gap is the only unevenness the samples of other periods need no interpolation."""
    whole = record(leg, truth, 6, torque_noise=0.05, encoder_noise=1e-6)
    period = 10.0
    samples = round(period * whole.sample_rate)
    holed = with_hole(whole, int(2.3 * samples), int(2.45 * samples))
    found = process_quietly(holed, leg)
    assert any("1 of 6 periods have a gap" in text for text in found.warnings)
    assert found.period == pytest.approx(period, rel=1e-6)
    assert found.samples == samples
    assert found.places == (0, 1, 3, 4, 5)
    own = process(whole, leg, period=period)
    np.testing.assert_allclose(found.period_tau_motor, own.period_tau_motor[[0, 1, 3, 4, 5]], atol=1e-6)


def test_nothing_is_filled_into_a_gap_where_there_is_no_period(leg, truth):
    whole = record(leg, truth, 1, torque_noise=0.05, encoder_noise=1e-6)
    first, last = int(0.4 * whole.samples), int(0.5 * whole.samples)
    holed = with_hole(whole, first, last)
    found = process_quietly(holed, leg)
    assert any("in 1 gaps in time and within" in text for text in found.warnings)
    inside = (found.motion.time > whole.time[first]) & (found.motion.time < whole.time[last - 1])
    assert not np.any(inside)
