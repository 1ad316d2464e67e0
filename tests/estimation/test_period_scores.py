"""Scores of periods: what they sum up to, and that their spread is that of their mean."""

import numpy as np
import pytest

from sea_ident.estimation.period_scores import period_scores
from sea_ident.processing.harmonics import differentiate

PERIODS, SAMPLES, HARMONICS = 12, 400, 40
CONSECUTIVE = tuple(range(PERIODS))
GAPS = (0, 1, 2, 3, 5, 6, 7, 9, 10, 11, 12, 13)


def instruments():
    """(N, 1, 3) slow and periodic, none of them small where periods meet."""
    phase = 2.0 * np.pi * np.arange(SAMPLES) / SAMPLES
    return np.stack([np.ones(SAMPLES), 1.0 + np.cos(phase), np.cos(2.0 * phase + 0.3)], axis=1)[:, None, :]


def accelerations(seed, places):
    """(P, N, 1) second derivative of the noise of an encoder, filtered as positions are, of some periods."""
    count = places[-1] + 3
    noise = np.random.default_rng(seed).standard_normal((count * SAMPLES, 1))
    parts = differentiate(noise, float(count), HARMONICS * count)[2].reshape(count, SAMPLES, 1)
    return parts[np.asarray(places) + 1]


def sharp(residuals):
    return np.einsum("pkn,knc->pc", residuals, instruments())


def of_the_mean(scores):
    """Variance of the mean of the scores by their spread."""
    return scores.var(axis=0, ddof=1) / len(scores)


@pytest.mark.parametrize("places", [CONSECUTIVE, GAPS], ids=["consecutive", "gaps"])
def test_the_spread_of_differentiated_noise_is_that_of_its_mean(places):
    soft, hard, true = [], [], []
    for seed in range(300):
        residuals = accelerations(seed, places)
        soft.append(of_the_mean(period_scores(residuals, instruments(), places)))
        hard.append(of_the_mean(sharp(residuals)))
        true.append(sharp(residuals).mean(axis=0))
    actual = np.var(true, axis=0)
    ratio = np.sqrt(np.mean(soft, axis=0) / actual)
    assert np.all(np.abs(ratio - 1.0) < 0.2)
    # with sharp borders the spread is made of what neighbours have with opposite signs
    assert np.all(np.sqrt(np.mean(hard, axis=0) / actual) > 1.5)


def test_white_noise_scatters_as_with_sharp_borders():
    soft, hard = [], []
    for seed in range(300):
        residuals = np.random.default_rng(seed).standard_normal((PERIODS, SAMPLES, 1))
        soft.append(of_the_mean(period_scores(residuals, instruments(), CONSECUTIVE)))
        hard.append(of_the_mean(sharp(residuals)))
    np.testing.assert_allclose(np.mean(soft, axis=0), np.mean(hard, axis=0), rtol=0.05)


def test_what_one_period_gives_the_next_takes():
    residuals = np.random.default_rng(0).standard_normal((PERIODS, SAMPLES, 1))
    soft, hard = period_scores(residuals, instruments(), GAPS), sharp(residuals)
    # up to the common factor by which shared noise scatters less
    factor = soft.sum(axis=0) / hard.sum(axis=0)
    np.testing.assert_allclose(factor, factor[0], rtol=1e-12)
    assert 1.0 < factor[0] < 1.05
    # nothing is handed over a gap: between periods 3 and 5 each group has its own sum
    np.testing.assert_allclose(soft[:4].sum(axis=0), factor[0] * hard[:4].sum(axis=0), rtol=1e-12)
    np.testing.assert_allclose(soft[4:7].sum(axis=0), factor[0] * hard[4:7].sum(axis=0), rtol=1e-12)


def test_periods_that_stand_alone_have_their_own_sums():
    residuals = np.random.default_rng(0).standard_normal((4, SAMPLES, 1))
    np.testing.assert_allclose(period_scores(residuals, instruments(), (0, 2, 4, 6)), sharp(residuals), rtol=1e-12)
