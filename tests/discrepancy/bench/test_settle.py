"""Models in the noise floor, and around the loads, that belong to them."""

from dataclasses import replace

import pytest

from sea_ident.discrepancy.bench.settle import FAR, Settled, anchored_in_itself, settle, settle_again
from sea_ident.discrepancy.search.search import search
from sea_ident.effects import make_effect

SATURATION = 1e-3


@pytest.fixture(scope="module")
def saturated(laboratory):
    """Bench, and the usual model, settled: a leg whose knee motor saturates."""
    bench = laboratory.bench(laboratory.record([("torque_saturation", "knee", [SATURATION], {"exponent": 3.0})]))
    return bench, settle(bench, bench.effects)


def with_saturation(bench, start):
    """A fit with it, by the torque that the motor gives as long as nothing is known of it."""
    cube = make_effect("torque_saturation", "knee")
    anchored = bench.anchored((*start.fit.effects, cube), start.fit.parameters)
    return bench.refine(anchored, start.noise, start=start.fit.parameters, only=len(bench.effects))


def off(now):
    """Error of the saturation, in standard deviations."""
    last = next(k for k, c in enumerate(now.fit.columns) if c.name == "knee.torque_saturation")
    return (now.fit.values[last] - SATURATION) / now.fit.std(last)


@pytest.mark.scenario
def test_effects_are_followed_until_they_stand_where_the_model_puts_them(saturated):
    bench, start = saturated
    begun = Settled(fit := with_saturation(bench, start), bench.noise(fit))
    assert off(begun) > 5.0
    there = anchored_in_itself(bench, begun)
    assert there.fit.statistic < 1.2 * there.fit.dof
    assert abs(off(there)) < 2.5
    saturation = there.fit.effects[-1]
    assert saturation.coefficient == pytest.approx(there.fit.parameters["knee.torque_saturation"], rel=1e-2)
    assert anchored_in_itself(bench, there) is there


@pytest.mark.scenario
def test_a_search_ends_with_effects_that_stand(saturated):
    """It goes on to the next effect, and stops where there is none, before they do."""
    bench, start = saturated
    found = search(bench, bench.effects, start=start)
    assert [(e.name, e.joint) for e in found.effects] == [("torque_saturation", "knee")]
    assert abs(off(found.final)) < 2.5
    assert anchored_in_itself(bench, found.final) is found.final


@pytest.mark.scenario
@pytest.mark.parametrize(
    ("followed", "true", "beside"),
    [
        ("directional_efficiency", 0.2, ("spring_hysteresis", "knee", [0.2, 0.1], {"slip": 0.01})),
        ("torque_constant", -0.07, ("spring_offset", "knee", [2.0], {})),
        ("torque_saturation", SATURATION, ("torque_offset", "knee", [-1.0], {})),
    ],
)
def test_a_load_is_that_of_all_there_is_in_the_spring_and_at_the_motor(laboratory, followed, true, beside):
    bench = laboratory.bench(laboratory.record([(followed, "knee", [true], {}), beside], seed=12))
    start = settle(bench, bench.effects)
    added = make_effect(followed, "knee"), make_effect(beside[0], "knee", **beside[3])
    anchored = bench.anchored((*start.fit.effects, *added), start.fit.parameters)
    fit = bench.refine(anchored, start.noise, start=start.fit.parameters, only=len(bench.effects))
    found = anchored_in_itself(bench, Settled(fit, bench.noise(fit))).fit
    assert found.statistic < 1.2 * found.dof
    own = next(k for k, c in enumerate(found.columns) if c.name == f"knee.{followed}")
    assert abs(found.values[own] - true) < 2.5 * found.std(own)
    alone = [replace(effect, terms=()) if hasattr(effect, "terms") else effect for effect in found.effects]
    away = bench.fit(alone, bench.noise(found), start=found.parameters)
    assert abs(away.values[own] - true) > 3.0 * away.std(own)


def test_what_depends_on_nothing_stays_as_it_is(nothing_missing):
    bench, now = nothing_missing
    assert anchored_in_itself(bench, now) is now


@pytest.mark.scenario
def test_a_model_that_lacks_more_is_left_alone(saturated):
    """Its sizes are wrong by what it lacks, and rounds would be lost."""
    bench, start = saturated
    loss = make_effect("load_dependent_friction", "knee")
    fit = bench.fit((*start.fit.effects, loss), start.noise, start=start.fit.parameters)
    assert bench.anchored(fit.effects, fit.parameters) != fit.effects
    lacking = Settled(fit, start.noise)
    assert fit.statistic > FAR * fit.dof
    assert anchored_in_itself(bench, lacking) is lacking


@pytest.mark.scenario
def test_a_spring_that_carries_little_is_not_lost_to_what_is_missing_beside_it(prosthesis):
    """The ankle of a prosthesis, whose foot is light, and friction of the foot that the model lacks."""
    recording = prosthesis.record([("link_friction", "ankle", [0.3, 1.0], {})], periods=10)
    bench = prosthesis.bench(recording)
    now = settle(bench, bench.effects)
    assert now.fit.statistic > 50.0 * now.fit.dof
    assert now.fit.parameters["ankle.spring_stiffness"] > 0.5 * 90.0
    friction = make_effect("link_friction", "ankle")
    found = bench.refine((*now.fit.effects, friction), now.noise, start=now.fit.parameters, only=len(bench.effects))
    fit = settle_again(bench, found).fit
    assert fit.statistic < 1.2 * fit.dof
    for k, column in enumerate(fit.columns):
        true = {"ankle.spring_stiffness": 90.0, "ankle.link_friction_viscous": 0.3, "ankle.link_friction_coulomb": 1.0}
        if column.name in true:
            assert abs(fit.values[k] - true[column.name]) < 3.0 * fit.std(k)
