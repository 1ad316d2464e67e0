"""Power that deviations have in common, against truth."""

import numpy as np
import pytest

from sea_ident.discrepancy.simulated.deviations import common_power, noise_power, spread_of_power


def noisy(seed, signal, periods=10, samples=200):
    rng = np.random.default_rng(seed)
    slow = rng.standard_normal((periods, 8, 1)) * np.array([1.0, 3.0])
    shape = np.cos(np.outer(np.arange(samples) * 2 * np.pi / samples, np.arange(1, 9)))
    return signal[:, None] * np.array([1.0, 0.0]) + np.einsum("tk,pkj->ptj", shape, slow)


def test_noise_cancels_in_what_periods_have_in_common():
    signal = np.sin(np.arange(200) * 2 * np.pi / 200)
    cases = [noisy(seed, signal) for seed in range(400)]
    powers = np.array([common_power(case) for case in cases])
    assert abs(powers[:, 0].mean() - 0.5) < 4.0 * powers[:, 0].std() / 20.0
    assert abs(powers[:, 1].mean()) < 4.0 * powers[:, 1].std() / 20.0
    spread = np.array([spread_of_power(case)[1] for case in cases])
    assert np.sqrt(np.mean(spread**2)) == pytest.approx(powers[:, 1].std(), rel=0.15)
    noise = np.array([noise_power(case)[1] for case in cases])
    assert noise.mean() == pytest.approx(9.0 * 8 / 2 / 10, rel=0.05)


def test_two_deviations_give_their_product():
    deviations = np.stack([np.full((5, 1), 2.0), np.full((5, 1), 3.0)])
    assert common_power(deviations) == pytest.approx(6.0)
    assert noise_power(deviations) == pytest.approx(0.25)
