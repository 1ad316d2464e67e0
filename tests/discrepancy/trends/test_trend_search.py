"""Which trends are chosen: beside each other, straight where nothing speaks for a bend, by what was measured."""

from dataclasses import replace

import numpy as np
import pytest

from sea_ident.discrepancy.measured.noise import NoiseFloor
from sea_ident.discrepancy.trends.trend import _trend
from sea_ident.discrepancy.trends.trend_directions import Cause, courses
from sea_ident.discrepancy.trends.trend_left_out import surest_values
from sea_ident.discrepancy.trends.trend_search import (
    EQUALLY_GOOD,
    FORM,
    PRICE_OF_A_BEND,
    alike,
    as_good,
    best_trend,
    find_trends,
)
from sea_ident.discrepancy.trends.trend_values import CourseValues
from sea_ident.effects import make_effect
from sea_ident.effects.drift import warming

PERIODS, NUMBERS = 20, 12
MIDDLE = 5.0 * (np.arange(PERIODS) + 0.5)
FLOOR = NoiseFloor(np.ones((2, 1, 1), dtype=complex), PERIODS, 1e4, 1e4)


def trend(columns, joint, kind="stiffness_drift", temperature=None):
    """All courses of a trend with columns (M,)."""
    each = np.broadcast_to(columns[:, None], (PERIODS, NUMBERS, 1))
    return courses(Cause(make_effect(kind, joint), columns[:, None], temperature), each, MIDDLE)


def values_of(flat):
    return lambda own, beside: surest_values(flat, [d.course for d in (own, *beside)], MIDDLE)


def axes(count):
    return np.linalg.qr(np.random.default_rng(3).standard_normal((NUMBERS, count)))[0].T


def noisy(rng, *parts):
    flat = rng.standard_normal((PERIODS, NUMBERS)) + sum(parts)
    return flat - flat.mean(axis=0)


def found(flat, directions):
    chosen = find_trends(flat, directions, MIDDLE, FLOOR, 2, 1e-3, lambda d, v: True)
    return {c.direction.name for c in chosen}


def test_what_two_trends_share_is_exchanged_for_them():
    """The third looks like the sum of the two: alone it explains most, and it is neither."""
    one, other, third = axes(3)
    mixed = (one + other + 0.3 * third) / np.sqrt(2.09)
    directions = [*trend(one, "hip"), *trend(other, "knee"), *trend(mixed, "ankle")]
    flat = noisy(np.random.default_rng(4), *(np.outer(0.8 * MIDDLE, c) for c in (one, other)))
    assert best_trend(flat, directions, MIDDLE, FLOOR).direction.effect.joint == "ankle"
    assert found(flat, directions) == {("stiffness_drift", "hip"), ("stiffness_drift", "knee")}


def test_a_second_trend_is_not_what_the_course_of_the_first_leaves():
    """A strong one that gets faster, as none of the library does, beside columns that are much like its own."""
    one, third = axes(2)
    directions = [*trend(one, "hip"), *trend(one + 0.3 * third, "knee")]
    course = MIDDLE + 2e-3 * (MIDDLE - 50.0) ** 2
    flat = noisy(np.random.default_rng(5), np.outer(20.0 * course, one))
    assert found(flat, directions) == {("stiffness_drift", "hip")}


@pytest.mark.parametrize(("alone", "named"), [(True, {"hip", "knee"}), (False, {"hip"})])
def test_what_matters_but_beside_another_is_passed_over_and_what_does_not_is_the_end(alone, named):
    """The second does not matter, beside the first or at all; the third does, where it comes to that."""
    one, other, third = axes(3)
    directions = [
        *trend(one, "hip"),
        *trend(0.6 * one + 0.8 * other, "hip", "torque_constant_drift"),
        *trend(third, "knee"),
    ]
    sizes = (8.0, one), (4.0, 0.6 * one + 0.8 * other), (2.0, third)
    flat = noisy(np.random.default_rng(11), *(np.outer(size * MIDDLE, c) for size, c in sizes))
    beside = []

    def matters(own, others):
        if own.direction.effect.name != "torque_constant_drift":
            return True
        beside.extend(each for each in (own, *others) if others)
        return alone and not others

    chosen = find_trends(flat, directions, MIDDLE, FLOOR, 3, 1e-3, matters)
    assert {c.direction.name for c in chosen} == {("stiffness_drift", joint) for joint in named}
    if alone:
        # each with the value that it has beside the other, not with what it would have to be without
        own, first = (each.values[0] for each in beside)
        assert first == pytest.approx(2.0 * own, rel=0.02)


