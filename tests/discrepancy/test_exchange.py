"""An effect that was added is replaced by a better one, and what was outdone is not tried again."""

import numpy as np
import pytest

import sea_ident.discrepancy.exchange as module
from sea_ident.discrepancy.candidates import scan, sought
from sea_ident.discrepancy.columns import effect_key
from sea_ident.discrepancy.exchange import Outdone, Tried, exchange
from sea_ident.discrepancy.refit import refitted
from sea_ident.discrepancy.search import next_effect
from sea_ident.discrepancy.settle import settle_again


@pytest.fixture(scope="module")
def wrong(rippled):
    """A model whose hip has the friction that comes nearest to its ripple."""
    bench, start, _ = rippled
    found = {(c.effect.name, c.effect.joint): c.effect for c in scan(bench, start.fit, start.noise)}
    other = found["position_dependent_friction", "hip"]
    new = refitted(bench, start.fit.effects, other, (), start.noise, start.fit.parameters)
    return bench, settle_again(bench, new)


@pytest.fixture
def tries(monkeypatch):
    """Effects that are fitted in the place of another."""
    seen = []

    def noted(bench, before, effect, *rest):
        seen.append((effect.name, effect.joint))
        return refitted(bench, before, effect, *rest)

    monkeypatch.setattr(module, "refitted", noted)
    return seen


def key(name, joint="hip"):
    return name, joint, ""


def test_the_right_one_takes_the_place_of_the_wrong_one(wrong, tries):
    bench, now = wrong
    tried = Tried()
    after = exchange(bench, now, 1, tried)
    assert effect_key(after.fit.effects[-1]) == key("torque_ripple")
    assert after.fit.statistic < 1.2 * after.fit.dof
    own = effect_key(now.fit.effects[-1])
    taken = tried.outdone[own, key("torque_ripple")]
    assert taken.explained > 1.0
    assert taken.short < 0.0
    assert taken.left == tried.looked[own][0] == now.fit.statistic
    assert ("torque_ripple", "hip") in tries
    # every other one that was tried does less, and is not tried once more with what it promised
    tries.clear()
    known = {**tried.outdone, (own, key("torque_ripple")): Outdone(9.0, 0.0, 1.0, now.fit.statistic)}
    exchange(bench, now, 1, Tried(known))
    outdone = {pair[1][:2] for pair, how in known.items() if how.explained < module.OUTDONE}
    assert outdone
    assert not outdone & set(tries)


def test_what_promises_more_than_it_did_is_tried_again(wrong, tries):
    bench, now = wrong
    own = effect_key(now.fit.effects[-1])
    outdone = Outdone(promised=0.1, explained=0.0, short=1.0, left=now.fit.statistic)
    after = exchange(bench, now, 1, Tried({(own, key("torque_ripple")): outdone}))
    assert ("torque_ripple", "hip") in tries
    assert effect_key(after.fit.effects[-1]) == key("torque_ripple")


def test_a_model_that_is_right_is_left_alone(rippled, tries):
    bench, _, right = rippled
    assert exchange(bench, right, 1, Tried()) is right
    assert tries == []


def test_what_fell_far_short_is_tried_again_only_after_as_much_was_explained():
    near = Outdone(promised=0.9, explained=0.8, short=200.0, left=1000.0)
    assert near.again(0.9, left=900.0)
    assert not near.again(0.9, left=1000.0 - 0.99 * 200.0 / module.MAKES_UP)
    assert near.again(0.9, left=1000.0 - 1.01 * 200.0 / module.MAKES_UP)
    # in another noise floor more may be left: then nothing is known of it
    assert near.again(0.9, left=1100.0)
    assert near.again(0.9 + 1.1 * module.PROMISES_MORE, left=1000.0)
    poor = Outdone(promised=0.9, explained=0.9 * module.OUTDONE, short=200.0, left=1000.0)
    assert not poor.again(0.9, left=1.0)


def test_an_effect_is_held_against_others_again_once_something_was_explained(wrong, tries, monkeypatch):
    bench, now = wrong
    own, left = effect_key(now.fit.effects[-1]), now.fit.statistic
    tried = Tried()
    assert not tried.nothing_new(own, left)
    tried.looked[own] = left, 1000.0
    assert tried.nothing_new(own, left)
    assert tried.nothing_new(own, left - 0.9 * module.PROMISES_MORE * 1000.0)
    assert not tried.nothing_new(own, left - 1.1 * module.PROMISES_MORE * 1000.0)
    assert not tried.nothing_new(own, left + 1.0)
    monkeypatch.setattr(module, "scan", lambda *a, **k: pytest.fail("nothing was explained since"))
    assert exchange(bench, now, 1, tried) is now
    assert tries == []
    # one that came close is due again whatever little was explained
    tried.outdone[own, key("torque_ripple")] = Outdone(0.9, 0.9, short=10.0, left=left + 50.0)
    tried.looked[own] = left + 50.0, 1000.0
    assert not tried.nothing_new(own, left)


def test_only_what_acts_where_the_effect_did_is_compared_in_its_place(wrong):
    bench, now = wrong
    noise, fit = now.noise, now.fit
    reduced = bench.fit(fit.effects[:-1], noise, start=fit.parameters)
    everything = {c.key: c.gain for c in scan(bench, reduced, noise)}
    some = {c.key: c.gain for c in scan(bench, reduced, noise, instead_of=sought(reduced, fit, noise))}
    assert all(gain == pytest.approx(everything[which], rel=1e-6, abs=1e-6) for which, gain in some.items())
    # friction of the ankle does not explain what friction of the hip does
    assert key("torque_ripple") in some
    assert key("torque_ripple", "ankle") in everything
    assert key("torque_ripple", "ankle") not in some


def test_whatever_explains_a_part_of_what_the_right_effect_does_is_compared(rippled):
    bench, _, right = rippled
    reduced = bench.fit(right.fit.effects[:-1], right.noise, start=right.fit.parameters)
    explained = reduced.statistic - right.fit.statistic
    most = {c.key for c in scan(bench, reduced, right.noise) if c.gain > 0.1 * explained}
    some = {c.key for c in scan(bench, reduced, right.noise, instead_of=sought(reduced, right.fit, right.noise))}
    assert len(most) > 1
    assert most <= some


def test_a_search_notes_by_how_much_others_fell_short_of_what_it_took(rippled):
    bench, start, _ = rippled
    tried, smallest = Tried(), np.full(len(bench.data.equations), 1e-3)
    # the right one comes last, or nothing else would be tried
    names = ("position_dependent_friction", "torque_ripple")
    found = [c for c in scan(bench, start.fit, start.noise) if c.effect.name in names and c.effect.joint == "hip"]
    found.sort(key=lambda c: names.index(c.effect.name))
    best, _ = next_effect(bench, start, found, 1000, smallest, tried)
    explained = start.fit.statistic - best.statistic
    others = {rival: last for (_, rival), last in tried.outdone.items() if rival != effect_key(best.effects[-1])}
    assert others
    for last in others.values():
        assert last.left == best.statistic
        assert last.short == pytest.approx((1.0 - last.explained) * explained)
