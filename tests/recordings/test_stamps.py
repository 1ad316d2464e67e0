"""Samples taken evenly and stamped late go back to their places."""

import numpy as np
import pytest

from sea_ident.exceptions import RecordingError
from sea_ident.recordings import ColumnSource, read_recording
from sea_ident.recordings.stamps import even_stamps

INTERVAL = 0.002


def evenly(count: int, drift: float = 0.0):
    return 17.0 + INTERVAL * (1.0 + drift) * np.arange(count)


@pytest.mark.parametrize("drift", [0.0, 3e-5, -3e-5])
def test_stamps_with_jitter_drift_and_losses(drift):
    rng = np.random.default_rng(0)
    taken = evenly(20_000, drift)
    taken = taken[np.sort(rng.choice(len(taken), 19_950, replace=False))]
    stamps = np.sort(taken + np.abs(rng.normal(0.0, 1e-4, len(taken))))
    found = even_stamps(stamps, INTERVAL, "t")
    np.testing.assert_allclose(np.diff(found), np.diff(taken), atol=1e-8)
    np.testing.assert_allclose(found, taken, atol=2e-4)


def test_bursts_that_are_written_late_go_back():
    rng = np.random.default_rng(1)
    taken = evenly(10_000)
    late = np.zeros(len(taken))
    for k in rng.choice(len(taken) - 10, 100, replace=False):
        wait = taken[k] + rng.exponential(0.006) - taken[k : k + 8]
        late[k : k + 8] = np.maximum(late[k : k + 8], wait + 1e-5 * np.arange(8))
    found = even_stamps(np.maximum.accumulate(taken + late), INTERVAL, "t")
    np.testing.assert_allclose(np.diff(found), INTERVAL, rtol=1e-5)


def test_coarse_stamps_are_told_apart():
    found = even_stamps(np.round(evenly(5000), 2), INTERVAL, "t")
    np.testing.assert_allclose(np.diff(found), INTERVAL, rtol=1e-4)


def test_stamps_on_another_grid_are_refused():
    with pytest.raises(RecordingError, match=r"interval 0\.004: .*the closest has 0\.002"):
        even_stamps(evenly(5000), 0.004, "t")
    repeated = np.sort(np.concatenate([evenly(5000), evenly(5000)[::100]]))
    with pytest.raises(RecordingError, match="rows that repeat"):
        even_stamps(repeated, INTERVAL, "t")
    falling = evenly(5000)
    falling[2000:] -= 1.0
    with pytest.raises(RecordingError, match="before the one ahead"):
        even_stamps(falling, INTERVAL, "t")


def test_interval_is_in_the_unit_of_the_file_and_noted(tmp_path):
    path = tmp_path / "log.csv"
    stamps = np.round(1e3 * evenly(500) + np.random.default_rng(0).uniform(0.0, 0.5, 500), 3)
    path.write_text("time,q_a\n" + "\n".join(f"{stamp},{0.01 * k}" for k, stamp in enumerate(stamps)) + "\n")
    recording = read_recording(path, columns={"time": ColumnSource("time", unit="ms", interval=2.0)})
    assert recording.is_uniform
    assert recording.sample_rate == pytest.approx(500.0, rel=1e-4)
    assert any("even grid of 2" in note for note in recording.notes)
    with pytest.raises(RecordingError, match="goes with time only"):
        read_recording(path, columns={"q_a": ColumnSource("q_a", interval=2.0)})
