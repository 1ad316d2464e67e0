"""Dry friction in a spring of which a motion shows one element, told as the first one."""

from types import SimpleNamespace

import numpy as np
import pytest

from sea_ident.discrepancy.bench.settle import Settled, settle, settled_in_form
from sea_ident.discrepancy.search.search import Selection, search
from sea_ident.discrepancy.search.slips import by_the_first_element, with_its_second_element, without_what_sticks
from sea_ident.effects import make_effect
from sea_ident.effects.spring_hysteresis import WIDER

SLIP, NARROW, WIDE = 0.006, 0.9, 0.6
"""Of the knee, which bends by little more than that either way [rad], [N m], [N m]."""


@pytest.fixture(scope="module")
def slipping(laboratory):
    """A leg with dry friction in the spring of its knee: bench, and the settled model without it."""
    recording = laboratory.record([("spring_hysteresis", "knee", [NARROW, WIDE], {"slip": SLIP})], periods=10)
    bench = laboratory.bench(recording)
    return bench, settle(bench, bench.effects)


def with_slip(bench, start, slip):
    effects = (*start.fit.effects, make_effect("spring_hysteresis", "knee", slip=slip))
    return bench.fit(effects, start.noise, start=start.fit.parameters)


@pytest.fixture(scope="module")
def by_the_second(slipping):
    """The model with the friction that is there told by its second element."""
    bench, start = slipping
    begun = with_slip(bench, start, SLIP / WIDER)
    return bench.refine(begun.effects, start.noise, start=begun.parameters, only=len(bench.effects))


@pytest.mark.scenario
def test_the_motion_shows_one_element(slipping):
    swing = 0.5 * np.ptp(slipping[0].data.motion.deflection[:, 1])
    assert SLIP < swing < WIDER * SLIP


@pytest.mark.scenario
def test_a_second_element_is_told_as_the_first(slipping, by_the_second):
    bench, start = slipping
    position = len(by_the_second.effects) - 1
    narrow = by_the_second.slice_of(position, bench.counts(by_the_second.effects)).start
    assert abs(by_the_second.values[narrow]) < 0.05 * NARROW
    found = by_the_first_element(bench, by_the_second, start.noise, position)
    slip_std = found.effects[-1].slip * found.std(len(found.columns) + len(found.free_shapes) - 1)
    assert found.effects[-1].slip == pytest.approx(SLIP, abs=3.0 * slip_std + 1e-4 * SLIP)
    assert found.values[narrow] == pytest.approx(NARROW, abs=3.0 * found.std(narrow))


@pytest.mark.scenario
def test_a_first_element_that_is_there_stays(slipping, monkeypatch):
    bench, start = slipping
    fit = with_slip(bench, start, SLIP)
    monkeypatch.setattr(bench, "refine", None)  # nothing is tried
    assert by_the_first_element(bench, fit, start.noise, len(fit.effects) - 1) is fit
    now = Settled(fit, start.noise)
    assert settled_in_form(bench, now, len(bench.effects), by_the_first_element) is now


@pytest.mark.scenario
def test_nothing_but_friction_in_a_spring_is_told_otherwise(slipping):
    bench, start = slipping
    nothing = (*start.fit.effects, make_effect("torque_offset", "hip"))
    fit = bench.fit(nothing, start.noise, start=start.fit.parameters)
    for position in range(len(nothing)):
        assert by_the_first_element(bench, fit, start.noise, position) is fit


@pytest.mark.scenario
def test_a_second_element_stays_where_the_first_does_not_do_for_it(slipping, by_the_second, monkeypatch):
    bench, start = slipping
    refine = bench.refine

    def worse(effects, noise, **given):
        found = refine(effects, noise, **given)
        bent = (*found.effects[:-1], make_effect("spring_hysteresis", "knee", slip=0.7 * SLIP))
        return bench.fit(bent, noise, start=found.parameters)

    monkeypatch.setattr(bench, "refine", worse)
    position = len(by_the_second.effects) - 1
    assert by_the_first_element(bench, by_the_second, start.noise, position) is by_the_second


@pytest.mark.scenario
def test_a_search_tells_the_first_element(slipping, by_the_second):
    bench, start = slipping
    begun = Selection(start, Settled(by_the_second, start.noise), 1, (0.0,))
    found = search(bench, bench.effects, begun)
    (friction,) = (e for e in found.effects if e.name == "spring_hysteresis")
    assert friction.slip == pytest.approx(SLIP, rel=0.02)


def beside_a_constant(bench, start, slip, *, elements=2, constant=True, joint="knee"):
    """A model with friction in a spring, and a constant in that of a joint."""
    more = (make_effect("spring_offset", joint),) if constant else ()
    effects = (*start.fit.effects, *more, make_effect("spring_hysteresis", "knee", slip=slip, elements=elements))
    return bench.fit(effects, start.noise, start=start.fit.parameters)


@pytest.mark.scenario
def test_an_element_that_sticks_is_left_out_beside_a_constant(slipping, monkeypatch):
    """Of the elastic law and the constant it is a sum."""
    bench, start = slipping
    both = beside_a_constant(bench, start, SLIP)
    one = without_what_sticks(bench, both, start.noise, len(both.effects) - 1)
    assert one.effects[-1].elements == 1
    assert one.statistic == pytest.approx(both.statistic, abs=3.0)
    narrow = one.slice_of(len(one.effects) - 1, bench.counts(one.effects)).start
    assert one.values[narrow] == pytest.approx(NARROW, abs=3.0 * one.std(narrow))
    assert without_what_sticks(bench, one, start.noise, len(one.effects) - 1) is one
    monkeypatch.setattr(bench, "refine", None)  # nothing is tried
    for other in (
        beside_a_constant(bench, start, SLIP, constant=False),
        beside_a_constant(bench, start, SLIP, joint="hip"),
    ):
        assert without_what_sticks(bench, other, start.noise, len(other.effects) - 1) is other


@pytest.mark.scenario
def test_an_element_that_sticks_is_not_added(slipping, monkeypatch):
    """However much it explains."""
    bench, start = slipping
    one = beside_a_constant(bench, start, SLIP, elements=1)

    def better(effects, noise, **given):
        return SimpleNamespace(effects=effects, statistic=0.0, unit=1.0)

    monkeypatch.setattr(bench, "refine", better)
    assert with_its_second_element(bench, one, start.noise) is one
    short = beside_a_constant(bench, start, 0.2 * SLIP, elements=1)
    assert with_its_second_element(bench, short, start.noise) is not short


@pytest.mark.scenario
def test_an_element_that_slips_stays(laboratory, monkeypatch):
    """And is added where it does."""
    recording = laboratory.record([("spring_hysteresis", "knee", [0.5, 0.4], {"slip": 0.0015})], periods=10)
    bench = laboratory.bench(recording)
    start = settle(bench, bench.effects)
    both = beside_a_constant(bench, start, 0.0015)
    one = beside_a_constant(bench, start, 0.0015, elements=1)
    again = with_its_second_element(bench, one, start.noise)
    assert again.effects[-1].elements == 2
    assert again.statistic == pytest.approx(both.statistic, rel=0.05)
    monkeypatch.setattr(bench, "refine", None)  # nothing is tried
    assert without_what_sticks(bench, both, start.noise, len(both.effects) - 1) is both
