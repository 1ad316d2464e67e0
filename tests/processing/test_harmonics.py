"""Derivatives of periods that are not quite periodic, against those of functions known in closed form."""

import numpy as np
import pytest

from sea_ident.processing.harmonics import (
    choose_harmonics,
    choose_motor_harmonics,
    differentiate,
    differentiate_periods,
)

PERIOD, SAMPLES, HARMONICS = 10.0, 1000, 20
BASE = 2.0 * np.pi / PERIOD


def wave(amplitude, frequency, phase):
    """A sine as a function of time and order of derivative; frequency in units of the base frequency."""
    rate = frequency * BASE
    return lambda time, order: amplitude * rate**order * np.sin(rate * time + phase + order * np.pi / 2.0)


def ramp(slope):
    return lambda time, order: (slope * time, np.full_like(time, slope), np.zeros_like(time))[order]


def settling(size, constant):
    return lambda time, order: size * (-1.0 / constant) ** order * np.exp(-time / constant)


def motion(deviation, places):
    """Three derivatives (P, N, 2) of a periodic motion with a deviation that is not, at some periods of a recording."""
    time = (np.add.outer(np.asarray(places) * SAMPLES, np.arange(SAMPLES)) * (PERIOD / SAMPLES))[:, :, None]
    parts = [wave(0.3, 1.0, 0.2), wave(0.1, 2.0, 1.1), wave(0.05, 5.0, -0.7)]
    first = [sum(part(time, order) for part in parts) + deviation(time, order) for order in range(3)]
    second = [wave(0.2, 3.0, 0.4)(time, order) - 0.5 * deviation(time, order) for order in range(3)]
    return [np.concatenate([a, b], axis=2) for a, b in zip(first, second, strict=True)]


def largest(found, exact):
    """Largest error of position, velocity and acceleration over all samples, those at the ends of periods included."""
    return np.array([np.abs(f - e).max() for f, e in zip(found, exact, strict=True)])


SLOW = {"sine": wave(1e-3, 0.37, 0.4), "ramp": ramp(1e-4), "settling": settling(5e-3, 35.0)}
"""Slow against the period: some mrad in a minute."""

PLACES = {
    "consecutive": (0, 1, 2, 3, 4, 5),
    "one left out in the middle": (0, 1, 2, 4, 5),
    "two gaps": (1, 2, 4, 7, 8),
}
TOLERANCE = np.array([2e-6, 5e-5, 1e-3])
"""Of position [rad], velocity [rad/s] and acceleration [rad/s2]; harmonic 20 turns 1e-6 rad into 1.6e-4 rad/s2."""


@pytest.mark.parametrize("places", PLACES.values(), ids=PLACES)
@pytest.mark.parametrize("deviation", SLOW.values(), ids=SLOW)
def test_slow_deviations_leave_the_derivatives_right_up_to_the_ends_of_periods(deviation, places):
    exact = motion(deviation, places)
    error = largest(differentiate_periods(exact[0], PERIOD, HARMONICS, places), exact)
    assert np.all(error < TOLERANCE)
    # a series for every period by itself jumps where the period closes
    alone = largest(differentiate(exact[0], PERIOD, HARMONICS), exact)
    assert np.all(alone > 10.0 * TOLERANCE)


def test_periods_laid_across_a_gap_would_jump_there():
    places = PLACES["one left out in the middle"]
    exact = motion(SLOW["ramp"], places)
    apart = largest(differentiate_periods(exact[0], PERIOD, HARMONICS, places), exact)
    together = largest(differentiate_periods(exact[0], PERIOD, HARMONICS), exact)
    assert np.all(together > 20.0 * apart)


def test_a_faster_deviation_is_right_inside_the_recording_and_in_slope_at_its_ends():
    places = PLACES["consecutive"]
    deviation = wave(1e-3, 3.3, 0.4)
    exact = motion(deviation, places)
    found = differentiate_periods(exact[0], PERIOD, HARMONICS, places)
    inside = largest([f[1:-1] for f in found], [e[1:-1] for e in exact])
    assert np.all(inside < TOLERANCE / 5.0)
    ends = largest(found, exact)
    assert np.all(ends[:2] < [1e-5, 5e-4])
    assert ends[2] < 4.3e-3  # the acceleration of the deviation itself, whose curvature is not led on
    assert np.all(largest(differentiate(exact[0], PERIOD, HARMONICS), exact) > 9.0 * ends)


def test_what_repeats_exactly_has_the_derivatives_of_its_series():
    exact = motion(lambda time, order: np.zeros_like(time), range(4))
    found = differentiate_periods(exact[0], PERIOD, HARMONICS)
    np.testing.assert_allclose(found[0], exact[0], atol=1e-14)
    np.testing.assert_allclose(found[1], exact[1], atol=1e-13)
    np.testing.assert_allclose(found[2], exact[2], atol=1e-12)


