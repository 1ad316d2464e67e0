"""The noise floor, from the periods of the recording itself."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sea_ident._typing import FloatArray

ComplexArray = NDArray[np.complex128]

SMALLEST_HALF_WIDTH = 4
"""Noise is smoothed over at least this many harmonics to either side."""

FEWEST_STEPS = 4
"""Pairs of steps between periods from which on the spread of their energy is estimated."""

STEADIER = 4
"""Times the harmonics that correlations are averaged over where the weighting must not follow the scatter itself."""

SMALLEST_REST = 0.1
"""A residual of which a model takes up more than all but this share says nothing about noise."""


@dataclass(frozen=True, eq=False)
class NoiseFloor:
    """Covariance of the mean residual over the equations, per harmonic, and the whitening that follows from it.

    Attributes:
        covariance: (H + 1, E, E) of each real component of the mean residual [(N m)^2].
        periods: P.
        freedom: complex degrees of freedom of every covariance.
        total_freedom: real degrees of freedom of the whole estimate.
    """

    covariance: ComplexArray
    periods: int
    freedom: float
    total_freedom: float

    @property
    def equations(self) -> int:
        """Number E of equations."""
        return int(self.covariance.shape[1])

    @property
    def std(self) -> FloatArray:
        """(E,) rms of the noise of the mean residual within the band [N m]."""
        power = np.real(np.einsum("kee->ke", self.covariance))
        weight = np.full(len(power), 2.0)
        weight[0] = 1.0
        return np.asarray(np.sqrt(weight @ power), dtype=np.float64)

    def steady_whitener(self) -> ComplexArray:
        """(H + 1, E, E) the same with correlations that are averaged over more harmonics.

        What is projected out of the scatter in this weighting depends little on that very scatter, so that what is left
        of it is not too small.
        """
        size = np.sqrt(np.real(np.einsum("kee->ke", self.covariance)))
        half = STEADIER * _half_width(self.periods, len(size), self.equations)
        correlation = self.covariance / (size[:, :, None] * size[:, None, :])
        return _inverse_root(_moving_mean(correlation, min(half, (len(size) - 1) // 2)), size)

    def whitener(self) -> ComplexArray:
        """(H + 1, E, E) lower triangles that turn the mean residual into unit-variance numbers."""
        count = self.equations
        size = np.sqrt(np.maximum(np.real(np.einsum("kee->ke", self.covariance)), 1e-300))
        correlation = self.covariance / (size[:, :, None] * size[:, None, :])
        unbiased = np.sqrt(max(self.freedom - count, 1.0) / self.freedom)
        return np.asarray(unbiased * _inverse_root(correlation, size), dtype=np.complex128)


def _inverse_root(correlation: ComplexArray, size: FloatArray) -> ComplexArray:
    """(H + 1, E, E) lower triangles that whiten noise of this correlation (H + 1, E, E) and size (H + 1, E)."""
    unit = np.eye(size.shape[1], dtype=np.complex128)
    triangle = np.linalg.cholesky(correlation + 1e-9 * unit)
    inverse = np.linalg.solve(triangle, np.broadcast_to(unit, triangle.shape))
    return np.asarray(inverse / size[:, None, :], dtype=np.complex128)


def stacked(values: ComplexArray) -> FloatArray:
    """(E (2 H + 1), ...) real numbers from complex coefficients (H + 1, E, ...): constants, real, imaginary parts."""
    rest = values[1:].reshape((len(values) - 1) * values.shape[1], *values.shape[2:])
    return np.concatenate([values[0].real, rest.real, rest.imag])


def noise_from_periods(residuals: ComplexArray, leverage: FloatArray | None = None, spread: float = 1.0) -> NoiseFloor:
    """Covariance of the mean residual from successive differences of the periods.

    Differences, and not distances from the mean, so that a drift over the recording does not count as noise.

    Args:
        residuals: (P, H + 1, E) residuals of every period from its own signals.
        leverage: (H + 1, E) share of the residuals that was projected out of them; none by default.
        spread: share of the numbers within a window of harmonics that are independent after that [-].

    Returns:
        The noise floor.
    """
    periods, harmonics, count = residuals.shape
    steps = np.diff(residuals, axis=0) / np.sqrt(2.0)
    products = np.einsum("pke,pkf->kef", steps, steps.conj()) / max(periods - 1, 1)
    products[1:] /= 2.0
    products[0] = products[0].real
    # variance of a mean of squared successive differences, as degrees of freedom
    each, half = step_freedom(periods), _half_width(periods, harmonics, count)
    smooth = _moving_mean(products, half)
    left = 1.0
    if leverage is not None:
        kept = np.sqrt(np.maximum(1.0 - _moving_mean(leverage.astype(np.complex128), half).real, SMALLEST_REST))
        smooth = smooth / (kept[:, :, None] * kept[:, None, :])
        left = float(np.mean(kept**2))
    # a constant that wanders more than its neighbours has a floor of its own
    ratio = np.real(np.einsum("ee->e", products[0])) / np.real(np.einsum("ee->e", smooth[0]))
    inflate = np.sqrt(np.where(ratio > 4.0, ratio, 1.0))
    smooth[0] = smooth[0].real * np.outer(inflate, inflate)
    scale = np.real(np.einsum("kee->ke", smooth))
    smooth += np.einsum("ke,ef->kef", 1e-12 * scale + 1e-300, np.eye(count))
    return NoiseFloor(
        covariance=smooth / periods,
        periods=periods,
        freedom=each * (2 * half + 1) * spread,
        total_freedom=each * 2.0 * harmonics * left,
    )


def step_freedom(periods: int) -> float:
    """Degrees of freedom of a variance from the mean square of successive differences of this many periods."""
    return 2.0 * (periods - 1) ** 2 / (3.0 * periods - 4.0) if periods > 2 else 1.0


def noise_directions(periods: FloatArray) -> float:
    """Number of directions that the scatter of periods (P, M) fills evenly.

    Friction that differs from pass to pass fills a few directions only. The number is the squared trace of the noise
    covariance over the trace of its square (Satterthwaite); the second follows from products of different steps
    between periods, which share no noise (as in Chen and Qin, Annals of Statistics 38, 2010). There are few of them, so
    the number is that at the lower end (one standard error) of what they leave open.
    """
    steps = np.diff(periods, axis=0) / np.sqrt(2.0)
    gram = steps @ steps.T
    apart = gram[np.triu_indices(len(steps), 2)]
    if len(apart) < FEWEST_STEPS:
        return float(periods.shape[1])
    unsure = np.std(apart**2, ddof=1) / np.sqrt(len(apart))
    return float(np.mean(np.diag(gram)) ** 2 / max(float(np.mean(apart**2) + unsure), 1e-300))


def unstacked(values: FloatArray, equations: int) -> ComplexArray:
    """(H + 1, E, ...) complex coefficients from real numbers: the inverse of `stacked`."""
    rest = (len(values) - equations) // 2
    first, real, imaginary = np.split(values, [equations, equations + rest])
    shape = (rest // equations, equations, *values.shape[1:])
    return np.concatenate([first[None].astype(np.complex128), (real + 1j * imaginary).reshape(shape)])


def noise_beside_model(residuals: ComplexArray, whitener: ComplexArray, basis: FloatArray) -> NoiseFloor:
    """Noise floor of what a fit leaves: the part of the scatter that it takes up is not in it.

    Friction that differs from pass to pass gathers around reversals. Samples left out and columns of friction take
    most of it up in the mean residual, so it must not count as noise of what remains.

    Args:
        residuals: (P, H + 1, E) residuals of every period.
        whitener: (H + 1, E, E) by which the fit weighs them.
        basis: (M, r) orthonormal basis of everything that is free, whitened.

    Returns:
        The noise floor.
    """
    count = residuals.shape[2]
    colour = np.asarray(np.linalg.inv(whitener), dtype=np.complex128)
    flat = np.stack([stacked(np.matmul(whitener, r[:, :, None])[:, :, 0]) for r in residuals])
    flat = flat - (flat @ basis) @ basis.T
    # back to torque before anything is averaged: scatter measured in its own floor would come out too small
    left = np.stack([np.matmul(colour, unstacked(f, count)[:, :, None])[:, :, 0] for f in flat])
    half = _half_width(len(residuals), len(colour), count)
    return noise_from_periods(left, _leverage(basis, colour), _independent(basis, count, half))


def _leverage(basis: FloatArray, colour: ComplexArray) -> FloatArray:
    """(H + 1, E) share of the noise of every equation that a whitened basis (M, r) takes out, `colour` undoing it."""
    own = unstacked(basis, colour.shape[1])
    taken = np.einsum("ker,kfr->kef", own.real, own.real)
    taken[1:] = (taken[1:] + np.einsum("ker,kfr->kef", own.imag, own.imag)[1:]) / 2.0
    whole = np.sum(np.abs(colour) ** 2, axis=2)
    share: FloatArray = np.real(np.einsum("kef,kfg,keg->ke", colour, taken, colour.conj())) / whole
    return share


def _half_width(periods: int, harmonics: int, equations: int) -> int:
    """Harmonics to either side over which noise is smoothed, for covariances that can be inverted."""
    half = max(SMALLEST_HALF_WIDTH, int(np.ceil((6.0 * equations / step_freedom(periods) - 1.0) / 2.0)))
    return min(half, max((harmonics - 1) // 2, 1))


def _independent(basis: FloatArray, equations: int, half: int) -> float:
    """Share of the numbers within a window of harmonics that stay independent once a basis (M, r) is projected out.

    What is taken out may be the same in all of them (a sample is) or fill one: squared trace over the trace of the
    square of what the projection leaves of a window, in one equation.
    """
    rows = unstacked(np.arange(len(basis), dtype=np.float64), equations)
    shares = []
    for start in range(1, max(len(rows) - 2 * half, 2), half):
        window = rows[start : start + 2 * half + 1]
        for e in range(equations):
            own = basis[np.concatenate([window[:, e].real, window[:, e].imag]).astype(int)]
            left = np.eye(len(own)) - own @ own.T
            shares.append(float(np.trace(left)) ** 2 / max(float(np.sum(left**2)), 1e-300) / len(own))
    return float(np.mean(shares))


def _moving_mean(values: ComplexArray, half: int) -> ComplexArray:
    """Mean over 2 half + 1 neighbours; at the ends over as many as there are on the inside."""
    length = len(values)
    total = np.concatenate([np.zeros((1, *values.shape[1:]), dtype=np.complex128), np.cumsum(values, axis=0)])
    width = min(2 * half + 1, length)
    start = np.clip(np.arange(length) - half, 0, length - width)
    return np.asarray((total[start + width] - total[start]) / width, dtype=np.complex128)
