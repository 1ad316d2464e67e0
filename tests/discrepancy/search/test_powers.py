"""Saturation by another power than a cube, and springs that stiffen by a power of their own."""

import numpy as np
import pytest

from sea_ident.discrepancy.bench.lack import LACK_LEVEL, lack_of_fit
from sea_ident.discrepancy.bench.settle import settle, settle_again
from sea_ident.discrepancy.search import powers
from sea_ident.discrepancy.search.candidates import scan
from sea_ident.discrepancy.search.powers import with_their_powers
from sea_ident.discrepancy.search.refit import refitted
from sea_ident.effects import make_effect


def saturated(laboratory, coefficient, exponent, *others):
    """A recording with saturation at the knee and what else is planted, and the model with a cube, settled."""
    planted = [("torque_saturation", "knee", [coefficient], {"exponent": exponent}), *others]
    bench = laboratory.bench(laboratory.record(planted))
    start = settle(bench, bench.effects)
    scanned = scan(bench, start.fit, start.noise)
    effect = next(c.effect for c in scanned if (c.effect.name, c.effect.joint) == ("torque_saturation", "knee"))
    now = settle_again(bench, refitted(bench, bench.effects, effect, (), start.noise, start.fit.parameters))
    for _ in range(4):
        now = settle_again(bench, now.fit)
    return bench, now


@pytest.mark.scenario
def test_the_power_is_found_where_the_cube_leaves_much(laboratory):
    bench, cube = saturated(laboratory, 1.5e-2, 1.8)
    assert cube.fit.statistic > 1.2 * cube.fit.dof
    now = with_their_powers(bench, cube, len(bench.effects))
    exponent, std = now.fit.effects[-1].exponent, now.fit.std(len(now.fit.columns) + len(now.fit.free_shapes) - 1)
    assert exponent == pytest.approx(1.8, abs=3.0 * exponent * std)
    assert std < 0.1
    assert now.fit.statistic < 1.1 * now.fit.dof


@pytest.mark.scenario
def test_a_cube_stays_one(laboratory):
    bench, cube = saturated(laboratory, 1e-3, 3.0)
    assert with_their_powers(bench, cube, len(bench.effects)) is cube
    assert cube.fit.effects[-1].exponent == 3.0
    last = next(k for k, c in enumerate(cube.fit.columns) if c.name == "knee.torque_saturation")
    assert cube.fit.values[last] == pytest.approx(1e-3, abs=3.0 * cube.fit.std(last))


@pytest.mark.scenario
def test_much_saturation_stands_still(laboratory):
    """Followed at once, the command that saturates and what is taken away jump about each other."""
    bench, now = saturated(laboratory, 1e-3, 3.0)
    seen = []
    for _ in range(4):
        now = settle_again(bench, now.fit)
        seen.append((now.fit.effects[-1].coefficient, now.fit.statistic / now.fit.dof))
    coefficients, ratios = np.array(seen).T
    np.testing.assert_allclose(coefficients, 1e-3, rtol=0.05)
    assert np.max(ratios) < 1.2


@pytest.mark.scenario
def test_what_another_effect_leaves_speaks_for_no_other_power(laboratory, monkeypatch):
    bench, cube = saturated(laboratory, 6e-4, 3.0, ("torque_ripple", "hip", [0.3, 0.2], {"order": 4.0}))
    assert lack_of_fit(bench, cube)[2] < LACK_LEVEL

    def settled(*_):
        raise AssertionError("a power that promises nothing was followed")

    monkeypatch.setattr(powers, "settle_again", settled)
    assert with_their_powers(bench, cube, len(bench.effects)) is cube


@pytest.mark.scenario
@pytest.mark.parametrize(("planted", "held"), [(2.0, True), (2.2, False)])
def test_a_spring_stiffens_by_its_own_power_where_that_is_told_from_the_one_tried(laboratory, planted, held):
    effect = make_effect("spring_stiffening", "knee", exponent=2.0)
    bench = laboratory.bench(laboratory.record([(effect.name, "knee", [4000.0], {"exponent": planted})]))
    start = settle(bench, bench.effects)
    fit = bench.fit((*start.fit.effects, effect), start.noise, start=start.fit.parameters)
    tried = settle_again(bench, fit)
    now = with_their_powers(bench, tried, len(bench.effects))
    assert (now is tried) is held
    assert (now.fit.effects[-1] == effect) is held
    if not held:
        free = next(k for k, (position, _) in enumerate(now.fit.free_shapes) if position == len(now.fit.effects) - 1)
        std = 3.5 * now.fit.std(len(now.fit.columns) + free)
        assert now.fit.effects[-1].exponent == pytest.approx(planted, abs=3.0 * std)
        assert std < 0.05
        assert now.fit.statistic < 1.2 * now.fit.dof
