"""What is taken out of a model again: what it does not need, and what cannot be."""

from dataclasses import replace

import pytest

from sea_ident.discrepancy.bench.judge import own_torque
from sea_ident.discrepancy.bench.settle import Settled, settle
from sea_ident.discrepancy.search.elimination import Elimination, eliminate
from sea_ident.discrepancy.search.search import Selection, still_needed
from sea_ident.effects import make_effect


def named(selection):
    return {(effect.name, effect.joint) for effect in selection.effects}


@pytest.mark.scenario
def test_a_push_that_is_hardly_larger_than_what_has_no_name_is_a_part_of_that(laboratory):
    """At certain times of a period a form that is not the right one leaves something too, and a push fits there."""
    push = make_effect("external_force", "ankle", start=0.4, stop=0.9)
    ripple = make_effect("torque_ripple", "hip", order=4.0)
    planted = [("external_force", "ankle", [0.0, 0.0, 0.4], {"start": 0.4, "stop": 0.9})]

    def kept(amplitude, known):
        ripples = ("torque_ripple", "hip", [amplitude, 0.0], {"order": 4.0})
        recording = laboratory.record([*planted, ripples], periods=5)
        bench = laboratory.bench(recording)
        start = settle(bench, (*bench.effects, *known))
        now = settle(bench, (*bench.effects, *known, push))
        return still_needed(bench, Selection(start, now, 1, (1e-9,))).added

    assert kept(2.0, []) == 0
    assert kept(2.0, [ripple]) == 1
    assert kept(0.01, []) == 1


@pytest.mark.scenario
@pytest.mark.parametrize(("amplitude", "stays"), [(0.0, True), (0.3, False)])
def test_a_push_that_leaves_nearly_nothing_is_none_of_another_form(laboratory, amplitude, stays):
    """However small it is beside what has no name at another joint: nothing else would be told without it."""
    planted = [
        ("external_force", "ankle", [0.0, 0.0, 2.0], {"start": 0.4, "stop": 0.9}),
        ("torque_ripple", "hip", [amplitude, 0.0], {"order": 4.0}),
    ]
    bench = laboratory.bench(laboratory.record(planted, periods=5))
    now = settle(bench, (*bench.effects, make_effect("external_force", "ankle", start=0.4, stop=0.9)))
    position = len(bench.effects)
    for nameless in (0.0, own_torque(bench, now.fit, position)):
        tried = Elimination(bench, now, 100, nameless)(position)
        assert (tried.p_value < 1e-100) is (stays or not nameless)


@pytest.mark.scenario
@pytest.mark.parametrize("first", [0, 1])
def test_of_two_that_only_bend_each_other_the_lesser_goes(unequal, monkeypatch, first):
    """Whichever was found first; alone the other one is needed."""
    bench, found = unequal
    both = len(found.final.fit.effects)
    bends = "sea_ident.discrepancy.search.elimination.bends_another"
    monkeypatch.setattr(bends, lambda _, fit, __: len(fit.effects) == both)
    effects = (*bench.effects, *(found.effects if first == 0 else found.effects[::-1]))
    fit = bench.fit(effects, found.final.noise, start=found.final.fit.parameters)
    begun = replace(found, final=Settled(fit, found.final.noise))
    assert named(still_needed(bench, begun)) == {("torque_offset", "knee")}


@pytest.mark.scenario
def test_of_two_that_only_bend_each_other_the_one_goes_without_which_the_other_can_be(unequal, monkeypatch):
    """Though what cannot be fits better: alone it would go as well, and nothing be left."""
    bench, found = unequal
    both = len(found.final.fit.effects)
    monkeypatch.setattr(
        "sea_ident.discrepancy.search.elimination.bends_another", lambda _, fit, __: len(fit.effects) == both
    )

    def physical(_, fit, position):
        return len(fit.effects) == both or fit.effects[position].name != "torque_offset"

    monkeypatch.setattr("sea_ident.discrepancy.search.elimination.physical", physical)
    assert named(still_needed(bench, found)) == {("stribeck_friction", "hip")}


@pytest.mark.scenario
@pytest.mark.parametrize(("own", "left"), [(4e-4, 1), (6e-4, 2)])
def test_what_is_smaller_than_what_matters_goes_however_the_model_bends_without_it(unequal, monkeypatch, own, left):
    bench, found = unequal
    shares = {"stribeck_friction": own, "torque_offset": 1.0}
    monkeypatch.setattr(
        "sea_ident.discrepancy.search.elimination.own_torque",
        lambda _, fit, position: shares[fit.effects[position].name],
    )
    assert still_needed(bench, found).added == left


@pytest.mark.scenario
@pytest.mark.parametrize(("hidden", "left"), [(False, 0), (True, 2)])
def test_what_hardly_shows_stays_where_another_takes_it_up(unequal, monkeypatch, hidden, left):
    bench, found = unequal
    monkeypatch.setattr("sea_ident.discrepancy.search.elimination.torque_change", lambda *args: 0.0)
    monkeypatch.setattr("sea_ident.discrepancy.search.elimination.taken_up", lambda *args: hidden)
    assert still_needed(bench, found).added == left


@pytest.mark.scenario
def test_what_ended_at_the_end_of_its_range_beside_the_others_goes(unequal):
    """It was at none when it was added: the others were missing yet."""
    bench, found = unequal
    lowest = next(s.lower for s in found.effects[0].shapes + found.effects[1].shapes if s.name == "speed")
    ended = [replace(e, speed=lowest) if e.name == "stribeck_friction" else e for e in found.effects]
    fit = bench.fit((*bench.effects, *ended), found.final.noise, start=found.final.fit.parameters)
    left, p_values = eliminate(bench, Settled(fit, found.final.noise), list(found.p_values), found.tests)
    assert [e.name for e in left.fit.effects[len(bench.effects) :]] == ["torque_offset"]
    assert len(p_values) == 1


def test_what_is_not_physical_in_the_end_is_not_found(rippled):
    """Its part of the wrong sign was excused as long as others might be missing."""
    bench, _, right = rippled
    fit = right.fit
    friction = make_effect("link_friction", "hip")
    values = dict(fit.parameters)
    with_it = bench.fit((*fit.effects, friction), right.noise, start=values)
    columns = [c.name for c in with_it.columns]
    bent = with_it.values.copy()
    bent[[columns.index(f"hip.link_friction_{part}") for part in ("viscous", "coulomb")]] = -5.0, 5.0
    now = Settled(replace(with_it, values=bent), right.noise)
    left, p_values = eliminate(bench, now, [1e-9, 1e-9], 1000)
    assert [e.name for e in left.fit.effects[-1:]] == ["torque_ripple"]
    assert len(p_values) == 1
    assert eliminate(bench, Settled(replace(with_it, values=bent), right.noise), [1e-9], 1000)[1] == []


@pytest.mark.scenario
def test_what_became_too_short_is_not_needed(unequal, monkeypatch):
    bench, selection = unequal
    position, now = len(bench.effects), selection.final
    for short in (False, True):
        monkeypatch.setitem(Elimination.__call__.__globals__, "too_short", lambda bench, effect, s=short: s)
        assert (Elimination(bench, now, selection.tests, 0.0)(position).p_value == 1.0) == short