def test_a_straight_trend_is_called_straight():
    rng = np.random.default_rng(6)
    (one,) = axes(1)
    directions = trend(one, "hip")
    bent = [
        best_trend(noisy(rng, np.outer(0.5 * MIDDLE, one)), directions, MIDDLE, FLOOR).direction.bent
        for _ in range(100)
    ]
    assert np.mean(bent) < 0.06


def test_a_time_constant_is_not_that_of_a_grid():
    (one,) = axes(1)
    best = best_trend(np.outer(-1e3 * np.expm1(-MIDDLE / 23.7), one), trend(one, "hip"), MIDDLE, FLOOR)
    assert best.direction.bent
    assert best.direction.effect.time_constant == pytest.approx(23.7, rel=1e-2)


def test_a_measured_temperature_is_preferred_where_a_straight_course_does_as_well():
    """So weak that the two courses cannot be told apart: of the two, the temperature is the one that was not free."""
    rng = np.random.default_rng(9)
    (one,) = axes(1)
    temperature = 24.0 - 18.0 * np.expm1(-MIDDLE / 40.0)
    directions = [*trend(one, "hip", "friction_drift"), *trend(one, "hip", "temperature_friction", temperature)]
    names = [
        best_trend(noisy(rng, np.outer(0.4 * temperature, one)), directions, MIDDLE, FLOOR).direction.effect.name
        for _ in range(60)
    ]
    assert np.mean([name == "temperature_friction" for name in names]) > 0.9


@pytest.mark.parametrize("warms", [True, False])
def test_a_measured_temperature_says_which_friction_it_is(warms):
    """The same columns: what follows the temperature is its effect, what goes its own way is a drift."""
    rng = np.random.default_rng(7)
    (one,) = axes(1)
    temperature = 24.0 - 18.0 * np.expm1(-MIDDLE / 40.0)
    directions = [
        *trend(one, "hip", "friction_drift"),
        *trend(one, "hip", "temperature_friction", temperature),
    ]
    course = temperature if warms else 0.3 * MIDDLE
    expected = "temperature_friction" if warms else "friction_drift"
    names = [
        best_trend(noisy(rng, np.outer(5.0 * course, one)), directions, MIDDLE, FLOOR).direction.effect.name
        for _ in range(60)
    ]
    assert np.mean([name == expected for name in names]) > 0.95


def test_names_by_chance_are_rare():
    """Nine trends in white noise: the probability that is stated."""
    rng = np.random.default_rng(8)
    directions = [d for k, c in enumerate(axes(9)) for d in trend(c, f"joint{k}")]
    p_values = np.array([best_trend(noisy(rng), directions, MIDDLE, FLOOR).p_value for _ in range(100)])
    assert np.mean(p_values < 0.05) < 0.1


def test_share_that_another_explains():
    """Columns at 60 degrees: a quarter."""
    one, other = axes(2)
    near = 0.5 * one + np.sqrt(0.75) * other
    flat = np.outer(MIDDLE - MIDDLE.mean(), one)
    share = alike(flat, trend(one, "hip")[-1], trend(near, "knee")[-1], None)
    assert share == pytest.approx(0.25, rel=1e-6)


@pytest.mark.scenario
@pytest.mark.parametrize("time_constant", [40.0, 300.0, 1e6])
def test_a_rate_is_as_sure_as_is_said_whether_its_course_bends_or_not(time_constant):
    """Where a bend just does not show, the rate at the start is another one than that of a straight line."""
    rng = np.random.default_rng(10)
    one, other = axes(2)
    directions = [*trend(one, "hip"), *trend(0.6 * one + 0.8 * other, "knee")]
    rate, course = 15.0, warming(MIDDLE, time_constant)
    scores = []
    for _ in range(60):
        flat = noisy(rng, *(np.outer(rate * course, d) for d in (one, 0.6 * one + 0.8 * other)))
        chosen = find_trends(flat, directions, MIDDLE, FLOOR, 2, 1e-3, lambda d, v: True)
        # of which nothing is known within a period
        trends = [
            _trend(flat, chosen, k, directions, MIDDLE, lambda d, v: 0.1, values_of(flat)) for k in range(len(chosen))
        ]
        scores.extend((t.values[0] - rate) / t.stds[0] for t in trends)
    assert len(scores) > 60
    assert np.sqrt(np.mean(np.square(scores))) < 1.7


