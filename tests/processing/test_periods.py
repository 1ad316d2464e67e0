"""The period of a recording: found where it is, to a small share of a sample, and not claimed where there is none."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

from sea_ident.processing.periods import detect_period, leading_transients

INTERVAL = 0.01
TIME = np.arange(3000) * INTERVAL


def motion(period, time=TIME):
    """(M, 2) two joints, five harmonics."""
    phase = 2.0 * np.pi * time / period
    a, b = np.random.default_rng(3).normal(0.0, 0.25, (2, 5, 2))
    return sum(np.outer(np.sin(k * phase), a[k - 1]) + np.outer(np.cos(k * phase), b[k - 1]) for k in range(1, 6))


def noise(size, seed=0):
    return size * np.random.default_rng(seed).standard_normal((len(TIME), 2))


@pytest.mark.parametrize("period", [1.0, 2.71828, 6.24, 9.99, 14.5])
@pytest.mark.parametrize("size", [0.0, 1e-5, 1e-3, 3e-2], ids=lambda s: f"noise {s:g}")
def test_period_is_found_to_a_tenth_of_a_sample_over_the_recording(period, size):
    found = detect_period(TIME, motion(period) + noise(size))
    assert found is not None
    assert abs(found - period) * (TIME[-1] / period) < (0.1 if size < 1e-2 else 1.0) * INTERVAL


def test_motion_that_begins_at_rest_does_not_bend_the_period():
    begins = np.minimum(TIME, 1.0)[:, None] ** 2
    found = detect_period(TIME, begins * motion(1.0) + noise(1e-3))
    assert found == pytest.approx(1.0, abs=2e-4)


def test_friction_that_varies_and_a_slow_drift_leave_it_a_period():
    drift = 2e-3 * np.sin(0.13 * TIME)[:, None]
    assert detect_period(TIME, motion(5.0) + drift + noise(1e-4)) == pytest.approx(5.0, abs=1e-3)


def test_scatter_between_repeats_that_does_not_grow_is_no_evidence_against_a_period():
    slow = butter(2, 2.0 * INTERVAL, output="sos")  # 1 Hz: far slower than what counts as noise
    scatter = 0.04 * sosfiltfilt(slow, noise(10.0), axis=0)
    assert np.std(scatter) / np.std(motion(3.0)) > 0.05
    assert detect_period(TIME, motion(3.0) + scatter) == pytest.approx(3.0, abs=0.02)


@pytest.mark.parametrize(("most", "found"), [(0.04, True), (0.3, False)])
def test_a_motion_that_drifts_has_its_period(most, found):
    """By a few hundredths of it in all, as where friction warms up; what drifts by more does not repeat itself."""
    drift = most * (1.0 - np.exp(-TIME[:, None] / 20.0)) * np.roll(motion(3.0), 40, axis=0)
    period = detect_period(TIME, motion(3.0) + drift + noise(1e-5))
    assert period == (pytest.approx(3.0, abs=1e-3) if found else None)


def two_frequencies(rng):
    """What repeats nearly, at lags at which both are nearly through."""
    rates = 2.0 * np.pi * 0.3 * rng.uniform(0.5, 2.0, 2)
    return np.sin(np.multiply.outer(TIME, rates) + rng.uniform(0.0, 6.0, 2)).sum(axis=1, keepdims=True)


def growing(rng):
    return (1.0 + rng.uniform(0.02, 0.1) * TIME[:, None]) * motion(3.0)


def smooth_chance(rng):
    slow = butter(2, 2.0 * 0.3 * INTERVAL, output="sos")
    return sosfiltfilt(slow, rng.standard_normal((len(TIME), 2)), axis=0)


def sweep(rng):
    return np.sin(0.6 * np.pi * (TIME + rng.uniform(0.01, 0.05) * TIME**2 / 2.0))[:, None]


def steps(rng):
    slow = butter(2, 2.0 * INTERVAL, output="sos")
    return sosfiltfilt(slow, np.repeat(rng.standard_normal((10, 2)), len(TIME) // 10, axis=0), axis=0)


@pytest.mark.parametrize("signal", [two_frequencies, growing, smooth_chance, sweep, steps], ids=lambda s: s.__name__)
def test_no_period_is_claimed_of_what_has_none(signal):
    rng = np.random.default_rng(0)
    claimed = sum(detect_period(TIME, signal(rng)) is not None for _ in range(60))
    assert claimed <= 3  # two frequencies may fit together by chance to within a hundredth


def test_nothing_that_moves_has_no_period():
    assert detect_period(TIME, np.ones((len(TIME), 2))) is None


def test_the_smallest_of_several_periods_is_meant():
    found = [detect_period(TIME[:stop], motion(4.0)[:stop]) for stop in (900, 1300, 2500, 3000)]
    assert all(a == pytest.approx(b) for a, b in pairwise(found))


@pytest.mark.parametrize(
    ("start", "drift", "left_out"),
    [
        (0.0, 0.0, 0),
        (0.1, 0.0, 1),  # over after one period
        (100.0, 0.0, 3),  # a thirtieth of it in the second is still much
        (0.0, 0.05, 0),  # the later half drifts by less than a fifth of what the first period is off
        (1.0, 0.05, 1),
    ],
)
def test_a_start_is_left_out_and_a_drift_is_not(start, drift, left_out):
    rng = np.random.default_rng(5)
    period, periods = 100, 20
    shape = np.sin(2.0 * np.pi * np.arange(period) / period)
    p = np.arange(periods)[:, None]
    course = start * 0.03**p * np.cos(0.3 * shape) + drift * 0.85**p * shape
    stack = (shape + course + 1e-3 * rng.normal(size=(periods, period)))[:, :, None]
    assert leading_transients(stack) == left_out


@pytest.mark.parametrize("size", [1e-5, 1e-3])
def test_a_gap_is_compared_with_nothing(size):
    """What is put into a gap to have an even grid bends the period by what it is not."""
    seen = np.ones(len(TIME), dtype=bool)
    seen[1234:1334] = False
    values = motion(2.71828) + noise(size)
    values[~seen] = np.linspace(values[1233], values[1334], 100)
    found = detect_period(TIME, values, seen)
    assert found is not None
    assert abs(found - 2.71828) * (TIME[-1] / 2.71828) < 0.1 * INTERVAL


def test_stamps_that_wander_do_not_make_a_multiple_the_period():
    """One multiple fits a wandering clock best; that is of no use where the recording holds it hardly twice."""
    wander = 1e-3 * np.sin(2.0 * np.pi * TIME / 14.0 * 11.0)
    found = detect_period(TIME, motion(2.0, TIME + wander) + noise(1e-6))
    assert found == pytest.approx(2.0, abs=1e-3)
