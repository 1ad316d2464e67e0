"""How large trends are, and how sure that is: all together, by the scatter of the periods."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sea_ident._typing import FloatArray, IntArray
from sea_ident.effects.drift import TrendEffect

LOG_STEP = 1e-3
"""Step of the logarithm of a time constant by which the change of a course is told."""

STRAIGHT = 1000.0
"""Lengths of a recording in a time constant with which a course is straight: to half a thousandth of its change."""


@dataclass(frozen=True, eq=False)
class Course:
    """Columns of one trend times its course over the periods.

    Attributes:
        profile: (P,) course, without mean.
        columns: (P, M, k) whitened columns of every period.
        bend: (P,) change of the course with the logarithm of its time constant, None where it has none to find.
    """

    profile: FloatArray
    columns: FloatArray
    bend: FloatArray | None = None

    def over(self, periods: IntArray) -> "Course":
        """The same in some of the periods."""
        profile, bent = self.profile[periods], None if self.bend is None else self.bend[periods]
        return Course(profile - profile.mean(), self.columns[periods], None if bent is None else bent - bent.mean())


@dataclass(frozen=True, eq=False)
class CourseValues:
    """What was found of one trend.

    Attributes:
        values: (k,).
        stds: (k,) standard deviations, those of the time constant and of all other trends included.
        bend_std: standard deviation of the logarithm of the time constant; 0 where it is none to find.
    """

    values: FloatArray
    stds: FloatArray
    bend_std: float = 0.0


def time_constants(effect: TrendEffect, middle: FloatArray) -> tuple[float, ...]:
    """Time constants worth trying where the middles of the periods (P,) are these [s]; with the last it is straight."""
    if not any(shape.name == "time_constant" for shape in getattr(effect, "shapes", ())):
        return (getattr(effect, "time_constant", 0.0),)
    length = float(middle[-1] + 0.5 * np.median(np.diff(middle)))
    return tuple(float(c) for c in (*np.geomspace(0.1 * length, 3.0 * length, 13), STRAIGHT * length))


def bend(effect: TrendEffect, middle: FloatArray, temperature: FloatArray | None) -> FloatArray:
    """(P,) change of the course with the logarithm of its time constant, without mean."""
    constant: float = effect.time_constant  # type: ignore[attr-defined]
    after, before = (
        replace(effect, time_constant=constant * np.exp(step)).change(middle, temperature)  # type: ignore[call-arg]
        for step in (LOG_STEP, -LOG_STEP)
    )
    change: FloatArray = (after - before) / (2.0 * LOG_STEP)
    change -= change.mean()
    return change


def course_values(flat: FloatArray, courses: Sequence[Course]) -> list[CourseValues]:
    """Values of several trends at once, with their standard deviations.

    Least squares of all of them together. The noise floor is one for all phases of a period; friction that differs
    from pass to pass lies along the very columns of friction, and is larger there. So the covariance of one period is
    taken from what the trends leave of the periods, if that is larger than the noise floor says.

    Args:
        flat: (P, M) whitened residuals of the periods, without their mean.
        courses: the trends.

    Returns:
        Values and standard deviations, trend by trend.
    """
    columns = np.concatenate([times_course(c.columns, c.profile) for c in courses], axis=1)
    amounts = _pinv(columns) @ flat.ravel()
    ends = np.cumsum([c.columns.shape[2] for c in courses])
    parts = np.split(amounts, ends[:-1])
    bends = [
        (times_course(c.columns, c.bend) @ v)[:, None]
        for c, v in zip(courses, parts, strict=True)
        if c.bend is not None
    ]
    count = columns.shape[1]
    inverse = _pinv(np.concatenate([columns, *bends], axis=1)).reshape(count + len(bends), *flat.shape)
    explained = (columns @ amounts).reshape(flat.shape)
    # the mean and every course that differs take a degree of freedom of each number of a period
    used = 1 + np.linalg.matrix_rank(np.stack([p for c in courses for p in (c.profile, c.bend) if p is not None]))
    left = (flat - explained) / np.sqrt(max(len(flat) - used, 1))
    scatter = np.sum(np.square(inverse @ left.T), axis=(1, 2))
    floor = np.sum(np.square(inverse), axis=(1, 2))
    stds = np.sqrt(np.maximum(scatter, floor))
    bend_stds = iter(stds[count:])
    return [
        CourseValues(v, s, 0.0 if c.bend is None else float(next(bend_stds)))
        for c, v, s in zip(courses, parts, np.split(stds[:count], ends[:-1]), strict=True)
    ]


def times_course(columns: FloatArray, course: FloatArray) -> FloatArray:
    """(P M, k) columns (P, M, k) of every period times a course (P,), without their mean over the periods."""
    found: FloatArray = columns * course[:, None, None]
    found -= found.mean(axis=0)
    return found.reshape(-1, columns.shape[2])


def _pinv(matrix: FloatArray) -> FloatArray:
    """(k, P M) inverse of columns (P M, k)."""
    norms = np.linalg.norm(matrix, axis=0)
    scale = np.where(norms > 0.0, norms, 1.0)
    inverse: FloatArray = np.linalg.pinv(matrix / scale, rcond=1e-10) / scale[:, None]
    return inverse
