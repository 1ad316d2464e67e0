"""Recording: what is checked on construction, and what can be asked of it."""

import copy
import pickle

import numpy as np
import pytest

from sea_ident.exceptions import RecordingError
from sea_ident.recordings import Recording

TIME = np.arange(6) * 0.1


def recording(**columns):
    return Recording(TIME, {name: np.asarray(values) for name, values in columns.items()}, "leg.csv")


def test_facts_of_a_recording():
    leg = recording(theta_hip=TIME, q_knee=TIME, q_hip=TIME, q_reference_hip=TIME)
    assert leg.joints == ("knee", "hip")
    assert leg.samples == 6
    assert leg.duration == pytest.approx(0.5)
    assert leg.sample_rate == pytest.approx(10.0)
    assert leg.is_uniform
    assert leg.has("q_reference", "hip")
    assert not leg.has("q_reference", "knee")
    assert leg.warnings == ()


def test_channel_stacks_joints_in_the_order_asked():
    leg = recording(q_hip=[0, 1, 2, 3, 4, 5], q_knee=[5, 4, 3, 2, 1, 0])
    table = leg.channel("q", ["knee", "hip"])
    assert table.shape == (6, 2)
    assert table[1].tolist() == [4.0, 1.0]
    assert leg.channel("q", []).shape == (6, 0)


def test_absent_channel_names_joint_column_file_and_what_exists():
    leg = recording(q_hip=TIME, theta_hipp=TIME)
    with pytest.raises(RecordingError) as caught:
        leg.channel("theta", ["hip"])
    message = str(caught.value)
    for part in ("leg.csv", "'hip'", "theta_hip", "Did you mean theta_hipp", "time, q_hip, theta_hipp"):
        assert part in message


def test_an_absent_channel_says_what_to_do_without_it():
    leg = recording(q_hip=TIME, current_hip=TIME)
    with pytest.raises(RecordingError, match=r"'knee' was held still .* identify --joints"):
        leg.channel("q", ["knee"])
    with pytest.raises(RecordingError, match="describe its transmission as transmission_interface/SimpleTransmission"):
        leg.channel("theta", ["hip"])


@pytest.mark.parametrize(("kind", "joints", "part"), [("torque", ["hip"], "tau_motor"), ("q", "hip", "sequence")])
def test_channel_refuses_unknown_kinds_and_bare_names(kind, joints, part):
    with pytest.raises(RecordingError, match=part):
        recording(q_hip=TIME).channel(kind, joints)


