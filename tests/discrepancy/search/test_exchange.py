"""An effect that was added is replaced by a better one, and what was outdone is not tried again."""

from dataclasses import replace

import numpy as np
import pytest

import sea_ident.discrepancy.search.exchange as module
from sea_ident.discrepancy.bench.columns import effect_key
from sea_ident.discrepancy.bench.settle import Settled, settle, settle_again
from sea_ident.discrepancy.search.candidates import scan, sought
from sea_ident.discrepancy.search.exchange import Outdone, exchange
from sea_ident.discrepancy.search.next_effect import next_effect
from sea_ident.discrepancy.search.refit import refitted
from sea_ident.effects import make_effect


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
    tried = {}
    after = exchange(bench, now, 1, tried)
    assert effect_key(after.fit.effects[-1]) == key("torque_ripple")
    assert after.fit.statistic < 1.2 * after.fit.dof
    own = effect_key(now.fit.effects[-1])
    assert tried[own, key("torque_ripple")].explained > 1.0
    assert ("torque_ripple", "hip") in tries
    # every other one that was tried does less, and is not tried once more with what it promised
    tries.clear()
    known = {**tried, (own, key("torque_ripple")): Outdone(1e9, 0.0)}
    exchange(bench, now, 1, dict(known))
    outdone = {pair[1][:2] for pair, how in known.items() if how.explained < module.OUTDONE}
    assert outdone
    assert not outdone & set(tries)


def test_a_wave_that_only_stands_in_for_a_constant_takes_no_place(wrong, monkeypatch):
    monkeypatch.setattr(module, "slowest", lambda effect: effect.name == "torque_ripple")
    tried = {}
    after = exchange(*wrong, 1, tried)
    assert effect_key(after.fit.effects[-1]) != key("torque_ripple")
    assert tried[effect_key(wrong[1].fit.effects[-1]), key("torque_ripple")].explained == 0.0


def test_what_promises_more_than_it_did_is_tried_again(wrong, tries):
    bench, now = wrong
    own = effect_key(now.fit.effects[-1])
    after = exchange(bench, now, 1, {(own, key("torque_ripple")): Outdone(promised=0.1, explained=0.0)})
    assert ("torque_ripple", "hip") in tries
    assert effect_key(after.fit.effects[-1]) == key("torque_ripple")


def test_a_model_that_is_right_is_left_alone(rippled, tries):
    bench, _, right = rippled
    assert exchange(bench, right, 1, {}) is right
    assert tries == []


def test_what_explained_little_is_tried_again_only_where_it_promises_more():
    near, poor = (Outdone(promised=0.9, explained=share * module.OUTDONE) for share in (1.1, 0.9))
    assert near.again(0.9)
    assert not poor.again(0.9)
    assert not poor.again(0.9 + 0.9 * module.PROMISES_MORE)
    assert poor.again(0.9 + 1.1 * module.PROMISES_MORE)


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


def test_a_search_notes_what_did_less_than_what_it_took(rippled):
    bench, start, _ = rippled
    tried, smallest = {}, np.full(len(bench.data.equations), 1e-3)
    candidates = scan(bench, start.fit, start.noise)
    (right,) = (c for c in candidates if c.key == key("torque_ripple"))
    second = max((c for c in candidates if c.effect.name != "torque_ripple"), key=lambda c: c.gain)
    # the right one comes last, or nothing else would be tried
    best, _ = next_effect(bench, start, [second, right], 1000, smallest, tried)
    taken = effect_key(best.effects[-1])
    assert {own for own, _ in tried} == {taken}
    others = [last for (_, rival), last in tried.items() if rival != taken]
    assert others
    assert all(last.explained < 1.0 < tried[taken, taken].explained + 1e-9 for last in others)


@pytest.mark.parametrize(("complete", "taken"), [(False, False), (True, True)])
def test_a_push_takes_the_place_of_a_law_only_where_it_explains_nearly_all(wrong, monkeypatch, complete, taken):
    """Nearly twice what the law does is not enough: a push fits whatever is left at certain times."""
    bench, now = wrong
    reduced = bench.fit(now.fit.effects[:-1], now.noise, start=now.fit.parameters)
    by_law = reduced.statistic - now.fit.statistic
    gain = 0.97 * reduced.excess if complete else 1.9 * by_law
    assert 1.9 * by_law < 0.9 * reduced.excess
    push = next(c for c in scan(bench, reduced, now.noise) if c.effect.name == "external_force")
    pushed = bench.fit((*reduced.effects, push.effect), now.noise, start=now.fit.parameters)
    pushed = replace(pushed, whitened=np.sqrt(1.0 - gain / reduced.statistic) * reduced.whitened)
    monkeypatch.setattr(module, "penalty", lambda *rest: 0.0)
    monkeypatch.setattr(module, "scan", lambda *rest, **options: [replace(push, gain=gain)])
    monkeypatch.setattr(module, "refitted", lambda *rest: pushed)
    monkeypatch.setattr(module, "settle_again", lambda bench, fit: Settled(fit, now.noise))
    monkeypatch.setattr(module, "physical", lambda *rest: True)
    after = exchange(bench, now, 1, {})
    assert (after.fit.effects == pushed.effects) is taken
    assert (after is now) is not taken


@pytest.fixture
def matches(rippled, monkeypatch):
    """Two effects that were added, and one other in the place of each, fitted as a pair at prices that are given."""
    bench, start, _ = rippled

    def found(*prices):
        pair = [
            module._Match(place, key(f"own {place}"), key(f"other {place}"), None, 0.9, 1.0, start.fit)
            for place in range(2)
        ]
        outcomes = [module._Outcome(f"model {k}", 0.5, price, True) for k, price in enumerate(prices)]
        monkeypatch.setattr(module, "_matches", lambda *given: (match for match in pair))
        monkeypatch.setattr(module, "_price", lambda *given: 100.0)
        monkeypatch.setattr(module, "side_by_side", lambda trial, items: (o for o in outcomes))
        tried = {}
        return module._first_better(bench, start, range(2), tried, ()), {own for own, _ in tried}

    return found


def test_of_a_pair_in_two_places_the_second_is_forgotten_where_the_first_took_its_own(matches):
    assert matches(10.0, 1.0) == ((1, "model 0"), {key("own 0")})


def test_of_a_pair_in_two_places_the_second_may_take_its_own(matches):
    assert matches(200.0, 10.0) == ((2, "model 1"), {key("own 0"), key("own 1")})
    assert matches(200.0, 200.0) == ((2, None), {key("own 0"), key("own 1")})


@pytest.mark.scenario
def test_what_acts_by_a_load_follows_when_what_carries_it_is_replaced(laboratory):
    """A torque constant was held to the constant of a spring that was taken out, and play was told for a zero."""
    planted = [("encoder_offset", "knee", [], {"offset": -0.02}), ("torque_constant", "knee", [0.3], {})]
    bench = laboratory.bench(laboratory.record(planted))
    start = settle(bench, bench.effects)
    model = [make_effect("spring_offset", "knee"), make_effect("torque_constant", "knee")]
    now = settle_again(bench, bench.fit((*start.fit.effects, *model), start.noise, start=start.fit.parameters))
    for _ in range(3):
        now = settle_again(bench, now.fit)
    after = exchange(bench, now, 2, {})
    first, second = after.fit.effects[-2:]
    assert (first.name, second.name) == ("encoder_offset", "torque_constant")
    assert first.offset == pytest.approx(-0.02, rel=0.02)
    assert after.fit.parameters["knee.torque_constant"] == pytest.approx(0.3, rel=0.05)
