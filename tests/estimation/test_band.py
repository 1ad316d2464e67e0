"""What of equations moves an estimate: a projection onto some harmonics that vanishes around reversals."""

import numpy as np
import pytest

from sea_ident.estimation.estimators.band import Band
from sea_ident.processing.harmonics import within
from sea_ident.reversals import around_reversal

SAMPLES, HARMONICS = 1000, 80
PHASE = 2.0 * np.pi * np.arange(SAMPLES) / SAMPLES


def speeds(shift=0.0):
    """(N, 2) of two joints, the samples by a share of their interval later."""
    phase = PHASE + shift * PHASE[1]
    return np.stack([np.cos(2.0 * phase + 0.3), np.sin(3.0 * phase) + 0.2], axis=1)


@pytest.fixture
def band():
    return Band(SAMPLES, HARMONICS, np.stack([around_reversal(v) for v in speeds().T], axis=1))


def test_it_is_a_projection(band):
    one, other = np.random.default_rng(0).normal(size=(2, SAMPLES, 2, 3))
    part = band.part_of(one)
    np.testing.assert_allclose(band.part_of(part), part, atol=1e-12)
    assert np.sum(part * other) == pytest.approx(np.sum(one * band.part_of(other)))
    np.testing.assert_allclose(within(part, HARMONICS), part, atol=1e-12)


def test_it_vanishes_around_reversals_and_leaves_the_rest(band):
    slow = np.stack([np.sin(5.0 * PHASE), np.cos(4.0 * PHASE)], axis=1)
    before = slow.copy()
    part = band.part_of(slow)
    np.testing.assert_array_equal(slow, before)
    for i, out in enumerate(band.left_out.T):
        assert np.abs(part[out, i]).max() < 0.05 * np.abs(slow[out, i]).max()
    far = ~np.any([np.roll(band.left_out, shift, axis=0) for shift in range(-20, 21)], axis=0)
    assert np.abs(part - slow)[far].max() < 0.1
    noise = np.random.default_rng(1).normal(size=(SAMPLES, 2))
    kept = np.sum(band.part_of(noise) ** 2) / np.sum(within(noise, HARMONICS) ** 2)
    assert 0.8 < kept < 1.0


@pytest.mark.parametrize("shift", [0.0, 0.3, 0.7])
def test_where_a_jump_falls_between_two_samples_is_not_seen(band, shift):
    """Samples of a sign see a jump at a sample; its harmonics, from finer samples, see it where it is."""
    fine = 50
    phase = 2.0 * np.pi * np.arange(SAMPLES * fine) / (SAMPLES * fine) + shift * PHASE[1]
    exact = np.sign(np.stack([np.cos(2.0 * phase + 0.3), np.sin(3.0 * phase) + 0.2], axis=1))
    error = np.sign(speeds(shift)) - within(exact, SAMPLES // 2 - 1)[::fine]
    seen, slow = band.part_of(error), np.cos(2.0 * PHASE)[:, None]
    plain = within(error, HARMONICS)
    assert np.sum(seen**2) < 0.02 * np.sum(plain**2)
    assert np.all(np.abs(np.sum(seen * slow, axis=0)) < 0.1 * np.abs(plain).sum(axis=0))


def test_it_vanishes_in_a_long_rest():
    rest = np.stack([np.arange(20 * SAMPLES) < 4 * SAMPLES, np.zeros(20 * SAMPLES, dtype=bool)], axis=1)
    band = Band(20 * SAMPLES, HARMONICS, rest)
    part = band.part_of(np.ones((20 * SAMPLES, 2)))
    assert np.abs(part[SAMPLES : 3 * SAMPLES, 0]).max() < 0.05
    np.testing.assert_allclose(part[:, 1], 1.0)
