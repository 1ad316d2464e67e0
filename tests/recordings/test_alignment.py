"""Clocks brought together, judged by signals known at every instant."""

import warnings

import numpy as np
import pytest

from sea_ident.exceptions import RecordingError
from sea_ident.recordings import (
    ClockAlignment,
    ColumnSource,
    Stream,
    align_streams,
    read_recording,
)


def link(start=0.0, stop=10.0, rate=100.0, joint="hip"):
    time = start + np.arange(int((stop - start) * rate) + 1) / rate
    return Stream("link", time, {f"q_{joint}": 2.0 * time + 1.0})


def motor(start=0.5, stop=9.0, rate=70.0):
    time = start + np.arange(int((stop - start) * rate) + 1) / rate
    return Stream("motor", time, {"theta_hip": 3.0 * time})


def test_signals_meet_at_the_samples_of_the_first_clock_inside_the_overlap():
    aligned = align_streams([link(), motor()], source="log")
    leg = aligned.recording
    assert leg.time[0] == 0.5
    assert leg.time[-1] == pytest.approx(9.0)
    assert np.all(np.isin(leg.time, link().time))
    np.testing.assert_allclose(leg.columns["q_hip"], 2.0 * leg.time + 1.0, rtol=1e-14)
    np.testing.assert_allclose(leg.columns["theta_hip"], 3.0 * leg.time, rtol=1e-13)
    first, second = aligned.streams
    assert (first.name, first.interpolated, first.offset) == ("link", False, 0.0)
    assert (second.name, second.interpolated, second.samples) == ("motor", True, 596)
    assert second.rate == pytest.approx(70.0)
    assert leg.warnings == ()
    assert "clock 'motor': 596 samples at 70 Hz, interpolated" in leg.notes
    assert "log" in aligned.summary()


def test_a_stated_rate_gives_an_even_grid_that_ends_inside():
    leg = align_streams([link(), motor()], ClockAlignment(rate=40.0)).recording
    np.testing.assert_allclose(leg.time, 0.5 + np.arange(341) / 40.0, rtol=1e-14)
    assert leg.time[-1] <= motor().time[-1]
    np.testing.assert_allclose(leg.columns["theta_hip"], 3.0 * leg.time, rtol=1e-13)


def test_the_reference_can_be_chosen():
    leg = align_streams([link(), motor()], ClockAlignment(reference="motor")).recording
    assert np.array_equal(leg.time, motor().time[motor().time <= 9.0])


def test_a_given_offset_moves_a_clock():
    leg = align_streams([link(), motor()], ClockAlignment(offsets={"motor": 0.25})).recording
    np.testing.assert_allclose(leg.columns["theta_hip"], 3.0 * (leg.time - 0.25), rtol=1e-12)
    assert any("offset +0.25 s" in note for note in leg.notes)


def test_points_inside_a_gap_are_dropped_not_filled():
    stream = motor()
    keep = (stream.time < 4.0) | (stream.time > 5.0)
    gappy = Stream("motor", stream.time[keep], {"theta_hip": stream.columns["theta_hip"][keep]})
    aligned = align_streams([link(), gappy])
    time = aligned.recording.time
    assert not np.any((time > gappy.time[gappy.time < 4.0][-1]) & (time < gappy.time[gappy.time > 5.0][0]))
    assert aligned.streams[1].dropped > 90
    assert any("nothing is filled in" in text for text in aligned.recording.warnings)
    assert any("1 gaps" in text for text in aligned.recording.warnings)
    across = align_streams([link(), gappy], ClockAlignment(longest_gap=2.0))
    assert across.streams[1].dropped == 0
    assert across.recording.warnings == ()


def test_a_faster_clock_sampled_slowly_is_reported():
    fast = motor(rate=1000.0)
    aligned = align_streams([link(), fast])
    assert any("folds back" in text for text in aligned.recording.warnings)


def wobble(time):
    return np.sin(2 * np.pi * 0.7 * time) + 0.4 * np.sin(2 * np.pi * 2.3 * time + 1.0)


@pytest.mark.parametrize("offset", [0.0073, -0.12, 0.0])
def test_an_offset_is_found_from_the_motion_that_both_sides_share(offset):
    rng = np.random.default_rng(3)
    own = np.arange(0.0, 20.0, 0.002)
    other = np.arange(0.1, 19.0, 0.001)
    q = wobble(own) + 1e-4 * rng.normal(size=own.size)
    theta = wobble(other) + 1e-4 * rng.normal(size=other.size)
    streams = [
        Stream("link", own, {"q_hip": q}),
        Stream("motor", other - offset, {"theta_hip": theta}),
    ]
    aligned = align_streams(streams, ClockAlignment(rate=1000.0, estimate=["motor"]))
    report = aligned.streams[1]
    assert report.offset == pytest.approx(offset, abs=1e-4)
    assert report.correlation > 0.95
    leg = aligned.recording
    np.testing.assert_allclose(leg.columns["theta_hip"], leg.columns["q_hip"], atol=2e-3)
    assert any("estimated" in note for note in leg.notes)


