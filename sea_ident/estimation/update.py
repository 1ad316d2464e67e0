"""An earlier model brought up to date: what has not changed need not be found again."""

from dataclasses import replace

import numpy as np
from scipy import stats

from sea_ident._typing import FloatArray, IntArray
from sea_ident.estimation.knowledge import regular_covariance
from sea_ident.estimation.model import Model
from sea_ident.estimation.uncertainty import CovarianceKind
from sea_ident.estimation.update_result import Change, Update
from sea_ident.exceptions import IdentificationError

FAMILY = 1e-2
"""Probability that any parameter is called changed where none has."""


def updated(new: Model, prior: Model) -> Model:
    """Combine a model from new data with an earlier one.

    Parameters whose difference is more than chance are freed, the strongest first, until the others agree; those others
    take both sources of information. What was freed takes the new data alone, which are the sharper for it.

    Args:
        new: identified from the new data alone.
        prior: the earlier model, with the same base parameters.

    Returns:
        The new model with the combined values and covariance, and `update` filled.

    Raises:
        IdentificationError: the models have different base parameters.
    """
    if new.names != prior.names:
        raise IdentificationError(
            f"the earlier model has the base parameters {', '.join(prior.names)}; the new one has "
            f"{', '.join(new.names)}. Identify both with the same robot and effects"
        )
    covariance, earlier = regular_covariance(new), regular_covariance(prior)
    difference = new.values - prior.values
    total = covariance + earlier
    z = difference / np.sqrt(np.diag(total))
    freedom = min(new.uncertainty.degrees_of_freedom, prior.uncertainty.degrees_of_freedom)
    freed, statistic, p_value = _freed(difference, total, freedom)
    kept = np.array([k for k in range(len(z)) if k not in freed], dtype=np.intp)
    values, combined = _combine(new.values, covariance, prior.values, earlier, kept)
    update = Update(
        recording=prior.recording,
        changes=tuple(
            Change(name, float(a), float(b), float(s), k in freed)
            for k, (name, a, b, s) in enumerate(zip(new.names, prior.values, new.values, z, strict=True))
        ),
        statistic=statistic,
        p_value=p_value,
    )
    uncertainty = replace(
        new.uncertainty,
        covariance=combined,
        repeatability=combined,
        kind=CovarianceKind.UPDATED,
        influences=np.zeros((0, len(values))),
    )
    return replace(new, values=values, uncertainty=uncertainty, update=update)


def _freed(difference: FloatArray, total: FloatArray, freedom: float) -> tuple[set[int], float, float]:
    """Indices of changed parameters, by forward selection on the largest drop of chi square."""
    count = len(difference)
    freed: list[int] = []
    limit = _quantile(FAMILY / count, freedom)
    while True:
        kept = np.array([k for k in range(count) if k not in freed], dtype=np.intp)
        if not len(kept):
            return set(freed), 0.0, 1.0
        precision = np.linalg.inv(total[np.ix_(kept, kept)])
        score = precision @ difference[kept]
        chi_square = float(difference[kept] @ score)
        # freeing k lowers chi square by score_k^2 / precision_kk
        drops = score**2 / np.diag(precision)
        best = int(np.argmax(drops))
        if drops[best] <= limit:
            per = chi_square / len(kept)
            probability = (
                float(stats.f.sf(per, len(kept), freedom))
                if np.isfinite(freedom)
                else float(stats.chi2.sf(chi_square, len(kept)))
            )
            return set(freed), per, probability
        freed.append(int(kept[best]))


def _quantile(level: float, freedom: float) -> float:
    """Square of a standardised difference that is exceeded with this probability."""
    if not np.isfinite(freedom):
        return float(stats.chi2.isf(level, 1))
    return float(stats.f.isf(level, 1, freedom))


def _combine(
    new: FloatArray, covariance: FloatArray, old: FloatArray, earlier: FloatArray, kept: IntArray
) -> tuple[FloatArray, FloatArray]:
    """Values and covariance with the earlier values of the parameters that are kept as further measurements."""
    if not len(kept):
        return new.copy(), covariance
    gain = covariance[:, kept] @ np.linalg.inv(covariance[np.ix_(kept, kept)] + earlier[np.ix_(kept, kept)])
    values = new + gain @ (old[kept] - new[kept])
    combined = covariance - gain @ covariance[kept]
    return values, 0.5 * (combined + combined.T)


def left_behind(prior: Model) -> tuple[str, ...]:
    """What of an earlier model no mean of a recording tells, in words."""
    if not prior.trends:
        return ()
    titles = ", ".join(trend.effect.title for trend in prior.trends)
    return (
        f"{titles} of the earlier model changes in the course of a recording: not in this model; diagnose finds it",
    )
