"""The noise floor, from the periods of the recording itself."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sea_ident._typing import FloatArray

ComplexArray = NDArray[np.complex128]

SMALLEST_HALF_WIDTH = 4
"""Noise is smoothed over at least this many harmonics to either side, ..."""

FREEDOM_PER_EQUATION = 6.0
"""... and over as many as give this many degrees of freedom per equation [-]."""

WIDER = 2
"""How many times as many harmonics the floor is smoothed over that the next one is levelled by."""

FEWEST_PAIRS = 4
"""Pairs of steps without a common period from which on the spread of their energy is estimated: six periods, ..."""

FILLED = 0.1
"""... and share of all directions that periods as they are cut are taken to fill where there are fewer.

Twenty periods of legs of all kinds fill 0.10 to 0.17 of them. With all of them instead, two to five periods reject a
model that is right in three of ten cases at a nominal twentieth; with a tenth, in 3 to 5 %."""

FEWEST_CLOSED_STEPS = 5
"""Steps between periods from which on they are taken to close."""

CLOSED_CORRELATION = (-0.317, -0.183)
"""Correlation of such a step with the next and with the one after it, the mean over a period ..."""

CLOSED_CORRELATION_SQUARED = (0.132, 0.065)
"""... and the mean of its square: where along a period noise is, is all the same to what is said of many directions."""

FEWEST_CLOSED_PAIRS = 15
"""The same of steps between periods that close: ten periods, ..."""

FILLED_CLOSED = 0.4
"""... and the share where there are fewer: twenty periods of legs fill 0.4 to 0.9 of them."""

REPEATED_VARIANCE = 2.0
"""How many times the variance that it is estimated to have an error counts with which no scatter shows [-]."""

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

    @property
    def certainty(self) -> float:
        """What the inverse of an estimated covariance is to be multiplied by to be right on the mean [-].

        And what the variance of a sum of squares that was whitened by it is to be divided by (Hotelling).
        """
        return min(max(self.freedom - self.equations, 1.0) / self.freedom, 1.0)

    def beside(self, errors: ComplexArray) -> "NoiseFloor":
        """The floor with an error of the mean in it that no scatter shows.

        Args:
            errors: (K, H + 1, E) some such errors [N m].
        """
        products = REPEATED_VARIANCE * np.einsum("pke,pkf->kef", errors, errors.conj()) / len(errors)
        products[1:] /= 2.0
        products[0] = products[0].real
        half = min(SMALLEST_HALF_WIDTH, max((len(products) - 1) // 2, 1))
        more = _moving_mean(products, half)
        more[0] = more[0].real
        return replace(self, covariance=self.covariance + more)

    def whitener(self) -> ComplexArray:
        """(H + 1, E, E) lower triangles that turn the mean residual into unit-variance numbers."""
        count = self.equations
        size = np.sqrt(np.maximum(np.real(np.einsum("kee->ke", self.covariance)), 1e-300))
        correlation = self.covariance / (size[:, :, None] * size[:, None, :]) + 1e-9 * np.eye(count)
        triangle = np.linalg.cholesky(correlation)
        inverse = np.linalg.solve(triangle, np.broadcast_to(np.eye(count, dtype=np.complex128), triangle.shape))
        return np.asarray(np.sqrt(self.certainty) * inverse / size[:, None, :], dtype=np.complex128)


@dataclass(frozen=True, eq=False)
class Rest:
    """What is left of noise where some of its directions are projected out.

    Attributes:
        colour: (H + 1, E, E) lower triangles that turn white noise into noise of this covariance.
        kept: (H + 1, E) share of the white noise that is left.
    """

    colour: ComplexArray
    kept: FloatArray

    def made_whole(self, covariance: ComplexArray, half: int) -> ComplexArray:
        """(H + 1, E, E) covariance of all the noise from that of what is left, a mean over 2 half + 1 harmonics."""
        mean = _moving_mean(self.kept.astype(np.complex128), half).real
        kept = np.maximum(self.kept + np.maximum(SMALLEST_REST - mean, 0.0), 0.0)
        adjoint = self.colour.conj().transpose(0, 2, 1)
        whole = np.linalg.cholesky(_moving_mean(np.matmul(self.colour, adjoint), half))
        left = np.linalg.cholesky(_moving_mean(np.matmul(self.colour * kept[:, None, :], adjoint), half))
        grown = np.matmul(whole, np.linalg.inv(left))
        return np.asarray(np.matmul(np.matmul(grown, covariance), grown.conj().transpose(0, 2, 1)))


def stacked(values: ComplexArray) -> FloatArray:
    """(E (2 H + 1), ...) real numbers from complex coefficients (H + 1, E, ...): constants, real, imaginary parts."""
    rest = values[1:].reshape((len(values) - 1) * values.shape[1], *values.shape[2:])
    return np.concatenate([values[0].real, rest.real, rest.imag])


def noise_from_steps(steps: ComplexArray, periods: float, each: float, rest: Rest | None = None) -> NoiseFloor:
    """Covariance of the mean residual from successive differences of the periods.

    Differences, and not distances from the mean, so that a drift over the recording does not count as noise.

    Args:
        steps: (S, H + 1, E) differences of the residuals of successive periods over the root of two.
        periods: number of periods that the mean is of.
        each: degrees of freedom of a variance from these steps: `step_freedom` or `closed_freedom_of_many`.
        rest: what of the noise is in the steps; all by default.

    Returns:
        The noise floor.
    """
    number, harmonics, count = steps.shape
    products = np.einsum("pke,pkf->kef", steps, steps.conj()) / max(number, 1)
    products[1:] /= 2.0
    products[0] = products[0].real
    half = _half_width(harmonics, count, each)
    smooth = _moving_mean(products, half)
    left = 1.0
    if rest is not None:
        smooth = rest.made_whole(smooth, half)
        left = max(float(np.mean(rest.kept)), SMALLEST_REST)
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
    """Degrees of freedom of a variance along one direction from this many steps between periods that close.

    Such a step is related less to the next than one between periods as they are cut, but to the one after it too.
    """
    return _freedom(number, [c**2 for c in CLOSED_CORRELATION])


def closed_freedom_of_many(number: int) -> float:
    """The same of every variance where many directions are averaged over, each with a phase of the period of its own.

    Where along a period noise gathers, steps are related more closely than on the mean over the period.
    """
    return _freedom(number, CLOSED_CORRELATION_SQUARED)


def _freedom(number: int, squared: Sequence[float]) -> float:
    if number < FEWEST_CLOSED_STEPS:
        return step_freedom(number + 1)
    related = sum((number - k) * square for k, square in enumerate(squared, start=1))
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


def leverage_of(basis: FloatArray, equations: int) -> FloatArray:
    """(H + 1, E) share of the noise of every coefficient that an orthonormal basis (M, r) takes up [-]."""
    share = unstacked(np.sum(basis**2, axis=1), equations)
    return np.concatenate([share[:1].real, (share[1:].real + share[1:].imag) / 2.0])


def noise_beside_model(left: FloatArray, plain: NoiseFloor, each: float, leverage: FloatArray) -> NoiseFloor:
    """Noise floor of what a fit leaves: the part of the scatter that it takes up is not in it.

    Friction that differs from pass to pass gathers around reversals. Samples left out and columns of friction take
    most of it up in the mean residual, so it must not count as noise of what remains.

    Args:
        left: (M, S) differences of the residuals of successive periods over the root of two, whitened by `plain`, less
            what everything that is free takes up of them.
        plain: noise floor of the residuals as they are.
        each: degrees of freedom of a variance from these steps.
        leverage: (H + 1, E) share of the noise of every coefficient that it takes up [-].

    Returns:
        The noise floor.
    """
    whitener, count = plain.whitener(), plain.equations
    colour = np.linalg.inv(whitener)
    size = np.linalg.norm(colour, axis=2)
    # levelled by a floor that is smoothed more than the new one: one as rough as that follows the very steps, and what
    # is smoothed beside it comes out with about half the degrees of freedom
    own = colour / size[:, :, None]
    wide = min(WIDER * _half_width(len(own), count, each), max((len(own) - 1) // 2, 1))
    mean = _moving_mean(np.matmul(own, own.conj().transpose(0, 2, 1)), wide)
    mean[0] = mean[0].real
    typical = np.linalg.cholesky(mean)
    rest = Rest(np.asarray(np.linalg.solve(typical, own), dtype=np.complex128), 1.0 - leverage)
    level = np.stack([np.matmul(rest.colour, unstacked(f, count)[:, :, None])[:, :, 0] for f in left.T])
    inside = noise_from_steps(level, plain.periods, each, rest)
    back = typical * size[:, :, None]
    covariance = np.matmul(np.matmul(back, inside.covariance), back.conj().transpose(0, 2, 1))
    return replace(inside, covariance=covariance)


def _half_width(harmonics: int, count: int, each: float) -> int:
    """Harmonics to either side that a floor of this many equations is smoothed over."""
    half = max(SMALLEST_HALF_WIDTH, int(np.ceil((FREEDOM_PER_EQUATION * count / each - 1.0) / 2.0)))
    return min(half, max((harmonics - 1) // 2, 1))


def _moving_mean(values: ComplexArray, half: int) -> ComplexArray:
    """Mean over 2 half + 1 neighbours; at the ends over as many as there are on the inside."""
    length = len(values)
    total = np.concatenate([np.zeros((1, *values.shape[1:]), dtype=np.complex128), np.cumsum(values, axis=0)])
    width = min(2 * half + 1, length)
    start = np.clip(np.arange(length) - half, 0, length - width)
    return np.asarray((total[start + width] - total[start]) / width, dtype=np.complex128)
