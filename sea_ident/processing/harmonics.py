"""Fourier series of periodic signals: how many harmonics the data support, and the derivatives."""

import numpy as np

from sea_ident._typing import FloatArray

SIGNIFICANCE = 1e-3


def spectrum(stack: FloatArray) -> FloatArray:
    """Power of the harmonics of the mean over the periods, and of its noise.

    The noise is the larger of what the scatter between periods says and of the floor of the mean's own spectrum:
    quantisation repeats itself from period to period and is not seen in the scatter.

    Args:
        stack: (P, N, n) signals of P periods.

    Returns:
        (2, N // 2, n) powers |c_l|^2 of the mean, and of its noise, from harmonic 1 on.
    """
    periods, samples, _ = stack.shape
    coefficients = np.fft.rfft(stack, axis=1)[:, 1 : samples // 2 + 1] / samples
    mean = coefficients.mean(axis=0)
    power = np.abs(mean) ** 2
    harmonics = len(power)
    # what cannot repeat in any band-limited motion: the level of the upper half of the spectrum
    floor = np.median(power[harmonics // 2 :], axis=0) / np.log(2.0)
    noise = np.broadcast_to(floor, power.shape).copy()
    if periods > 1:
        scatter = (np.abs(coefficients - mean) ** 2).sum(axis=0) / (periods * (periods - 1))
        width = min(9, harmonics)
        kernel = np.ones(width) / width
        padded = np.pad(scatter, ((width // 2, width - 1 - width // 2), (0, 0)), mode="edge")
        smooth = np.stack([np.convolve(padded[:, i], kernel, mode="valid") for i in range(scatter.shape[1])], axis=1)
        noise = np.maximum(noise, smooth)
    rounding = (1e-15 * np.abs(stack).max(axis=(0, 1))) ** 2
    return np.stack([power, np.maximum(noise, np.maximum(rounding, 1e-300))])


def choose_harmonics(stack: FloatArray, most: int) -> int:
    """The number of harmonics that makes the error of the acceleration smallest.

    Every harmonic kept brings its noise, every harmonic left out its signal, both times the fourth power of its
    number in the acceleration. Only signal that stands out of the noise counts.

    Args:
        stack: (P, N, n) positions of P periods.
        most: largest number to choose.

    Returns:
        Number of harmonics, at least 1, the largest over the signals.
    """
    power, noise = spectrum(stack)
    power, noise = power[:most], noise[:most]
    weight = np.arange(1, len(power) + 1)[:, None] ** 4.0
    significant = power > noise * np.log(len(power) / SIGNIFICANCE)
    signal = np.where(significant, np.maximum(power - noise, 0.0), 0.0)
    kept = np.cumsum(weight * noise, axis=0)
    lost = np.concatenate([np.cumsum((weight * signal)[::-1], axis=0)[::-1][1:], np.zeros((1, power.shape[1]))])
    return int(np.argmin(kept + lost, axis=0).max()) + 1


def differentiate(values: FloatArray, period: float, harmonics: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Fourier fit of one whole period and its analytic derivatives (paper, eqs. 15-17).

    On a whole period of evenly spaced samples, the least-squares fit of a Fourier series is the truncated discrete
    Fourier transform.

    Args:
        values: (..., N, n) positions.
        period: [s].
        harmonics: L, at most (N - 1) // 2.

    Returns:
        Positions, velocities and accelerations, each (..., N, n).
    """
    samples = values.shape[-2]
    coefficients = np.fft.rfft(values, axis=-2)
    keep = min(harmonics, (samples - 1) // 2)
    coefficients[..., keep + 1 :, :] = 0.0
    factor = (2j * np.pi / period * np.arange(coefficients.shape[-2]))[:, None]
    parts = []
    for order in range(3):
        parts.append(np.fft.irfft(coefficients * factor**order, samples, axis=-2))
    return parts[0], parts[1], parts[2]


def differentiate_periods(
    stack: FloatArray, period: float, harmonics: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Every period filtered and differentiated like the mean.

    The mean is a Fourier series. What a period differs by from it is not periodic: a series fitted to it alone would
    jump at both of its ends, and its derivatives with it. So the differences are laid end to end, over the whole
    recording.

    Args:
        stack: (P, N, n) positions of consecutive periods.
        period: [s].
        harmonics: L, at most (N - 1) // 2.

    Returns:
        Positions, velocities and accelerations, each (P, N, n).
    """
    periods, samples, joints = stack.shape
    centre = stack.mean(axis=0)
    means = differentiate(centre, period, harmonics)
    rest = (stack - centre).reshape(periods * samples, joints)
    # mirrored about both of its ends and faded out, so that neither it nor its slope jumps where the series closes
    reach = min(samples, len(rest) - 1)
    fade = 0.5 * (1.0 + np.cos(np.pi * (np.arange(reach) + 1.0) / (reach + 1.0)))[:, None]
    before = (2.0 * rest[0] - rest[reach:0:-1]) * fade[::-1]
    after = (2.0 * rest[-1] - rest[-2 : -reach - 2 : -1]) * fade
    long = np.concatenate([before, rest, after])
    length = len(long) * period / samples
    parts = differentiate(long, length, int((min(harmonics, (samples - 1) // 2) + 0.5) * length / period))
    inside = slice(reach, reach + len(rest))
    return tuple(mean + part[inside].reshape(stack.shape) for mean, part in zip(means, parts, strict=True))  # type: ignore[return-value]
