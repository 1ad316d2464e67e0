"""Wrong units, wrong columns and broken encoders are said before they spoil a model."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from estimation.synthetic import leg_series, record, truth_of

from sea_ident.exceptions import RecordingError, SeaIdentWarning
from sea_ident.processing import filter_recording, process
from sea_ident.processing.doubt import DoubtKind, texts_of
from sea_ident.processing.plausible import beyond_limits, doubts
from sea_ident.processing.torque import torque_source
from sea_ident.recordings import Recording
from sea_ident.robot import load_robot


@pytest.fixture(scope="module")
def leg():
    return load_robot("exo_leg")


@pytest.fixture(scope="module")
def recording(leg):
    truth = truth_of(leg, leg_series(), samples=1000)
    return record(leg, truth, 4, torque_noise=0.05, encoder_noise=1e-5)


def found_in(*given) -> list[str]:
    return [doubt.text for doubt in doubts(*given)]


def found(leg, recording: Recording, **columns: np.ndarray) -> list[str]:
    changed = recording.replace_columns(columns)
    kinds = ("q", "theta", "tau_motor")
    return found_in(changed, leg, *(changed.channel(kind, leg.joint_names) for kind in kinds))


def test_a_sound_recording_raises_no_doubt(leg, recording):
    assert found(leg, recording) == []


@pytest.mark.parametrize(
    ("column", "factor", "expected"),
    [
        ("q_knee", 180.0 / np.pi, "is it in degrees? Then say ColumnSource('q_knee', unit='deg')"),
        ("q_knee", 1e4, "counts of the encoder"),
        ("theta_knee", 180.0 / np.pi, "theta_knee moves .. is it in degrees"),
        ("theta_knee", -1.0, "has one of the two the wrong sign"),
        ("theta_knee", 100.0, "is it the angle before the gear .. 'theta_knee=theta_knee,gear_ratio=100'"),
        ("theta_knee", 7.0, "are both of this joint, in one unit"),
        ("tau_motor_knee", 1000.0, "tau_motor_knee reaches .. whose limit is .. in another unit"),
    ],
)
def test_a_wrong_unit_or_side_is_said_with_what_to_do(leg, recording, column, factor, expected):
    said = found(leg, recording, **{column: factor * recording.columns[column]})
    assert all(part in said[0] for part in (column, *expected.split(" .. "))), said


def test_only_elastic_joints_are_told_of_their_theta(leg, recording):
    (said, *_) = found(leg, recording, q_knee=180.0 / np.pi * recording.columns["q_knee"])
    assert "and the same for theta_knee" in said
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        arm = load_robot("example:ur_description/urdf/ur5_robot.urdf")
    q = np.linspace(-90.0, 90.0, 100)[:, None] * np.ones(arm.n)
    columns = {f"q_{name}": q[:, i] for i, name in enumerate(arm.joint_names)}
    said = found_in(Recording(0.01 * np.arange(100), columns, "arm"), arm, q, q, np.zeros_like(q))
    assert any("is it in degrees" in text for text in said)
    assert not any("theta" in text for text in said)


def test_joints_that_are_held_in_the_model_alone_are_said(leg, recording):
    """What they carry is elsewhere, whether they move or stand somewhere else."""
    fewer = load_robot("exo_leg", joints=["hip", "knee"])
    assert fewer.locked == {"ankle": 0.0}

    def said(ankle):
        changed = recording.replace_columns({"q_ankle": ankle})
        kinds = ("q", "theta", "tau_motor")
        return found_in(changed, fewer, *(changed.channel(kind, fewer.joint_names) for kind in kinds))

    moving = recording.columns["q_ankle"]
    (text,) = said(moving)
    assert f"q_ankle goes from {moving.min():.4g} to {moving.max():.4g}, held at 0" in text
    assert "Name ankle among the joints that move" in text
    assert len(said(np.full_like(moving, 0.3))) == 1
    assert said(np.full_like(moving, 0.01)) == []
    columns = {name: values for name, values in recording.columns.items() if not name.endswith("_ankle")}
    without = Recording(recording.time, columns, "test")
    assert found_in(without, fewer, *(without.channel(k, fewer.joint_names) for k in ("q", "theta", "tau_motor"))) == []


def test_a_motion_somewhat_beyond_the_limits_is_a_note(leg, recording):
    shifted = recording.replace_columns({"q_knee": recording.columns["q_knee"] + 1.0})
    q = shifted.channel("q", leg.joint_names)
    assert [text for text in beyond_limits(shifted, leg, q) if "q_knee goes from" in text]
    small = 0.5 * (leg.limits.lower + leg.limits.upper) + 0.01 * q
    assert beyond_limits(shifted, leg, small) == []


def test_milliamperes_are_recognised_by_the_limit_of_the_torque(leg, recording):
    actuator = leg.joints[1].actuator
    assert actuator is not None
    current = 1000.0 * recording.columns["tau_motor_knee"] / (actuator.gear_ratio * actuator.torque_constant)
    columns = {name: values for name, values in recording.columns.items() if name != "tau_motor_knee"}
    changed = Recording(recording.time, {**columns, "current_knee": current}, "test")
    torque = np.stack([recording.columns[f"tau_motor_{name}"] for name in leg.joint_names], axis=1)
    torque[:, 1] *= 1000.0
    (said,) = found_in(
        changed, leg, changed.channel("q", leg.joint_names), changed.channel("theta", leg.joint_names), torque
    )
    assert "--column 'current_knee=current_knee,unit=mA'" in said


def test_a_dead_stretch_of_an_encoder_is_placed(leg, recording):
    values = recording.columns["theta_hip"].copy()
    values[1200:1700] = values[1200]
    (said,) = [text for text in found(leg, recording, theta_hip=values) if "stands still" in text]
    assert "for 500 samples from sample 1200 (time 12 s) while q_hip moves" in said


def test_a_motor_that_is_held_is_asked_for_and_its_encoder_is_not_called_dead(leg, recording):
    """Its link swings in the spring, and the motor makes some counts in between."""
    step = 2e-5
    q, counts = recording.columns["q_hip"], np.zeros(recording.samples)
    counts[1000:1400], counts[2200:] = 1.0, 2.0
    still = recording.columns["theta_hip"].mean() + step * counts
    (said,) = found(leg, recording, theta_hip=still)
    assert "is the motor held, as by friction or a brake? Or are both of this joint" in said
    # nor is one that creeps by more of them
    counts[1500:1600] = np.arange(100)
    creeping = recording.columns["theta_hip"].mean() + step * counts
    (said,) = found(leg, recording, theta_hip=creeping)
    assert "is the motor held" in said
    # a motor that goes half as far as its link is not held
    (said,) = found(leg, recording, theta_hip=0.5 * (q - q.mean()))
    assert "held" not in said
    assert "are both of this joint" in said
    # nor is anything said of a rigid joint that makes some counts
    assert not [text for text in found(leg, recording, q_hip=still, theta_hip=still) if "stands still" in text]


def test_a_joint_that_is_held_is_no_reason_to_doubt_the_period(leg, recording):
    noise = np.random.default_rng(2).normal(0.0, 1e-5, (2, recording.samples))
    held = {"q_ankle": 0.1 + noise[0], "theta_ankle": 0.1 + noise[1]}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        processed, wrong = (process(recording.replace_columns(held), leg, period=period) for period in (10.0, 7.0))
    assert texts_of(processed.doubts, DoubtKind.PERIOD) == ()
    assert [text.split()[1] for text in texts_of(wrong.doubts, DoubtKind.PERIOD)] == ["q_hip", "q_knee"]


def test_a_spike_is_placed_and_a_coarse_encoder_is_none(leg, recording):
    values = recording.columns["q_hip"].copy()
    values[777] += 0.5
    (said,) = found(leg, recording, q_hip=values)
    assert "q_hip jumps by 0.5" in said
    assert "after sample 776" in said
    step = np.ptp(recording.columns["q_hip"]) / 64.0
    coarse = step * np.round(recording.columns["q_hip"] / step)
    assert found(leg, recording, q_hip=coarse) == []


def test_periods_with_a_gap_in_time_are_left_out_not_filled_in(leg, recording):
    keep = np.ones(recording.samples, dtype=bool)
    keep[1300:1600] = False
    cut = Recording(recording.time[keep], {k: v[keep] for k, v in recording.columns.items()}, "test")
    with pytest.warns(SeaIdentWarning, match="1 of 4 periods have a gap in time and were left out: 2"):
        told = process(cut, leg, period=10.0)
    assert told.periods == 3
    whole = process(recording, leg, period=10.0)
    phase = np.arange(told.samples) / told.samples * whole.samples
    same = [np.interp(phase, np.arange(whole.samples), column) for column in whole.tau_motor.T]
    np.testing.assert_allclose(told.tau_motor[:900].T, np.stack(same)[:, :900], atol=0.3)
    keep[::1000] = True
    for start in range(0, 4000, 1000):
        keep[start + 100 : start + 200] = False
    none = Recording(recording.time[keep], {k: v[keep] for k, v in recording.columns.items()}, "test")
    with pytest.raises(RecordingError, match="every one of the 4 periods has a gap"):
        process(none, leg, period=10.0)


def test_coarse_current_is_not_called_saturated(leg, recording):
    values = recording.columns["tau_motor_hip"]
    step = np.ptp(values) / 12.0
    process(recording.replace_columns({"tau_motor_hip": step * np.round(values / step)}), leg, period=10.0)


def test_a_torque_sensor_is_checked_and_said_to_be_unused(leg, recording):
    deflection = recording.columns["theta_knee"] - recording.columns["q_knee"]
    sound = recording.replace_columns({"tau_spring_knee": 200.0 * deflection})
    assert found(leg, sound) == []
    (note,) = [text for text in process(sound, leg, period=10.0).notes if "tau_spring_knee" in text]
    assert "not used" in note
    (said,) = found(leg, recording, tau_spring_knee=-200.0 * deflection)
    assert "tau_spring_knee falls where the deflection rises" in said
    (said,) = found(leg, recording, tau_spring_knee=np.full(recording.samples, 3.0))
    assert "is the sensor dead" in said


def test_a_doubt_keeps_its_kind_whether_the_motion_repeats_itself_or_not(leg, recording):
    """What is concluded from a recording depends on it."""
    changed = recording.replace_columns({"theta_knee": -recording.columns["theta_knee"]})
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        for processed in (process(changed, leg, period=10.0), filter_recording(changed, leg)):
            (text,) = texts_of(processed.doubts, DoubtKind.POSITION)
            assert "theta_knee" in text
            assert text in processed.warnings
            assert texts_of(processed.doubts, DoubtKind.SENSOR) == ()
        assert process(recording, leg, period=10.0).doubts == ()


@pytest.mark.parametrize(("factor", "kind"), [(-1.0, DoubtKind.POSITION), (1.6, DoubtKind.SPRING)])
def test_a_factor_that_nothing_explains_may_be_a_soft_spring(leg, recording, factor, kind):
    """It is told, and conclusions are drawn all the same."""
    changed = recording.replace_columns({"theta_knee": factor * recording.columns["theta_knee"]})
    kinds = ("q", "theta", "tau_motor")
    (doubt,) = doubts(changed, leg, *(changed.channel(k, leg.joint_names) for k in kinds))
    assert doubt.kind is kind


def test_a_sensor_that_wraps_around_is_told_with_its_span(leg, recording):
    for scale, span in ((1.0, "6.283185307"), (180.0 / np.pi, "360"), (65536 / 2.0 / np.pi, "65536")):
        turns = np.mod(scale * (recording.columns["q_hip"] + 6.0), float(span))
        said = " ".join(found(leg, recording, q_hip=turns))
        assert f"wraps_at={span}" in said


def test_a_signal_that_was_held_between_slow_samples_is_told(leg, recording):
    first = 7 * (np.arange(recording.samples) // 7)
    for column in ("theta_hip", "tau_motor_knee"):
        (said,) = found(leg, recording, **{column: recording.columns[column][first]})
        assert "changes at every 7th sample only" in said
        assert "14.29 Hz" in said
    step = np.ptp(recording.columns["q_hip"]) / 200.0
    assert found(leg, recording, q_hip=step * np.round(recording.columns["q_hip"] / step)) == []


def test_a_joint_without_position_limits_is_known_by_its_speed(leg, recording):
    n = leg.n
    free = replace(leg, limits=replace(leg.limits, lower=np.full(n, -np.inf), upper=np.full(n, np.inf)))
    assert found(free, recording) == []
    said = found(free, recording, q_knee=180.0 / np.pi * recording.columns["q_knee"])
    assert "is it in degrees? Then say ColumnSource('q_knee', unit='deg')" in said[0]
    assert "another unit" in found(free, recording, q_knee=1e4 * recording.columns["q_knee"])[0]


@pytest.mark.parametrize(("factor", "expected"), [(1.0, ""), (1.5, "is 1.5 times"), (-1.0, "does not run like")])
def test_torque_and_current_of_a_joint_are_held_against_each_other(leg, recording, factor, expected):
    motor = leg.joints[1].actuator
    current = recording.columns["tau_motor_knee"] / (motor.gear_ratio * motor.torque_constant) / factor
    both = recording.replace_columns({"current_knee": current})
    said = [text for text in torque_source(both, leg).warnings if "tau_motor_knee" in text]
    assert all(expected in text for text in said)
    assert len(said) == bool(expected)


def test_counts_that_an_encoder_lost_show_in_the_deflection(leg, recording):
    turn = 2.0 * np.pi / leg.joints[1].actuator.gear_ratio
    values = recording.columns["theta_knee"].copy()
    values[2345:] += turn
    (said,) = found(leg, recording, theta_knee=values)
    assert "theta_knee - q_knee jumps by 0.06277 rad" in said
    assert "after sample 2344" in said
    assert f"a turn of the motor is {turn:.4g} rad" in said


@pytest.mark.parametrize(("share", "told"), [(0.0, False), (0.2, False), (0.8, True), (-1.5, True)])
def test_a_zero_that_changes_for_good_shows_in_the_deflection(leg, recording, share, told):
    """Of any size that no spring makes from one sample to the next and keeps."""
    deflection = recording.columns["theta_knee"] - recording.columns["q_knee"]
    values = recording.columns["theta_knee"].copy()
    values[2345:] += share * np.ptp(deflection)
    said = found(leg, recording, theta_knee=values)
    assert len(said) == told
    assert all("theta_knee - q_knee jumps by" in text and "after sample 2344" in text for text in said)
    values[2700:] -= share * np.ptp(deflection)  # and back again, as under a push
    assert found(leg, recording, theta_knee=values) == []


@pytest.mark.parametrize("kind", ["q", "theta"])
def test_columns_of_two_joints_that_are_exchanged_are_told_by_the_other_encoder(leg, recording, kind):
    swapped = {f"{kind}_hip": recording.columns[f"{kind}_knee"], f"{kind}_knee": recording.columns[f"{kind}_hip"]}
    changed = recording.replace_columns(swapped)
    (doubt,) = doubts(changed, leg, *(changed.channel(k, leg.joint_names) for k in ("q", "theta", "tau_motor")))
    assert doubt.kind is DoubtKind.POSITION
    assert "theta_hip moves as q_knee, and theta_knee as q_hip: columns q of 'hip' and 'knee' look" in doubt.text
    assert "--column 'q_hip=q_knee' --column 'q_knee=q_hip', or the same with theta" in doubt.text


def test_joints_that_move_alike_are_not_exchanged(leg, recording):
    alike = {f"{kind}_hip": recording.columns[f"{kind}_knee"] for kind in ("q", "theta")}
    assert not [text for text in found(leg, recording, **alike) if "exchanged" in text]


def test_spikes_of_a_torque_are_counted_and_noise_is_none(leg, recording):
    def said(torque):
        changed = recording.replace_columns({"tau_motor_knee": torque})
        return [text for text in torque_source(changed, leg).warnings if "spikes" in text]

    rng = np.random.default_rng(0)
    torque = recording.columns["tau_motor_knee"].copy()
    assert said(torque) == []
    assert said(torque + rng.normal(size=len(torque))) == []
    assert said(np.round(torque)) == []
    assert said(20.0 * np.sign(recording.columns["q_knee"] - np.mean(recording.columns["q_knee"]))) == []
    torque[[500, 900, 1700]] += 60.0
    (text,) = said(torque)
    assert "tau_motor_knee has 3 spikes, the first at sample 500" in text


def test_play_that_is_crossed_at_every_reversal_is_no_lost_count(leg, recording):
    q, knee = recording.columns["q_knee"], recording.columns["theta_knee"]
    play = 0.05 * np.sign(np.gradient(q))
    assert not [text for text in found(leg, recording, theta_knee=knee + play) if "theta_knee - q_knee jumps" in text]
