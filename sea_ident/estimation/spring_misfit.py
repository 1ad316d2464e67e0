"""What the law of a spring leaves of its torque, beside the noise of that."""

from dataclasses import dataclass

import numpy as np
from scipy import stats

from sea_ident._typing import FloatArray
from sea_ident.estimation.uncertainty import MISFIT, Uncertainty, bartlett
from sea_ident.processing.harmonics import within

PIECES = 40
"""Pieces of a period over which what is left is summed."""

FEWEST_SAMPLES = 8
"""Samples of a piece at least."""

LEVEL = 1e-4
"""Probability with which chance makes noise count as more, where parts of one size carry it; up to a
hundredth where few large ones carry half of it."""


@dataclass(frozen=True, eq=False)
class SpringMisfit:
    """The mean residual of a spring beside its noise.

    Attributes:
        noise: rms of the noise of the mean residual [N m] or [N].
        ratio: rms of the mean residual over that [-].
        covariance: (c, c) what it adds to the covariance of the law; None where it is no more than noise.
    """

    noise: float
    ratio: float
    covariance: FloatArray | None


def spring_misfit(
    residuals: FloatArray,
    inverse: FloatArray,
    columns: FloatArray,
    rows: FloatArray,
    uncertainty: Uncertainty,
    harmonics: int = 0,
    repeated: float = 0.0,
) -> SpringMisfit:
    """Hold what a law leaves of the mean torque of a spring against the scatter of the periods.

    What repeats in every period beyond noise is something that the law does not have. It is counted as a random error
    with the correlation that it shows along the period, as in the dynamic model.

    Args:
        residuals: (P, N) torque of the spring less its law, of every period with its own motion [N m] or [N].
        inverse: (c, N) by which the mean torque changes the values of the law.
        columns: (N, c) of the law.
        rows: (N, b) by which the base parameters change the mean torque.
        uncertainty: of the base parameters, with an influence of every period.
        harmonics: of a period that count; all where 0.
        repeated: rms of the torque that errors of the encoders make which are the same in every period [N m] or [N].

    Returns:
        The misfit.
    """
    periods = len(residuals)
    scale = periods / (periods - 1.0)
    own = rows - columns @ (inverse @ rows)
    mean = within(residuals.mean(axis=0), harmonics)
    direct = within(((residuals - residuals.mean(axis=0)) / periods).T, harmonics)
    # a period moves the mean by its share, by the base parameters with it, and what the law follows of that is gone
    moves = direct - columns @ (inverse @ direct) + within(own @ uncertainty.influences.T, harmonics)
    rest = uncertainty.covariance - uncertainty.repeatability
    gram = own.T @ own / len(own)
    variance = float(np.mean(np.sum(moves**2, axis=1))) * scale + max(float(np.sum(gram * rest)), 0.0)
    variance += repeated**2
    energy = float(np.mean(mean**2))
    noise, ratio = float(np.sqrt(variance)), float(np.sqrt(energy / max(variance, 1e-300)))
    freedom = _freedom(direct, gram @ uncertainty.covariance)
    limit = max(MISFIT, float(stats.f.isf(LEVEL, freedom, (periods - 1.0) * freedom)))
    if not energy > limit * variance:
        return SpringMisfit(noise, ratio, None)
    beyond = mean * np.sqrt(1.0 - variance / energy)
    pieces = np.array_split(np.arange(len(beyond)), min(PIECES, max(len(beyond) // FEWEST_SAMPLES, 1)))
    scores = np.array([inverse[:, piece] @ beyond[piece] for piece in pieces])
    return SpringMisfit(noise, ratio, bartlett(scores, 1))


def _freedom(direct: FloatArray, parameters: FloatArray) -> float:
    """Number of independent parts that the energy of the noise amounts to (Satterthwaite).

    Noise of the samples has as many as harmonics carry it, twice; what the base parameters do has few, and where it is
    most of the noise its energy varies much.

    Args:
        direct: (N, P) by which the periods move the mean, without the base parameters.
        parameters: (b, b) whose eigenvalues are the energies by the base parameters.
    """
    harmonics = np.sum(np.abs(np.fft.rfft(direct, axis=0)[1:]) ** 2, axis=1) * 2.0 / len(direct) ** 2
    few = np.linalg.eigvals(parameters).real
    whole = float(harmonics.sum() + few.sum())
    squares = float((harmonics**2).sum() / 2.0 + (few**2).sum())
    return max(whole**2 / max(squares, 1e-300), 1.0)