@pytest.mark.parametrize("places", [(0,), (0, 2, 4)], ids=["one period", "none next to another"])
def test_periods_without_neighbours(places):
    exact = motion(lambda time, order: np.zeros_like(time), places)
    found = differentiate_periods(exact[0], PERIOD, HARMONICS, places)
    for part, known in zip(found, exact, strict=True):
        np.testing.assert_allclose(part, known, atol=1e-12)


@pytest.mark.parametrize("harmonics", [5, 20, 80, 400])
def test_white_noise_is_not_raised_at_the_ends(harmonics):
    noise = 1e-5 * np.random.default_rng(1).standard_normal((6, SAMPLES, 60))
    near = max(SAMPLES // (2 * harmonics), 6)
    for part in differentiate_periods(noise, PERIOD, harmonics):
        ends = np.sqrt(np.mean(np.square(np.concatenate([part[0, :near], part[-1, -near:]]))))
        assert ends < 3.0 * np.sqrt(np.mean(np.square(part[2:4])))


def test_the_mean_of_the_periods_is_the_series_of_the_mean_where_nothing_drifts():
    rng = np.random.default_rng(2)
    exact = motion(lambda time, order: np.zeros_like(time), range(8))
    noisy = exact[0] + 1e-5 * rng.standard_normal(exact[0].shape)
    found = differentiate_periods(noisy, PERIOD, HARMONICS)
    series = differentiate(noisy.mean(axis=0), PERIOD, HARMONICS)
    scale = [1e-5, 1e-5 * 20 * BASE, 1e-5 * (20 * BASE) ** 2]
    for part, one, noise in zip(found, series, scale, strict=True):
        np.testing.assert_allclose(part.mean(axis=0), one, atol=noise)


def noisy(position, periods, noise, seed):
    """(P, N, 1) periods of a position with white noise."""
    shape = (periods, len(position), 1)
    return position[:, None] + noise * np.random.default_rng(seed).standard_normal(shape)


def jerking():
    """A motor whose acceleration nearly jumps at every reversal, with its spectrum, in harmonics up to a third."""
    phase = 2.0 * np.pi * np.arange(SAMPLES) / SAMPLES
    velocity = np.sin(phase + 0.3) + 0.8 * np.sin(2.0 * phase + 1.0) + 0.7 * np.sin(5.0 * phase - 0.6)
    acceleration = np.tanh(velocity / 0.1)
    most = SAMPLES // 3
    rate = BASE * np.arange(1, most + 1)
    spectrum = np.zeros(SAMPLES // 2 + 1, dtype=complex)
    spectrum[1 : most + 1] = -np.fft.rfft(acceleration)[1 : most + 1] / rate**2
    return np.fft.irfft(spectrum, SAMPLES), np.abs(spectrum[1 : most + 1] / SAMPLES) ** 2


@pytest.mark.parametrize("noise", [1e-6, 1e-5, 1e-4])
def test_what_is_left_out_of_a_jerking_motor_is_small_beside_the_noise_of_what_is_kept(noise):
    periods = 12
    position, power = jerking()
    weight = np.arange(1, len(power) + 1) ** 4.0
    kept = np.cumsum(weight) * noise**2 / (SAMPLES * periods)
    lost = np.append(np.cumsum((weight * power)[::-1])[::-1][1:], 0.0)
    ratio = np.sqrt(lost / kept)
    stacks = [noisy(position, periods, noise, seed) for seed in range(10)]
    by_one = np.array([choose_harmonics(stack, len(power)) for stack in stacks]) - 1
    by_bands = np.array([choose_motor_harmonics(stack, len(power)) for stack in stacks]) - 1
    assert np.max(ratio[by_bands]) < 0.65
    assert np.mean(ratio[by_bands]) < 0.3 * np.mean(ratio[by_one])
    # nor is more kept than what the truth would advise
    cost = kept + 4.0 * lost
    assert np.mean(cost[by_bands]) < 1.5 * cost.min() < np.mean(cost[by_one])


@pytest.mark.parametrize("periods", [6, 20])
@pytest.mark.parametrize("number", [3, 20])
def test_a_motor_without_a_tail_keeps_no_more_harmonics_than_it_has(number, periods):
    phase = 2.0 * np.pi * np.arange(200) / 200
    position = 0.3 * np.sin(phase + 0.4) + 0.1 * np.sin(2.0 * phase) + 0.3 / number**2 * np.sin(number * phase + 1.0)
    found = [choose_motor_harmonics(noisy(position, periods, 1e-5, seed), 66) for seed in range(10)]
    assert np.mean(np.array(found) == number) >= 0.9


def test_few_periods_tell_too_little_of_the_noise_to_judge_bands():
    stack = noisy(jerking()[0], 5, 1e-5, 0)
    assert choose_motor_harmonics(stack, 333) == choose_harmonics(stack, 333)


def test_steps_of_a_coarse_encoder_that_repeat_are_no_signal():
    step = 2e-3
    stack = step * np.round(noisy(jerking()[0], 12, 0.02 * step, 0) / step)
    assert choose_motor_harmonics(stack, 333) == choose_harmonics(stack, 333)
