"""The noise floor, from the periods of the recording itself."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sea_ident._typing import FloatArray

ComplexArray = NDArray[np.complex128]

SMALLEST_HALF_WIDTH = 4
"""Noise is smoothed over at least this many harmonics to either side."""

FEWEST_PAIRS = 4
"""Pairs of steps without a common period from which on the spread of their energy is estimated: six periods, ..."""

FILLED = 0.1
"""... and share of all directions that periods as they are cut are taken to fill where there are fewer.

Twenty periods of legs of all kinds fill 0.10 to 0.17 of them. With all of them instead, two to five periods reject a
model that is right in three of ten cases at a nominal twentieth; with a tenth, in 3 to 5 %."""

FEWEST_CLOSED_STEPS = 5
"""Steps between periods from which on they surely close."""

CLOSED_CORRELATION = (-0.317, -0.183)
"""Correlation of such a step with the next and with the one after it, the mean over a period."""

FEWEST_CLOSED_PAIRS = 15
"""The same of steps between periods that close: ten periods, ..."""

FILLED_CLOSED = 0.4
"""... and the share where there are fewer: twenty periods of legs fill 0.4 to 0.9 of them."""

SMALLEST_REST = 0.1
"""A residual of which a model takes up more than all but this share says nothing about noise."""


@dataclass(frozen=True, eq=False)
class NoiseFloor:
    """Covariance of the mean residual over the equations, per harmonic, and the whitening that follows from it.

    Attributes:
        covariance: (H + 1, E, E) of each real component of the mean residual [(N m)^2].
        periods: number of periods that the mean is of.
        freedom: complex degrees of freedom of every covariance.
        total_freedom: real degrees of freedom of the whole estimate.
    """

    covariance: ComplexArray
    periods: float
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

    def whitener(self) -> ComplexArray:
        """(H + 1, E, E) lower triangles that turn the mean residual into unit-variance numbers."""
        count = self.equations
        size = np.sqrt(np.maximum(np.real(np.einsum("kee->ke", self.covariance)), 1e-300))
        correlation = self.covariance / (size[:, :, None] * size[:, None, :]) + 1e-9 * np.eye(count)
        triangle = np.linalg.cholesky(correlation)
        unbiased = np.sqrt(max(self.freedom - count, 1.0) / self.freedom)
        inverse = np.linalg.solve(triangle, np.broadcast_to(np.eye(count, dtype=np.complex128), triangle.shape))
        return np.asarray(unbiased * inverse / size[:, None, :], dtype=np.complex128)


def stacked(values: ComplexArray) -> FloatArray:
    """(E (2 H + 1), ...) real numbers from complex coefficients (H + 1, E, ...): constants, real, imaginary parts."""
    rest = values[1:].reshape((len(values) - 1) * values.shape[1], *values.shape[2:])
    return np.concatenate([values[0].real, rest.real, rest.imag])


def noise_from_steps(steps: ComplexArray, periods: float, leverage: FloatArray | None = None) -> NoiseFloor:
    """Covariance of the mean residual from successive differences of the periods.

    Differences, and not distances from the mean, so that a drift over the recording does not count as noise.

    Args:
        steps: (S, H + 1, E) differences of the residuals of successive periods over the root of two.
        periods: number of periods that the mean is of.
        leverage: (H + 1, E) share of the residuals that was projected out of them; none by default.

    Returns:
        The noise floor.
    """
    number, harmonics, count = steps.shape
    products = np.einsum("pke,pkf->kef", steps, steps.conj()) / max(number, 1)
    products[1:] /= 2.0
    products[0] = products[0].real
    # variance of a mean of squared successive differences, as degrees of freedom
    each = step_freedom(number + 1)
    half = max(SMALLEST_HALF_WIDTH, int(np.ceil((6.0 * count / each - 1.0) / 2.0)))
    half = min(half, max((harmonics - 1) // 2, 1))
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
        freedom=each * (2 * half + 1) * left,
        total_freedom=each * 2.0 * harmonics * left,
    )


def step_freedom(periods: int) -> float:
    """Degrees of freedom of a variance from the mean square of successive differences of this many periods."""
    return 2.0 * (periods - 1) ** 2 / (3.0 * periods - 4.0) if periods > 2 else 1.0


def closed_freedom(number: int) -> float:
    """Degrees of freedom of a variance from the mean square of this many steps between periods that close.

    Such a step is related less to the next than one between periods as they are cut, but to the one after it too.
    """
    if number < FEWEST_CLOSED_STEPS:
        return step_freedom(number + 1)
    related = sum((number - k) * c**2 for k, c in enumerate(CLOSED_CORRELATION, start=1))
    return number**2 / (number + 2.0 * related)


def noise_directions(steps: FloatArray) -> float:
    """Number of directions that steps (S, M) between periods as they are cut fill evenly.

    Friction that differs from pass to pass fills a few directions only. The number is the squared trace of the noise
    covariance over the trace of its square (Satterthwaite); the second follows from products of steps so far apart that
    they share no period (as in Chen and Qin, Annals of Statistics 38, 2010).
    """
    return _directions(steps, 2, FEWEST_PAIRS, FILLED)


def closed_directions(steps: FloatArray) -> float:
    """The same of steps between periods that close, each of which has a part of three; of few, as they are cut."""
    if len(steps) < FEWEST_CLOSED_STEPS:
        return noise_directions(steps)
    return _directions(steps, 3, FEWEST_CLOSED_PAIRS, FILLED_CLOSED)


def _directions(steps: FloatArray, reach: int, fewest: int, filled: float) -> float:
    gram = steps @ steps.T
    apart = gram[np.triu_indices(len(steps), reach)]
    if len(apart) < fewest:
        return filled * float(steps.shape[1])
    # few pairs may say less than there is by chance: a tail that is taken for too thin rejects models that are right
    square = float(np.mean(apart**2)) * (1.0 + np.sqrt(2.0 / len(apart)))
    return float(np.mean(np.diag(gram)) ** 2 / max(square, 1e-300))


def unstacked(values: FloatArray, equations: int) -> ComplexArray:
    """(H + 1, E, ...) complex coefficients from real numbers: the inverse of `stacked`."""
    rest = (len(values) - equations) // 2
    first, real, imaginary = np.split(values, [equations, equations + rest])
    shape = (rest // equations, equations, *values.shape[1:])
    return np.concatenate([first[None].astype(np.complex128), (real + 1j * imaginary).reshape(shape)])


def noise_beside_model(steps: ComplexArray, plain: NoiseFloor, basis: FloatArray) -> NoiseFloor:
    """Noise floor of what a fit leaves: the part of the scatter that it takes up is not in it.

    Friction that differs from pass to pass gathers around reversals. Samples left out and columns of friction take
    most of it up in the mean residual, so it must not count as noise of what remains.

    Args:
        steps: (S, H + 1, E) differences of the residuals of successive periods over the root of two.
        plain: noise floor of the residuals as they are.
        basis: (M, r) orthonormal basis of everything that is free, whitened by `plain`.

    Returns:
        The noise floor.
    """
    whitener, count = plain.whitener(), plain.equations
    flat = np.stack([stacked(np.matmul(whitener, r[:, :, None])[:, :, 0]) for r in steps])
    flat = flat - (flat @ basis) @ basis.T
    share = unstacked(np.sum(basis**2, axis=1), count)
    leverage = share.real.copy()
    leverage[1:] = (share[1:].real + share[1:].imag) / 2.0
    inside = noise_from_steps(np.stack([unstacked(f, count) for f in flat]), plain.periods, leverage)
    colour = np.linalg.inv(whitener)
    covariance = np.matmul(np.matmul(colour, inside.covariance), colour.conj().transpose(0, 2, 1))
    return replace(inside, covariance=covariance)


def _moving_mean(values: ComplexArray, half: int) -> ComplexArray:
    """Mean over 2 half + 1 neighbours; at the ends over as many as there are on the inside."""
    length = len(values)
    total = np.concatenate([np.zeros((1, *values.shape[1:]), dtype=np.complex128), np.cumsum(values, axis=0)])
    width = min(2 * half + 1, length)
    start = np.clip(np.arange(length) - half, 0, length - width)
    return np.asarray((total[start + width] - total[start]) / width, dtype=np.complex128)
