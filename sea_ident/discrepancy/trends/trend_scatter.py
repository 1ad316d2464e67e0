"""What the periods scatter by along the columns of trends, and what a trend is worth in it.

Friction that differs from pass to pass is larger along the columns of friction than the noise floor, which is one for
all phases of a period, says. Columns of other effects and joints share some of it. In its own scatter every column
counts what it is worth, and trends can be compared.
"""

from collections.abc import Sequence

import numpy as np
from scipy import stats

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.trends.trend_directions import Cause, Direction
from sea_ident.discrepancy.trends.trend_values import times_course
from sea_ident.singular_values import svd

SAME = 1e-6
"""Combinations of columns weaker than this share of the strongest are the same column twice."""

SMOOTH = 3
"""Degree of the polynomials over the periods that are no scatter: every course of a trend is one of these, nearly."""

FEWEST_LEFT = 4
"""Degrees of freedom that these leave to the scatter; with fewer periods their degree is lower."""


def column_space(causes: Sequence[Cause]) -> FloatArray:
    """(M, K) orthonormal basis of the columns of all trends."""
    columns = np.concatenate([cause.columns for cause in causes], axis=1)
    columns = columns / np.linalg.norm(columns, axis=0)
    basis, strength, _ = svd(columns)
    return np.asarray(basis[:, strength > SAME * strength[0]], dtype=np.float64)


def scatter_whitener(periods: FloatArray, middle: FloatArray) -> FloatArray:
    """(K, K) symmetric matrix that turns the scatter of the periods into unit variance, where it is more than that.

    Few periods scatter more in some directions than in others by chance alone: only what goes beyond the largest that
    noise of unit variance gives (Marchenko and Pastur) is taken for true, and is corrected for what noise adds to it
    (Baik and Silverstein, Journal of Multivariate Analysis 97, 2006).

    Args:
        periods: (P, K) whitened numbers of every period.
        middle: (P,) middles of the periods [s].

    Returns:
        The matrix.
    """
    count, width = periods.shape
    degree = int(np.clip(count - 1 - FEWEST_LEFT, 1, SMOOTH))
    smooth = np.linalg.qr(np.vander((middle - middle.mean()) / np.ptp(middle), degree + 1))[0]
    rest = periods - smooth @ (smooth.T @ periods)
    freedom = count - degree - 1
    axes, size = svd(rest.T / np.sqrt(freedom))[:2]
    ratio, found = width / freedom, size**2
    true = np.ones_like(found)
    beyond = found > (1.0 + np.sqrt(ratio)) ** 2
    middle = (found[beyond] + 1.0 - ratio) / 2.0
    true[beyond] = middle + np.sqrt(np.maximum(middle**2 - found[beyond], 0.0))
    whitener: FloatArray = np.eye(width) + (axes * (1.0 / np.sqrt(true) - 1.0)) @ axes.T
    return whitener


def blocks(direction: Direction, *, bends: bool = False) -> FloatArray:
    """(P M, k) columns of a trend over all periods, in unit length; with the bend of its course beside them."""
    found = [times_course(direction.columns, direction.profile)]
    if bends and direction.bend is not None:
        found.append(times_course(direction.columns, direction.bend))
    return np.concatenate([part / np.linalg.norm(part, axis=0) for part in found], axis=1)


def held_basis(held: Sequence[Direction]) -> FloatArray | None:
    """(P M, r) orthonormal basis of trends whose size and course are free, None without any."""
    if not held:
        return None
    basis, strength, _ = svd(np.concatenate([blocks(d, bends=True) for d in held], axis=1))
    return np.asarray(basis[:, strength > SAME * strength[0]], dtype=np.float64)


def gain(periods: FloatArray, direction: Direction, held: FloatArray | None = None) -> tuple[float, tuple[int, ...]]:
    """Drop of the statistic by a trend beside others, and the columns that take part.

    Columns that change by one cause do not change in opposite ways: where they would, the best of them alone counts.

    Args:
        periods: (P, M) whitened numbers.
        direction: the trend.
        held: (P M, r) orthonormal basis of what is held beside it.

    Returns:
        Drop, and positions of the columns.
    """
    own, target = blocks(direction), periods.ravel()
    if held is not None:
        own, target = own - held @ (held.T @ own), target - held @ (held.T @ target)
    width = own.shape[1]
    if width > 1:
        values = np.linalg.lstsq(own, target, rcond=SAME)[0]
        if np.all(values >= 0.0) or np.all(values <= 0.0):
            return float(target @ own @ values), tuple(range(width))
    norms = np.sum(own**2, axis=0)
    alone = np.where(norms > SAME**2, (target @ own) ** 2 / np.maximum(norms, 1e-300), 0.0)
    best = int(np.argmax(alone))
    return float(alone[best]), (best,)


def scatter_p(periods: FloatArray, direction: Direction, held: Sequence[Direction] = ()) -> float:
    """Probability of a trend beside others by the scatter of the periods along its own columns.

    Hotelling: every combination of its columns in its own scatter, that of one says nothing about another.

    Args:
        periods: (P, M) whitened numbers.
        direction: the trend.
        held: trends beside it, their sizes and courses free.

    Returns:
        Probability.
    """
    own = blocks(direction)
    width = own.shape[1]
    design = np.concatenate([own, *(blocks(d, bends=True) for d in held)], axis=1)
    inverse = np.linalg.pinv(design, rcond=SAME)
    amounts = inverse @ periods.ravel()
    courses = [direction.profile, *(c for d in held for c in (d.profile, d.bend) if c is not None)]
    unit = np.stack([c / np.linalg.norm(c) for c in courses])
    freedom = len(periods) - 1 - int(np.linalg.matrix_rank(unit, tol=1e-3))
    if freedom < width:
        return 0.0
    left = (periods - (design @ amounts).reshape(periods.shape)) / np.sqrt(freedom)
    parts = inverse[:width].reshape(width, *periods.shape) @ left.T
    spread = np.einsum("ipq,jpq->ij", parts, parts)
    distance = float(amounts[:width] @ np.linalg.pinv(spread, hermitian=True) @ amounts[:width])
    ratio = distance * (freedom - width + 1) / (freedom * width)
    return float(stats.f.sf(ratio, width, freedom - width + 1))
