"""Values of trends and what is said of how sure they are, against truths that were put into synthetic periods."""

import numpy as np
import pytest

from sea_ident.discrepancy.trends.trend_values import Course, bend, course_values, time_constants
from sea_ident.effects import make_effect

PERIODS, NUMBERS, DRAWS = 12, 40, 300


def course(rng, width=2, bent=False):
    time = np.arange(PERIODS) + 0.5
    profile = time - time.mean()
    square = -0.5 * time**2 / PERIODS
    columns = np.broadcast_to(rng.standard_normal((NUMBERS, width)), (PERIODS, NUMBERS, width))
    return Course(profile / PERIODS, columns, (square - square.mean()) / PERIODS if bent else None)


def put(courses, values):
    return sum(c.profile[:, None] * (c.columns @ v) for c, v in zip(courses, values, strict=True))


def centred(flat):
    return flat - flat.mean(axis=0)


def test_trends_that_overlap_are_told_apart_exactly():
    rng = np.random.default_rng(0)
    one = course(rng)
    # much alike in the columns, and the same course
    other = Course(one.profile, one.columns + 0.5 * rng.standard_normal(one.columns.shape[1:]))
    found = course_values(put([one, other], [[2.0, -1.0], [0.5, 3.0]]), [one, other])
    np.testing.assert_allclose([f.values for f in found], [[2.0, -1.0], [0.5, 3.0]], rtol=1e-9)


def test_columns_that_differ_from_pass_to_pass_are_compared_without_their_mean_too():
    """No pass is quite like another; what is without the mean over the periods is explained by what is without it."""
    rng = np.random.default_rng(3)
    alike, bent = course(rng), course(rng, 1, bent=True)
    one, other = (
        Course(c.profile, c.columns + 0.3 * rng.standard_normal(c.columns.shape), c.bend) for c in (alike, bent)
    )
    truth = [np.array([2.0, -1.0]), np.array([0.5])]
    found = course_values(centred(put([one, other], truth)), [one, other])
    for each, values in zip(found, truth, strict=True):
        np.testing.assert_allclose(each.values, values, rtol=1e-9)


@pytest.mark.parametrize("extra", [0.0, 3.0])
def test_deviations_are_what_is_stated(extra):
    """White noise, and noise that gathers along the columns: deviations in their stated unit have an rms near one."""
    rng = np.random.default_rng(1)
    courses, truth = [course(rng), course(rng, 1)], [np.array([2.0, -1.0]), np.array([0.5])]
    scores = []
    for _ in range(DRAWS):
        noise = rng.standard_normal((PERIODS, NUMBERS))
        noise += extra * rng.standard_normal((PERIODS, 2)) @ courses[0].columns[0].T / np.sqrt(NUMBERS) * 3.0
        found = course_values(centred(put(courses, truth) + noise), courses)
        scores.append(np.concatenate([(f.values - v) / f.stds for f, v in zip(found, truth, strict=True)]))
    rms = np.sqrt(np.mean(np.square(scores), axis=0))
    # Student's t of ten degrees of freedom has 1.12; where the noise floor is right it holds the deviations below
    assert np.all(rms < 1.25)
    assert np.all(rms > 0.8)


def test_a_time_constant_that_is_not_known_makes_the_rate_uncertain():
    rng = np.random.default_rng(2)
    bent = course(rng, 1, bent=True)
    straight = Course(bent.profile, bent.columns)
    flat = centred(put([straight], [np.array([2.0])]) + rng.standard_normal((PERIODS, NUMBERS)))
    (free,), (held,) = course_values(flat, [bent]), course_values(flat, [straight])
    assert free.values == pytest.approx(held.values)
    # a straight line and a parabola over the same time share 15/16 of their squares: four times the deviation
    assert free.stds[0] / held.stds[0] == pytest.approx(4.0, rel=0.2)
    assert held.bend_std == 0.0
    assert 0.0 < free.bend_std < 10.0


def test_bend_is_the_derivative_of_the_course():
    """Of T (1 - exp(-t / T)) with log T: T (1 - exp(-t / T)) - t exp(-t / T), per minute."""
    middle = np.arange(12) * 5.0 + 2.5
    effect = make_effect("friction_drift", "hip", time_constant=40.0)
    true = (40.0 * (1.0 - np.exp(-middle / 40.0)) - middle * np.exp(-middle / 40.0)) / 60.0
    np.testing.assert_allclose(bend(effect, middle, None), true - true.mean(), atol=1e-7)


def test_time_constants_end_with_a_straight_course():
    middle = np.arange(12) * 5.0 + 2.5
    found = time_constants(make_effect("friction_drift", "hip"), middle)
    assert found[0] == pytest.approx(6.0)
    assert found[-1] == pytest.approx(6e4)
    assert time_constants(make_effect("temperature_friction", "hip"), middle) == (100.0,)
