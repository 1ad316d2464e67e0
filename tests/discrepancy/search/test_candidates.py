"""Candidates: in which order they come."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from sea_ident.discrepancy.bench import periods
from sea_ident.discrepancy.bench.free_shapes import is_signal
from sea_ident.discrepancy.bench.judge import penalty
from sea_ident.discrepancy.bench.lacking import candidate_effects
from sea_ident.discrepancy.bench.settle import settle
from sea_ident.discrepancy.search import candidates
from sea_ident.discrepancy.search.candidates import EXACTLY, FEW_SHAPES, _best_last, scan
from sea_ident.effects import Side, make_effect
from sea_ident.motion import FourierSeries

OFFSETS = (0.0123, 0.012341)


def test_of_candidates_that_do_the_same_the_simplest_comes_first(nothing_missing, monkeypatch):
    bench, now = nothing_missing
    exactly, rng = candidates._exactly, np.random.default_rng(4)

    def alike(*arguments):
        found = exactly(*arguments)
        size = 5e5 if found.effect.joint == "knee" else 6e5
        return replace(found, gain=size * (1.0 + 1e-13 * rng.standard_normal()))

    monkeypatch.setattr(candidates, "_exactly", alike)
    names = ("torque_ripple", "torque_offset", "stribeck_friction")
    effects = [make_effect(name, joint) for joint in ("knee", "hip") for name in names]
    orders = []
    for tried in (effects, effects[::-1]):
        found = scan(bench, now.fit, now.noise, tried)
        assert [c.effect.joint for c in found] == ["hip"] * 3 + ["knee"] * 3
        for three in (found[:3], found[3:]):
            prices = [penalty(c.effect, bench) for c in three]
            assert prices == sorted(prices)
            assert prices[0] < prices[-1]
            orders.append([c.effect.name for c in three])
    assert orders[0] == orders[1]
    assert all(order[0] == "torque_offset" for order in orders)


def behind_an_offset(laboratory, offset):
    """Bench and model of a leg with an error of the encoder of its knee."""
    bench = laboratory.bench(laboratory.record([("encoder_offset", "knee", [], {"offset": 0.0123})]))
    model = (*bench.effects, make_effect("encoder_offset", "knee", offset=offset))
    start = bench.fit(model, None, tangents=False)
    noise = bench.noise(start)
    return bench, bench.fit(model, noise, start=start.parameters), noise


@pytest.mark.scenario
def test_candidates_behind_nearly_the_same_error_of_an_encoder_are_evaluated_once(laboratory, monkeypatch):
    bench, fit, noise = behind_an_offset(laboratory, OFFSETS[0])
    effects = [make_effect("torque_ripple", "knee"), make_effect("parallel_spring", "knee")]
    effects += [make_effect("external_force", "ankle")]
    rounded = scan(bench, fit, noise, effects)
    evaluated = []
    monkeypatch.setattr(bench, "spectra_of_variants", lambda variants, signals: evaluated.append(variants))
    model = (*bench.effects, make_effect("encoder_offset", "knee", offset=OFFSETS[1]))
    scan(bench, bench.fit(model, noise, start=fit.parameters), noise, effects)
    assert evaluated == []
    # and what they promise is what it is behind all digits of it
    monkeypatch.undo()
    monkeypatch.setattr(candidates, "AMOUNT_DIGITS", 16)
    monkeypatch.setattr(candidates, "ELSEWHERE_DIGITS", 16)
    exact = {c.key: c for c in scan(bench, fit, noise, effects)}
    for candidate in rounded:
        assert np.sum(candidate.raw_power) == pytest.approx(np.sum(exact[candidate.key].raw_power), rel=0.02)


@pytest.mark.scenario
def test_the_noise_is_the_same_behind_a_rounded_error_of_an_encoder(laboratory, monkeypatch):
    floors = []
    for digits in (periods.AMOUNT_DIGITS, 16):
        monkeypatch.setattr(periods, "AMOUNT_DIGITS", digits)
        floors.append(behind_an_offset(laboratory, OFFSETS[1])[2].std)
    np.testing.assert_allclose(floors[0], floors[1], rtol=1e-4)
    assert np.any(floors[0] != floors[1])


def test_every_shape_of_a_spring_is_looked_at_where_it_is_like_the_spring(nothing_missing):
    """On a small travel to one side all that is in a spring is nearly its stiffness, to single precision."""
    bench, now = nothing_missing
    for effect in candidate_effects(bench, now.fit.effects):
        if effect.side is Side.SPRING and not is_signal(effect):
            assert len(effect.variants(bench.state(now.fit.effects))) <= FEW_SHAPES, effect.name


def test_estimates_that_must_not_be_negative_are_those_of_a_bounded_least_squares(nothing_missing):
    """Both columns of a spring with dry friction must not be negative; where the target asks for it, one is zero."""
    bench, _ = nothing_missing
    effect = make_effect("spring_hysteresis", "knee")
    rng = np.random.default_rng(5)
    columns = rng.standard_normal((40, 2)) @ np.array([[1.0, 0.8], [0.0, 0.6]])
    for wanted in ([1.0, 2.0], [-1.0, 2.0], [2.0, -1.0], [-1.0, -1.0]):
        target = columns @ np.array(wanted) + 0.01 * rng.standard_normal(40)
        expected = lsq_linear(columns, target, (0.0, np.inf), tol=1e-12).x
        found = candidates._allowed_part(bench, effect, columns, target)
        np.testing.assert_allclose(found, expected, atol=1e-6)
        assert np.all(found >= 0.0)


@pytest.mark.parametrize("width", [1, 2, 3])
def test_inner_products_are_those_of_the_columns_of_each_shape(width):
    columns = np.random.default_rng(6).standard_normal((30, 4 * width))
    found = candidates._inner_products(columns, width)
    for v in range(4):
        own = columns[:, v * width : (v + 1) * width]
        np.testing.assert_allclose(found[v], own.T @ own)


def test_play_that_is_never_closed_does_what_an_offset_does(laboratory):
    """The spring is bent to one side, by little more than the motion bends it: to tell the two takes all digits."""
    wide = laboratory.motions[0]
    narrow = FourierSeries(wide.base_frequency, wide.offset, 0.25 * wide.a, 0.25 * wide.b)
    few = replace(laboratory, motions=(narrow,))
    bench = few.bench(few.record([("spring_offset", "hip", [-3.0], {})], periods=4))
    deflection = bench.data.motion.deflection[:, 0]
    assert 0.0 < deflection.min() < deflection.max() < 1.5 * deflection.min()
    now = settle(bench, bench.effects)
    effects = [make_effect(name, "hip") for name in ("spring_offset", "backlash")]
    gains = {c.effect.name: c.gain for c in scan(bench, now.fit, now.noise, effects)}
    assert gains["spring_offset"] > 100.0
    assert gains["backlash"] == pytest.approx(gains["spring_offset"], rel=0.02)


@pytest.mark.parametrize("rounding", [-1e-12, 0.0, 1e-12])
def test_of_shapes_that_do_the_same_the_smallest_is_taken_whatever_rounding_says(rounding):
    gains, sizes = np.array([800.0, 7000.0, 7000.0 * (1.0 + rounding), -1.0]), np.array([0.1, 2.0, 1.0, 0.0])
    assert list(_best_last(gains, sizes, EXACTLY)) == [3, 0, 1, 2]
    assert list(_best_last(gains, sizes[[0, 2, 1, 3]], EXACTLY)) == [3, 0, 2, 1]
    # more is more, whatever it takes
    assert list(_best_last(gains * [1.0, 1.0 + 1e-6, 1.0, 1.0], sizes, EXACTLY)) == [3, 0, 2, 1]
    assert list(_best_last(-np.ones(2), np.array([1.0, 2.0]), EXACTLY)) == [1, 0]


@pytest.mark.scenario
def test_a_wave_may_be_as_large_as_what_the_bodies_weigh(small_motions):
    """A ripple that cancels the weight leaves its motor a torque in which it is no modest part."""
    bench = small_motions.bench(
        small_motions.record([("torque_ripple", "knee", [2.0, 1.0], {"order": 12.0})], periods=10)
    )
    now = settle(bench, bench.effects)
    effects = [make_effect(name, "knee") for name in ("torque_ripple", "torque_offset")]
    gains = {found.effect.name: found.gain for found in scan(bench, now.fit, now.noise, effects)}
    assert gains["torque_ripple"] > 0.97 * gains["torque_offset"]
