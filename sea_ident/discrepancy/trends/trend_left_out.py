"""How sure the values of trends are where the scatter they are weighted by comes from the same few periods."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.trends.trend_scatter import scatter_whitener
from sea_ident.discrepancy.trends.trend_values import Course, CourseValues, course_values

MOST_PARTS = 20
"""Parts of a recording that are left out one by one: of more periods, several at a time."""

SAME = 1e-9
"""Share of its deviation up to which a value is the same whatever is left out [-]."""


def surest_values(numbers: FloatArray, courses: Sequence[Course], middle: FloatArray) -> CourseValues:
    """Values of the first of some trends, as sure as other periods would leave them.

    Weighted by their scatter, values are the best where every period scatters the same way. Friction that turns sooner
    in one period and later in another scatters along other directions in each: a weight turns to where the periods at
    hand happen to scatter little, and values are two to three times less sure than their deviations say. So periods are
    left out in turn, with their part in the weights, the courses as they are (Efron and Tibshirani, An introduction to
    the bootstrap, chapter 11): weighted values are as sure as they are by that beside values without weights, and where
    these are surer, it is those. A course that bends was found with weights, and keeps them.

    Args:
        numbers: (P, K) numbers of every period, without their mean, as they scatter.
        courses: trends, with columns of such numbers; the first is told.
        middle: (P,) middles of the periods [s].

    Returns:
        Values and standard deviations.
    """
    plain, weighted = course_values(numbers, courses)[0], course_values(*_weighted(numbers, courses, middle))[0]
    count = min(len(numbers), MOST_PARTS)
    parts = [_without(numbers, courses, middle, np.arange(len(numbers)) % count == k) for k in range(count)]
    spread, of_weighted = (
        np.maximum(np.std([course_values(*each)[0].values for each in some], axis=0), SAME * plain.stds)
        for some in ([part[:2] for part in parts], [_weighted(*part) for part in parts])
    )
    if all(course.bend is None for course in courses) and np.sum(np.log(spread)) < np.sum(np.log(of_weighted)):
        return plain
    more = np.maximum(plain.stds * of_weighted / (spread * weighted.stds), 1.0)
    return replace(weighted, stds=more * weighted.stds, bend_std=float(np.max(more)) * weighted.bend_std)


def _without(
    numbers: FloatArray, courses: Sequence[Course], middle: FloatArray, out: NDArray[np.bool_]
) -> tuple[FloatArray, list[Course], FloatArray]:
    """Numbers, courses and middles of all periods but some."""
    kept = np.flatnonzero(~out)
    own = numbers[kept]
    return own - own.mean(axis=0), [course.over(kept) for course in courses], middle[kept]


def _weighted(numbers: FloatArray, courses: Sequence[Course], middle: FloatArray) -> tuple[FloatArray, list[Course]]:
    """Numbers and courses in the weights that their scatter gives."""
    weights = scatter_whitener(numbers, middle)
    return numbers @ weights, [replace(course, columns=weights @ course.columns) for course in courses]
