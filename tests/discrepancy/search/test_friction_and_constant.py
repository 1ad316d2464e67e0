"""A spring that rubs and whose zero is another one: told together, for neither is found without the other."""

import warnings

import pytest

from sea_ident.discrepancy import diagnose
from sea_ident.discrepancy.bench.settle import settle
from sea_ident.discrepancy.search.candidates import scan
from sea_ident.discrepancy.search.friction_and_constant import both_at_once
from sea_ident.discrepancy.search.next_effect import FAMILY_LEVEL
from sea_ident.discrepancy.search.refit import refitted
from sea_ident.discrepancy.search.search import search
from sea_ident.effects import effect_classes, make_effect
from sea_ident.estimation import identify
from sea_ident.exceptions import SeaIdentWarning

JOINT, FRICTION, SLIP, CONSTANT = "ankle", 0.2, 0.003, 0.2
"""Of a spring that bends by little more than it takes to slip [N m], [rad], [N m]."""

ZEROS = {"spring_offset", "encoder_offset", "motor_encoder_offset"}


def rubbing(*more):
    return [("spring_hysteresis", JOINT, [FRICTION, 0.0], {"slip": SLIP}), *more]


@pytest.fixture(scope="module")
def with_a_constant(laboratory):
    """Bench and settled model of a leg whose spring rubs beside a constant."""
    bench = laboratory.bench(laboratory.record(rubbing(("spring_offset", JOINT, [CONSTANT], {}))))
    return bench, settle(bench, bench.effects)


def single(bench, now, effect):
    """The model with one effect more, from its best shape."""
    (best,) = scan(bench, now.fit, now.noise, [effect])
    return refitted(bench, now.fit.effects, best.effect, (), now.noise, now.fit.parameters)


@pytest.mark.scenario
def test_both_are_found_where_no_single_one_is(with_a_constant, monkeypatch):
    """To within their standard deviations; the best single effect is another one, and leaves most."""
    bench, start = with_a_constant
    eccentric = single(bench, start, make_effect("encoder_eccentricity", JOINT))
    assert eccentric.excess > 0.4 * start.fit.excess
    candidates = scan(bench, start.fit, start.noise)
    found, p_value = both_at_once(bench, start, candidates, eccentric, 1000)
    assert p_value < FAMILY_LEVEL
    assert [effect.name for effect in found.effects[-2:]] == ["spring_offset", "spring_hysteresis"]
    assert found.statistic < 1.3 * found.dof
    with monkeypatch.context() as patched:
        less = {name: kind for name, kind in effect_classes().items() if name != "spring_hysteresis"}
        patched.setattr("sea_ident.discrepancy.search.friction_and_constant.effect_classes", lambda: less)
        assert both_at_once(bench, start, candidates, eccentric, 1000) is None
    others = [candidate for candidate in candidates if candidate.effect.joint != JOINT]
    assert both_at_once(bench, start, others, eccentric, 1000) is None
    assert found.effects[-1].elements == 1
    names = [column.name for column in found.columns]
    for name, true in ((f"{JOINT}.spring_offset", CONSTANT), (f"{JOINT}.spring_hysteresis_narrow", FRICTION)):
        own = names.index(name)
        assert abs(found.values[own]) == pytest.approx(true, abs=3.0 * found.std(own))


@pytest.mark.scenario
def test_they_stay_when_what_is_not_needed_is_taken_out(with_a_constant):
    """Without the constant an element that sticks would stand in for it, and pull the wrong way."""
    bench, start = with_a_constant
    found = search(bench, bench.effects, start=start)
    assert len(found.p_values) == found.added == 2
    assert {(effect.name, effect.joint) for effect in found.effects} == {
        ("spring_offset", JOINT),
        ("spring_hysteresis", JOINT),
    }


@pytest.mark.scenario
def test_neither_stays_where_they_are_not_possible(with_a_constant, monkeypatch):
    bench, start = with_a_constant
    monkeypatch.setattr("sea_ident.discrepancy.search.search._possible", lambda *given: False)
    found = search(bench, bench.effects, start=start)
    assert found.p_values == ()
    assert found.final.fit.effects == start.fit.effects


@pytest.mark.scenario
def test_one_of_them_alone_is_told_alone(laboratory, nothing_missing):
    """Friction that does without a constant, a constant without friction, and where nothing is missing."""
    bench = laboratory.bench(laboratory.record(rubbing()))
    start = settle(bench, bench.effects)
    candidates = scan(bench, start.fit, start.noise)
    own = single(bench, start, make_effect("spring_hysteresis", JOINT))
    assert both_at_once(bench, start, candidates, own, 1000) is None
    bench = laboratory.bench(laboratory.record([("spring_offset", JOINT, [CONSTANT], {})]))
    start = settle(bench, bench.effects)
    candidates = scan(bench, start.fit, start.noise)
    own = single(bench, start, make_effect("spring_offset", JOINT))
    assert both_at_once(bench, start, candidates, own, 1000) is None
    bench, start = nothing_missing
    assert both_at_once(bench, start, scan(bench, start.fit, start.noise), None, 1000) is None


@pytest.mark.scenario
@pytest.mark.parametrize(
    "zero",
    [
        ("spring_offset", JOINT, [CONSTANT], {}),
        ("encoder_offset", JOINT, [], {"offset": 0.001}),
        ("encoder_offset", JOINT, [], {"offset": 0.003}),
    ],
)
def test_a_spring_that_rubs_and_has_another_zero_is_told(laboratory, leg, zero):
    """The friction by its name and size, the zero as what a constant in a spring may be."""
    recording, holdout = (
        laboratory.record(rubbing(zero), periods=p, seed=s, motion=m) for p, s, m in ((10, 3, 0), (6, 7, 1))
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        found = diagnose(identify(leg, recording, period=5.0), recording, holdout=holdout)
    assert found.verdict in ("named", "ambiguous")
    friction = next(m for m in found.missing if m.effect == "spring_hysteresis")
    assert friction.joint == JOINT
    assert friction.alternatives == ()
    told = {p.name.removeprefix(f"{JOINT}.spring_hysteresis_"): p for p in friction.parameters}
    assert told["narrow"].value == pytest.approx(FRICTION, abs=3.0 * told["narrow"].std)
    assert told["slip"].value == pytest.approx(SLIP, rel=0.02)
    (constant,) = (m for m in found.missing if m is not friction)
    assert constant.joint == JOINT
    assert {constant.effect, *(a.effect for a in constant.alternatives)} >= ZEROS
    assert constant.parameters[0].std < 0.1 * abs(constant.parameters[0].value)