def test_arrays_are_copied_and_read_only():
    values = np.zeros(6)
    leg = recording(q_hip=values)
    values[0] = 7.0
    assert leg.columns["q_hip"][0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        leg.columns["q_hip"][0] = 1.0
    with pytest.raises(ValueError, match="read-only"):
        leg.time[0] = 1.0
    with pytest.raises(TypeError):
        leg.columns["q_knee"] = values


@pytest.mark.parametrize(
    ("time", "parts"),
    [
        ([0.0, 0.1, 0.1, 0.2], ["repeats", "sample 2", "0.1 s", "1 of 3 steps", "1 repeat"]),
        ([0.0, 0.2, 0.1, 0.3], ["falls", "sample 2", "0.2 s, then 0.1 s"]),
        ([0.0, 0.1, np.nan, 0.3], ["time is nan", "sample 2", "1 of 4"]),
        ([0.0, 0.1, np.inf, 0.3], ["time is inf", "sample 2"]),
        ([0.0], ["at least 2"]),
        ([], ["at least 2"]),
        ([0.0, 1.7e18, 1.8e18], ["nanoseconds"]),
        ([0.0, 0.1, 0.05], ["falls at sample 2", "split a log that was restarted"]),
        ([0.0, 0.1, 0.1], ["repeats at sample 2", "interval=0.001"]),
        ([1.7e12, 1.7e12 + 2.0, 1.7e12 + 4.0], ["milliseconds", "--column time=time,unit=ms"]),
        ([1.7e15, 1.7e15 + 2e3, 1.7e15 + 4e3], ["microseconds", "--column time=time,unit=us"]),
        ([1.7e18, 1.7e18 + 2e6, 1.7e18 + 4e6], ["nanoseconds", "--column time=time,unit=ns"]),
        ([0.0, 1e-12, 2e-12], ["1e-12 s"]),
        ([[0.0, 1.0]], ["shape (1, 2)"]),
        (["a", "b"], ["instead of real numbers"]),
    ],
)
def test_time_must_be_finite_and_rise(time, parts):
    with pytest.raises(RecordingError) as caught:
        Recording(np.array(time), {}, "leg.csv")
    for part in ["leg.csv", *parts]:
        assert part in str(caught.value)


@pytest.mark.parametrize(
    ("values", "parts"),
    [
        ([0, 1, np.nan, np.nan, 4, 5], ["q_hip is nan", "sample 2", "time 0.2 s", "2 of 6"]),
        ([0, 1, 2, 3, -np.inf, 5], ["q_hip is -inf", "sample 4", "1 of 6"]),
        ([0, 1, 2], ["q_hip has 3 samples", "time has 6"]),
        ([0, 1, 2, 1e20, 4, 5], ["1e+20", "sample 3", "another unit"]),
        ([0, 1, 2, 3, 4, 5j], ["complex"]),
        ([[0], [1], [2], [3], [4], [5]], ["shape (6, 1)"]),
    ],
)
def test_columns_must_be_finite_and_as_long_as_time(values, parts):
    with pytest.raises(RecordingError) as caught:
        recording(q_hip=values)
    for part in ["leg.csv", *parts]:
        assert part in str(caught.value)


@pytest.mark.parametrize("name", ["", " q_hip", "q_hip\n", "time", "q\0"])
def test_malformed_column_names_are_refused(name):
    with pytest.raises(RecordingError, match=r"column name|twice"):
        recording(**{name: TIME})


def test_unknown_names_are_kept_and_reported():
    leg = recording(q_hip=TIME, battery=TIME * 1e20, q=TIME)
    assert leg.joints == ("hip",)
    assert "battery" in leg.columns
    (text,) = leg.warnings
    assert "battery, q;" in text


@pytest.mark.parametrize("rate", [100, 1000, 2000, 5000, 20000])
@pytest.mark.parametrize("step", [0.0, 1.5e-3], ids=["fine", "coarse"])
def test_time_in_milliseconds_is_noticed_at_any_rate(rate, step):
    """Samples of 5 kHz would be of 5 Hz, which is no wonder in itself: the motion is a thousand times too slow."""
    time = np.arange(20 * rate) / rate
    angle = 0.8 * np.sin(2.0 * np.pi * time / 5.0)
    angle = step * np.round(angle / step) if step else angle
    (text,) = Recording(1e3 * time, {"q_hip": angle}, "x").warnings
    assert "if time is in milliseconds, say columns={'time': ColumnSource('time', unit='ms')}" in text
    assert Recording(time, {"q_hip": angle}, "x").warnings == ()


def test_a_slow_log_is_left_alone():
    """Long ones of few samples a second, of a slow motion or one that rests nearly always; short slow ones."""
    time = 0.1 * np.arange(36000)
    turning = np.sin(0.03 * time)
    assert Recording(time, {"q_hip": turning}, "x").warnings == ()
    assert Recording(time, {"q_hip": np.clip(time - 1800.0, 0.0, 1.0)}, "x").warnings == ()
    assert Recording(time[:5000], {"q_hip": 0.1 * turning[:5000]}, "x").warnings == ()
    assert Recording(time, {"q_hip": np.full(36000, 0.2), "tau_motor_hip": turning}, "x").warnings == ()


def test_gaps_coarse_time_and_wraps_are_reported():
    gap = Recording([0.0, 0.1, 0.2, 0.9, 1.0, 1.1], {}, "x")
    assert "1 gaps" in gap.warnings[0]
    assert "after sample 2" in gap.warnings[0]
    assert not gap.is_uniform
    assert "milliseconds" in Recording([0.0, 1.0, 2.0], {}, "x").warnings[0]
    angle = np.linspace(0.0, 9.0, 200)
    turns = Recording(0.01 * np.arange(200), {"q_hip": np.mod(angle, 2 * np.pi)}, "x")
    assert "whole turn" in turns.warnings[0]
    assert Recording(turns.time, {"q_hip": angle}, "x").warnings == ()


def test_crop_keeps_both_ends_and_drops_warnings_that_no_longer_hold():
    leg = Recording([0.0, 0.1, 0.2, 0.9, 1.0, 1.1], {"q_hip": np.arange(6.0)}, "x", ("kept",))
    assert len(leg.warnings) == 2
    part = leg.crop(0.9, 1.1)
    assert part.time.tolist() == [0.9, 1.0, 1.1]
    assert part.columns["q_hip"].tolist() == [3.0, 4.0, 5.0]
    assert part.warnings == ("kept",)
    assert leg.crop().samples == 6
    with pytest.raises(RecordingError, match=r"only 1 of 6 samples.*from 0 s to 1.1 s"):
        leg.crop(stop=0.05)


def test_replace_columns_keeps_order_and_checks():
    leg = recording(q_hip=TIME, battery=TIME)
    changed = leg.replace_columns({"q_hip": np.ones(6), "current_hip": range(6)})
    assert list(changed.columns) == ["q_hip", "battery", "current_hip"]
    assert changed.columns["q_hip"].tolist() == [1.0] * 6
    assert leg.columns["q_hip"][1] == 0.1
    with pytest.raises(RecordingError, match="3 samples"):
        leg.replace_columns({"q_hip": np.ones(3)})


@pytest.mark.parametrize("again", [copy.deepcopy, lambda leg: pickle.loads(pickle.dumps(leg))])
def test_recordings_travel_between_processes(again):
    leg = Recording(TIME, {"q_hip": TIME, "odd": TIME}, "x", ("w",), ("n",))
    other = again(leg)
    assert other.warnings == leg.warnings
    assert other.notes == ("n",)
    assert np.array_equal(other.columns["q_hip"], TIME)
    assert not other.columns["q_hip"].flags.writeable


def test_summary_says_extent_ranges_units_and_warnings():
    text = recording(q_hip=TIME - 0.2, current_hip=TIME, odd=TIME).summary()
    for part in ("leg.csv", "6 samples over 0.5 s", "10 Hz, uniform", "joints: hip", "-0.2 to", "[A]", "warning:"):
        assert part in text