@pytest.mark.parametrize(("apart", "size", "told"), [(0.02, 20.0, False), (0.1, 20.0, True), (0.1, 0.2, False)])
def test_what_a_trend_could_be_as_well_has_the_course_that_is_best_for_it(apart, size, told):
    """Of two with nearly the same columns no form is known well enough to tell them, however large both are."""
    one, third = axes(2)
    directions = [*trend(one, "hip"), *trend((one + apart * third) / np.hypot(1.0, apart), "knee")]
    # a time constant that no search tries as it is
    flat = noisy(np.random.default_rng(6), np.outer(size * warming(MIDDLE, 47.0) * 60.0, one))
    (own,) = find_trends(flat, directions, MIDDLE, FLOOR, 1, 1e-3, lambda d, v: True)
    assert own.direction.effect.joint == "hip"
    rivals = as_good(flat, directions, MIDDLE, own, None)
    assert [effect.joint for effect, _ in rivals] == ([] if told else ["knee"])
    for effect, share in rivals:
        assert effect.time_constant == pytest.approx(own.direction.effect.time_constant, rel=0.05)
        assert share == pytest.approx(1.0 / (1.0 + apart**2), abs=0.02)


@pytest.mark.parametrize(("used", "rivals"), [((0,), 0), ((0, 1), 1)])
def test_another_column_is_paid_for(used, rivals):
    """Friction has two, a torque constant one: where the two explain a little more, the one may be it."""
    one, other = axes(2)
    flat = noisy(np.random.default_rng(7), np.outer(0.5 * MIDDLE, one))
    best = best_trend(flat, trend(one, "hip", "torque_constant_drift"), MIDDLE, FLOOR)
    friction = next(d for d in trend(other, "hip", "friction_drift") if not d.bent)
    assert not best.direction.bent
    more = EQUALLY_GOOD + 0.5 * PRICE_OF_A_BEND
    own = replace(best, direction=friction, used=used, gain=best.gain + more)
    assert FORM * own.gain < EQUALLY_GOOD
    assert len(as_good(flat, trend(one, "hip", "torque_constant_drift"), MIDDLE, own, None)) == rivals


def test_a_trend_that_the_model_has_keeps_its_place_and_another_is_looked_for_beside_it():
    """What explains the same a little better is no other trend: the model has one for that."""
    one, other, third = axes(3)
    near = (one + 0.01 * third) / np.hypot(1.0, 0.01)
    directions = [*trend(one, "hip"), *trend(near, "knee"), *trend(other, "ankle")]
    flat = noisy(np.random.default_rng(7), np.outer(2.0 * MIDDLE, near), np.outer(0.5 * MIDDLE, other))

    def names(known):
        chosen = find_trends(flat, directions, MIDDLE, FLOOR, 3, 1e-3, lambda d, v: True, known)
        return [c.direction.effect.joint for c in chosen]

    assert names(()) == ["knee", "ankle"]
    assert names([("stiffness_drift", "hip")]) == ["hip", "ankle"]
    # one that is not there has no part in it
    quiet = noisy(np.random.default_rng(8), np.outer(0.5 * MIDDLE, other))
    chosen = find_trends(quiet, directions, MIDDLE, FLOOR, 3, 1e-3, lambda d, v: True, [("stiffness_drift", "hip")])
    assert [c.direction.effect.joint for c in chosen] == ["ankle"]
    # nor where nothing is, nor is there room for more than the largest number
    nothing = noisy(np.random.default_rng(9))
    known = [("stiffness_drift", "hip")]
    assert find_trends(nothing, directions, MIDDLE, FLOOR, 3, 1e-3, lambda d, v: True, known) == []
    (only,) = find_trends(flat, directions, MIDDLE, FLOOR, 1, 1e-3, lambda d, v: True, known)
    assert only.direction.effect.joint == "hip"


def test_a_value_that_is_nothing_is_as_unsure_as_any():
    (one,) = axes(1)
    directions = trend(one, "hip")
    flat = noisy(np.random.default_rng(12), np.outer(0.8 * MIDDLE, one))
    chosen = find_trends(flat, directions, MIDDLE, FLOOR, 1, 1e-3, lambda d, v: True)
    nothing = CourseValues(np.zeros(1), np.array([0.1]))
    told = _trend(flat, chosen, 0, directions, MIDDLE, lambda d, v: 0.1, lambda own, beside: nothing)
    assert told.stds == pytest.approx([0.1])