def test_an_offset_is_not_made_up():
    rng = np.random.default_rng(0)
    time = np.arange(0.0, 10.0, 0.01)
    how = ClockAlignment(estimate=["motor"])

    def streams(theta):
        return [Stream("link", time, {"q_hip": wobble(time)}), Stream("motor", time, theta)]

    noise = np.cumsum(rng.normal(size=time.size))
    with pytest.raises(RecordingError, match=r"at most 0\.\d\d"):
        align_streams(streams({"theta_hip": noise}), how)
    with pytest.raises(RecordingError, match="no joint has a position"):
        align_streams(streams({"theta_knee": noise}), how)
    with pytest.raises(RecordingError, match=r"at most 0.00"):
        align_streams(streams({"theta_hip": np.zeros(time.size)}), how)
    with pytest.raises(RecordingError, match="overlap for 0 s only"):
        align_streams(streams({"theta_hip": noise}), ClockAlignment(estimate=["motor"], largest_offset=6.0))
    late = wobble(time - 0.6)
    with pytest.raises(RecordingError, match=r"bound of -0.5|at most"):
        align_streams(streams({"theta_hip": late}), how)


@pytest.mark.parametrize(
    ("streams", "how", "part"),
    [
        ([link(0, 1), motor(5, 6)], None, r"do not overlap: link from 0 s to 1 s; motor from 5 s to 6 s"),
        ([link(), link()], None, "different names"),
        ([], None, "different names"),
        (
            [link(), motor()],
            ClockAlignment(offsets={"motors": 1.0}),
            "no clock is called 'motors'; there are link, motor",
        ),
        ([link(), motor()], ClockAlignment(reference="x"), "no clock is called 'x'"),
        ([link(), motor()], ClockAlignment(offsets={"motor": np.nan}), "offset of 'motor' is nan"),
        ([link(), motor()], ClockAlignment(offsets={"motor": 1.0}, estimate=["motor"]), "both given and"),
        ([link(), motor()], ClockAlignment(rate=0.0), "rate is 0"),
        ([link(), motor()], ClockAlignment(rate=1e12), "at most 100000000"),
        ([link(), Stream("motor", link().time, link().columns)], None, "q_hip comes from two streams"),
        ([link(), Stream("motor", np.array([0.0, 0.0]), {})], None, r"clock 'motor': time repeats"),
        ([link(), Stream("motor", np.array([0.0, 9.9]), {"theta_hip": np.zeros(2)})], None, None),
    ],
)
def test_what_cannot_be_aligned_is_refused(streams, how, part):
    if part is None:
        assert align_streams(streams, how).recording.samples == 991
        return
    with pytest.raises(RecordingError, match=part):
        align_streams(streams, how)


def test_tables_with_several_time_columns(tmp_path):
    path = tmp_path / "log.npz"
    t, t2 = np.arange(0, 1000, 10.0), np.arange(5, 990, 4.0)
    np.savez(path, t=t, pos=180.0 * t, t2=t2, current=t2, other=t2)
    leg = read_recording(
        path,
        columns={
            "time": ColumnSource("t", unit="ms"),
            "q_hip": ColumnSource("pos", unit="deg"),
            "current_hip": ColumnSource("current", unit="mA", time=ColumnSource("t2", unit="ms")),
        },
        clocks=ClockAlignment(rate=200.0),
    )
    assert leg.time[0] == pytest.approx(0.005)
    np.testing.assert_allclose(leg.columns["q_hip"], np.pi * 1e3 * leg.time, rtol=1e-12)
    np.testing.assert_allclose(leg.columns["current_hip"], leg.time, rtol=1e-12)
    assert "left out of the file: other" in leg.notes
    with pytest.raises(RecordingError, match=r"no column 't3' \(wanted for the time of q_hip\)"):
        read_recording(path, columns={"time": "t", "q_hip": ColumnSource("pos", time="t3")})


def test_a_rate_can_be_asked_for_with_one_clock(tmp_path):
    np.savez(tmp_path / "x.npz", time=[0.0, 0.1, 0.25, 0.3], q_hip=[0.0, 1.0, 2.5, 3.0])
    leg = read_recording(tmp_path / "x.npz", clocks=ClockAlignment(rate=20.0))
    np.testing.assert_allclose(leg.time, 0.05 * np.arange(7))
    np.testing.assert_allclose(leg.columns["q_hip"], 10 * leg.time, atol=1e-12)


def test_positions_of_a_slow_clock_are_joined_without_corners():
    """Straight lines between samples 20 ms apart are wrong by a tenth of the deflection of a spring."""
    fast, slow = np.arange(0.0, 4.0, 0.002), np.arange(0.0, 4.0, 0.02)
    streams = [
        Stream("fast", fast, {"q_a": np.sin(5.0 * fast)}),
        Stream("slow", slow, {"theta_a": np.sin(5.0 * slow), "tau_motor_a": np.sign(np.sin(5.0 * slow) + 0.01)}),
    ]
    recording = align_streams(streams).recording
    error = recording.columns["theta_a"] - np.sin(5.0 * recording.time)
    assert np.max(np.abs(error)) < 1e-5
    assert np.max(np.abs(recording.columns["tau_motor_a"])) == 1.0


def test_splines_stop_at_gaps():
    fast = np.arange(0.0, 4.0, 0.002)
    slow = np.arange(0.0, 4.0, 0.02)
    slow = slow[(slow < 1.0) | (slow > 2.0)]
    values = np.where(slow < 1.5, 1.0, 100.0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        recording = align_streams(
            [Stream("fast", fast, {"q_a": np.sin(fast)}), Stream("slow", slow, {"theta_a": values})]
        ).recording
    assert set(np.unique(np.round(recording.columns["theta_a"], 9))) == {1.0, 100.0}
