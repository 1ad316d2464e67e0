"""Stamps that scatter: told apart whether samples were taken then, or only written down then."""

import numpy as np
import pytest

from sea_ident.processing.late_stamps import late_stamps
from sea_ident.recordings import Recording

GRID = np.arange(5000) * 0.002


def positions(time):
    return np.stack([np.sin(3.0 * time), 0.4 * np.cos(5.0 * time)], axis=1)


def recorded(taken, stamped, noise):
    scatter = noise * np.random.default_rng(1).normal(size=(len(taken), 2))
    q = positions(taken) + scatter
    return Recording(stamped, {"q_a": q[:, 0], "q_b": q[:, 1]}, "log"), q


@pytest.mark.parametrize("noise", [0.0, 1e-5, 1e-4])
def test_stamps_that_are_late_are_told_and_true_ones_are_not(noise):
    uneven = GRID + np.random.default_rng(0).uniform(0.0, 5e-4, len(GRID))
    (told,) = late_stamps(*recorded(GRID, uneven, noise))
    assert "interval=0.002" in told
    assert "0.14 ms" in told
    assert late_stamps(*recorded(uneven, uneven, noise)) == []


def test_lost_samples_are_no_scatter():
    kept = np.sort(np.random.default_rng(0).choice(len(GRID), 4900, replace=False))
    recording, q = recorded(GRID[kept], GRID[kept], 1e-5)
    assert late_stamps(recording, q) == []


def test_nothing_is_said_where_noise_hides_it():
    uneven = GRID + np.random.default_rng(0).uniform(0.0, 5e-4, len(GRID))
    recording, q = recorded(GRID, uneven, 0.3)
    assert late_stamps(recording, q) == []
