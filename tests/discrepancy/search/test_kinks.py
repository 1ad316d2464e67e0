"""The kink of a spring that is stiffer beyond it, where a motion passes it and where it does not."""

from dataclasses import replace

import numpy as np
import pytest

from sea_ident.discrepancy.bench.free_shapes import free_shapes
from sea_ident.discrepancy.bench.judge import penalty
from sea_ident.discrepancy.bench.settle import Settled, settle, settled_in_form
from sea_ident.discrepancy.search.formed import formed
from sea_ident.discrepancy.search.kinks import at_its_kink
from sea_ident.discrepancy.search.refit import refitted
from sea_ident.discrepancy.search.search import search
from sea_ident.effects import make_effect

KINK, STIFFER = 0.009, 30.0
"""Of the knee: between two of the kinks that a search tries [rad], [N m/rad]."""


@pytest.fixture(scope="module")
def kinked(laboratory):
    """A leg whose knee spring is stiffer beyond a kink: bench, and the settled model without it."""
    recording = laboratory.record([("asymmetric_spring", "knee", [STIFFER], {"kink": KINK})], periods=10)
    bench = laboratory.bench(recording)
    return bench, settle(bench, bench.effects)


def beginning(bench, start, **shape):
    effects = (*start.fit.effects, make_effect("asymmetric_spring", "knee", **shape))
    return bench.fit(effects, start.noise, start=start.fit.parameters)


@pytest.mark.scenario
def test_the_motion_passes_the_kink(kinked):
    knee = kinked[0].data.motion.deflection[:, 1]
    assert knee.min() < 0.0 < KINK < knee.max()


@pytest.mark.scenario
@pytest.mark.parametrize("off", [0.7, 1.4])
def test_a_kink_is_found_from_one_nearby(kinked, off):
    bench, start = kinked
    fit = beginning(bench, start, kink=off * KINK)
    found = at_its_kink(bench, fit, start.noise, len(fit.effects) - 1)
    assert found.effects[-1].kink == pytest.approx(KINK, rel=0.02)
    assert found.effects[-1].exponent == 1.0
    value, std = found.parameters["knee.asymmetric_spring"], found.std(len(found.values) - 1)
    assert value == pytest.approx(STIFFER, abs=4.0 * std + 0.01 * STIFFER)


@pytest.mark.scenario
def test_a_kink_at_rest_and_what_has_none_stay(kinked):
    bench, start = kinked
    fit = beginning(bench, start)
    assert at_its_kink(bench, fit, start.noise, len(fit.effects) - 1) is fit
    assert at_its_kink(bench, fit, start.noise, 0) is fit


@pytest.mark.scenario
def test_a_kink_that_is_not_passed_stays(kinked):
    bench, start = kinked
    beyond = 1.1 * float(np.max(bench.data.motion.deflection[:, 1]))
    fit = beginning(bench, start, kink=beyond)
    assert at_its_kink(bench, fit, start.noise, len(fit.effects) - 1) is fit


@pytest.mark.scenario
def test_a_kink_that_is_right_stays(kinked):
    bench, start = kinked
    fit = beginning(bench, start, kink=KINK)
    now = Settled(at_its_kink(bench, fit, start.noise, len(fit.effects) - 1), start.noise)
    assert settled_in_form(bench, now, len(bench.effects), at_its_kink) is now


@pytest.mark.scenario
def test_a_kink_has_a_price_and_both_its_sides_are_straight(kinked):
    bench, _ = kinked
    plain = make_effect("asymmetric_spring", "knee")
    bent = replace(plain, kink=KINK)
    assert [shape.name for _, shape in free_shapes((plain, bent))] == ["exponent"]
    assert penalty(bent, bench) == penalty(plain, bench)


@pytest.mark.scenario
def test_a_spring_with_a_kink_elsewhere_is_named_alone(kinked):
    bench, _ = kinked
    selection = search(bench, bench.effects)
    assert [(e.name, e.joint) for e in selection.effects] == [("asymmetric_spring", "knee")]
    assert selection.effects[0].kink == pytest.approx(KINK, rel=0.02)


@pytest.mark.scenario
def test_a_candidate_is_compared_with_its_kink_where_it_belongs(kinked):
    bench, start = kinked
    effect = make_effect("asymmetric_spring", "knee", kink=0.7 * KINK)
    fit = refitted(bench, start.fit.effects, effect, (), start.noise, start.fit.parameters)
    assert fit.effects[-1].kink == pytest.approx(KINK, rel=0.02)


@pytest.mark.scenario
def test_what_was_found_beside_something_else_moves_its_kink(kinked):
    bench, start = kinked
    now = Settled(beginning(bench, start, kink=0.7 * KINK), start.noise)
    assert formed(bench, now).fit.effects[-1].kink == pytest.approx(KINK, rel=0.02)
