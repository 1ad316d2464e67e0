"""Values of trends are as sure as is said, though their scatter is known from a few periods only."""

from dataclasses import replace

import numpy as np
import pytest

from sea_ident.discrepancy.trends import trend_left_out as left_out
from sea_ident.discrepancy.trends.trend_left_out import MOST_PARTS, surest_values
from sea_ident.discrepancy.trends.trend_scatter import scatter_whitener
from sea_ident.discrepancy.trends.trend_values import Course, course_values

PERIODS, NUMBERS, DRAWS = 20, 12, 80
MIDDLE = 5.0 * (np.arange(PERIODS) + 0.5)
PROFILE = MIDDLE / 60.0 - np.mean(MIDDLE / 60.0)
TRUTH = np.array([8.0, -3.0])
ONE, OTHER = np.linalg.qr(np.random.default_rng(1).standard_normal((NUMBERS, 2)))[0].T
FRICTION = np.stack([ONE, 0.95 * ONE + 0.31 * OTHER], axis=1)
"""Two columns, much alike."""


def drawn(rng, columns, scattering, size, turning=0.0):
    """Numbers of a trend, with scatter along directions (NUMBERS, d), others in every period, beside noise of one."""
    numbers = np.outer(PROFILE, columns @ TRUTH) + rng.standard_normal((PERIODS, NUMBERS))
    for own in numbers:
        turned = scattering + turning * rng.standard_normal(scattering.shape)
        own += size * turned @ rng.standard_normal(scattering.shape[1])
    return numbers - numbers.mean(axis=0), [Course(PROFILE, np.broadcast_to(columns, (PERIODS, *columns.shape)))]


def weighted(numbers, courses):
    weights = scatter_whitener(numbers, MIDDLE)
    return course_values(numbers @ weights, [replace(c, columns=weights @ c.columns) for c in courses])[0]


def scores(scattering, size, turning=0.0):
    """Rms errors in standard deviations as told and by weights alone, and rms errors as told and without weights."""
    rng = np.random.default_rng(11)
    told, by_weights, errors = [], [], []
    for _ in range(DRAWS):
        numbers, courses = drawn(rng, FRICTION, scattering, size, turning)
        found, other = surest_values(numbers, courses, MIDDLE), weighted(numbers, courses)
        told.append((found.values - TRUTH) / found.stds)
        by_weights.append((other.values - TRUTH) / other.stds)
        errors.append([found.values - TRUTH, course_values(numbers, courses)[0].values - TRUTH])
    return (*(np.sqrt(np.mean(np.square(each), axis=0)) for each in (told, by_weights, errors)),)


def test_where_friction_scatters_another_way_in_every_period_values_are_as_sure_as_is_said():
    told, by_weights, _ = scores(np.linalg.qr(FRICTION)[0], 6.0, turning=0.5)
    assert np.all(told < 1.4)
    assert np.all(by_weights > 1.8)


def test_what_scatters_one_way_is_weighted_out():
    away = np.linalg.qr(np.concatenate([FRICTION, np.eye(NUMBERS)[:, :1]], axis=1))[0][:, 2]
    told, _, (own, plain) = scores((0.8 * FRICTION[:, 0] + 0.6 * away)[:, None], 20.0)
    assert np.all(told < 1.4)
    assert own[0] < 0.7 * plain[0]


def test_without_scatter_both_are_the_same():
    numbers, courses = drawn(np.random.default_rng(2), FRICTION, np.zeros((NUMBERS, 1)), 0.0)
    found, plain = surest_values(numbers, courses, MIDDLE), course_values(numbers, courses)[0]
    assert found.values == pytest.approx(plain.values, rel=1e-6)
    assert found.stds == pytest.approx(plain.stds, rel=1e-6)


def test_a_course_that_bends_keeps_its_weights():
    numbers, (straight,) = drawn(np.random.default_rng(5), FRICTION, FRICTION, 6.0)
    bent = replace(straight, bend=PROFILE**2 - np.mean(PROFILE**2))
    found, other = surest_values(numbers, [bent], MIDDLE), weighted(numbers, [bent])
    assert found.values == pytest.approx(other.values)
    # as much less sure as its least sure value
    assert found.bend_std / other.bend_std == pytest.approx(np.max(found.stds / other.stds))


def test_values_that_are_surer_without_weights_have_none(monkeypatch):
    """Weights that are others whatever period is left out tell nothing but chance."""
    erratic = np.random.default_rng(9)
    monkeypatch.setattr(left_out, "scatter_whitener", lambda *_: np.diag(erratic.uniform(0.05, 1.0, NUMBERS)))
    numbers, (straight,) = drawn(np.random.default_rng(5), FRICTION, FRICTION, 6.0)
    plain = course_values(numbers, [straight])[0]
    assert np.all(surest_values(numbers, [straight], MIDDLE).values == plain.values)
    bent = replace(straight, bend=PROFILE**2 - np.mean(PROFILE**2))
    found = surest_values(numbers, [bent], MIDDLE)
    assert not np.any(found.values == plain.values)
    assert np.all(found.stds > plain.stds)


def test_of_many_periods_several_are_left_out_at_a_time(monkeypatch):
    asked = []
    monkeypatch.setattr(left_out, "course_values", lambda *given: asked.append(len(given[0])) or course_values(*given))
    count = 3 * PERIODS + 1
    rng, middle = np.random.default_rng(4), 5.0 * (np.arange(count) + 0.5)
    profile = middle - middle.mean()
    numbers = np.outer(profile, FRICTION @ (0.02 * TRUTH)) + rng.standard_normal((count, NUMBERS))
    course = Course(profile, np.broadcast_to(FRICTION, (count, *FRICTION.shape)))
    found = surest_values(numbers - numbers.mean(axis=0), [course], middle)
    assert sorted(set(asked)) == [count - 4, count - 3, count]
    assert len(asked) == 2 * (MOST_PARTS + 1)
    assert np.all(np.abs(found.values - 0.02 * TRUTH) < 4.0 * found.stds)


def test_a_value_that_is_the_same_whatever_is_left_out_is_as_sure_as_noise_lets_it_be():
    exact = np.outer(PROFILE, FRICTION @ TRUTH)
    (course,) = drawn(np.random.default_rng(1), FRICTION, np.zeros((NUMBERS, 1)), 0.0)[1]
    found, plain = surest_values(exact, [course], MIDDLE), course_values(exact, [course])[0]
    assert found.values == pytest.approx(TRUTH)
    assert found.stds == pytest.approx(plain.stds)
    nothing = surest_values(0.0 * exact, [course], MIDDLE)
    assert np.all(nothing.values == 0.0)
    assert nothing.stds == pytest.approx(plain.stds)
