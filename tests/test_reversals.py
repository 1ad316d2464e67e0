"""What happens around reversals, and what of it rings beside them."""

import numpy as np
import pytest

from sea_ident.reversals import around_mean_reversal, around_reversal, without_ringing

SAMPLES, HARMONICS = 400, 60


@pytest.fixture
def speed():
    return np.cos(2.0 * np.pi * 2.0 * np.arange(SAMPLES) / SAMPLES + 0.3)


def band_limited(values):
    spectrum = np.fft.rfft(values)
    spectrum[HARMONICS + 1 :] = 0.0
    return np.fft.irfft(spectrum, SAMPLES)


def test_two_samples_to_either_side_are_around_a_reversal(speed):
    around = around_reversal(100.0 * speed)
    for after in np.flatnonzero(np.sign(speed) != np.sign(np.roll(speed, 1))):
        assert around[(after + np.arange(-2, 2)) % SAMPLES].all()
    assert np.count_nonzero(around) == 16


def test_so_is_what_periods_do_not_agree_on(speed):
    apart = [speed + shift for shift in (-0.2, 0.2)]
    around = around_mean_reversal(speed, apart)
    np.testing.assert_array_equal(around[np.abs(speed) < 2.0 * 0.2 * np.sqrt(2.0)], True)
    np.testing.assert_array_equal(around_mean_reversal(speed, apart[:1]), around_reversal(speed))


def test_what_is_around_reversals_is_taken_out_where_it_rings(speed):
    out = around_reversal(speed)
    pulses = np.where(out, np.random.default_rng(1).normal(size=SAMPLES), 0.0)
    ringing = band_limited(pulses)
    assert np.abs(ringing[~out]).max() > 0.1
    left = without_ringing(np.stack([ringing, -ringing]), out, HARMONICS)
    assert np.abs(left[:, ~out]).max() < 0.02 * np.abs(ringing[~out]).max()
    np.testing.assert_array_equal(left[:, out], np.stack([ringing, -ringing])[:, out])


def test_what_is_elsewhere_stays(speed):
    out = around_reversal(speed)
    slow = np.sin(2.0 * np.pi * 3.0 * np.arange(SAMPLES) / SAMPLES)
    noise = np.random.default_rng(2).normal(size=(50, SAMPLES))
    for values, kept in ((slow, 0.9), (noise, 0.95)):
        left = without_ringing(values, out, HARMONICS)
        assert kept < np.linalg.norm(left[..., ~out]) / np.linalg.norm(values[..., ~out]) <= 1.0


def test_a_joint_that_rests_for_long_has_a_few_columns_only(monkeypatch):
    """A sample of the rest counts where it is near its ends."""
    sizes, solve = [], np.linalg.eigh
    monkeypatch.setattr(np.linalg, "eigh", lambda gram: sizes.append(len(gram)) or solve(gram))
    rest = np.arange(20 * SAMPLES) < 12 * SAMPLES
    without_ringing(np.ones(20 * SAMPLES), rest, 20 * HARMONICS)
    assert sizes == [2 * (20 * SAMPLES // (20 * HARMONICS))]
