"""Signals of all joints that are late by the same time: told as one delay."""

import warnings
from dataclasses import replace
from types import SimpleNamespace

import pytest

from sea_ident.discrepancy import diagnose
from sea_ident.discrepancy.bench.settle import settle, settle_again
from sea_ident.discrepancy.search import common_delays as common_delays_module
from sea_ident.discrepancy.search.candidates import scan
from sea_ident.discrepancy.search.common_delays import common_delays, with_a_common_delay
from sea_ident.discrepancy.search.explained_by_one import PROMISED
from sea_ident.discrepancy.search.next_effect import FAMILY_LEVEL
from sea_ident.discrepancy.search.one_for_two import one_for_two
from sea_ident.discrepancy.search.refit import refitted
from sea_ident.discrepancy.search.search import search
from sea_ident.effects import effect_classes, make_effect
from sea_ident.estimation import identify
from sea_ident.exceptions import SeaIdentWarning


def on_the_bench(laboratory, *planted):
    """Bench, settled model and candidates of a leg with effects."""
    bench = laboratory.bench(laboratory.record(planted))
    start = settle(bench, bench.effects)
    return bench, start, scan(bench, start.fit, start.noise)


@pytest.fixture(scope="module")
def late(laboratory):
    """Of a leg whose torques are all late."""
    return on_the_bench(laboratory, ("torque_delay", None, [], {"delay": 0.006}))


@pytest.mark.scenario
def test_one_delay_of_all_is_found(late, laboratory):
    """The right one of the two, and how long it is; nothing more is missing."""
    for name, delay, within, asked in (
        ("torque_delay", 0.006, 8e-4, late),
        ("position_delay", 0.004, 1e-5, on_the_bench(laboratory, ("position_delay", None, [], {"delay": 0.004}))),
    ):
        bench = asked[0]
        now = with_a_common_delay(*asked, 1000)
        (found,) = now.fit.effects[len(bench.effects) :]
        assert (found.name, found.joint) == (name, None)
        assert found.delay == pytest.approx(delay, abs=within)
        assert now.fit.statistic < 1.3 * now.fit.dof
        assert with_a_common_delay(bench, now, scan(bench, now.fit, now.noise), 1000) is now


def with_their_delays(bench, start, *joints):
    """The model with delays of some joints, refined."""
    delays = (make_effect("torque_delay", joint, delay=0.005) for joint in joints)
    effects = (*start.fit.effects, *delays)
    return settle_again(bench, bench.refine(effects, start.noise, start=start.fit.parameters, only=len(bench.effects)))


@pytest.mark.scenario
def test_the_delays_of_some_joints_are_theirs(laboratory):
    """Before a search and after it."""
    asked = on_the_bench(laboratory, *(("torque_delay", joint, [], {"delay": 0.006}) for joint in ("hip", "ankle")))
    bench, start, _ = asked
    assert with_a_common_delay(*asked, 1000) is start
    now = with_their_delays(bench, start, "hip", "ankle")
    assert one_for_two(bench, now, 2) == (now, [0, 1])


@pytest.mark.scenario
def test_delays_that_were_found_one_by_one_are_one(late):
    """What stands between them stays."""
    bench, start, _ = late
    offset = make_effect("torque_offset", "hip")
    delays = [make_effect("torque_delay", joint, delay=0.005) for joint in ("hip", "knee", "ankle")]
    effects = (*start.fit.effects, delays[0], offset, *delays[1:])
    new = bench.refine(effects, start.noise, start=start.fit.parameters, only=len(bench.effects))
    after, left = one_for_two(bench, settle_again(bench, new), 4)
    assert left == [0, 1]
    found, other = after.fit.effects[len(bench.effects) :]
    assert (found.name, found.joint) == ("torque_delay", None)
    assert found.delay == pytest.approx(0.006, abs=8e-4)
    assert other == offset
    assert one_for_two(bench, after, 2) == (after, [0, 1])


@pytest.mark.scenario
def test_a_search_asks_for_its_significance(late):
    bench, start, _ = late
    found = search(bench, bench.effects, start=start)
    assert [(effect.name, effect.joint) for effect in found.effects] == [("torque_delay", None)]
    (p_value,) = found.p_values
    assert 0.0 < p_value < FAMILY_LEVEL


@pytest.mark.scenario
def test_what_is_there_is_not_asked_for_again(late, monkeypatch):
    bench, start, _ = late
    asked = []
    monkeypatch.setattr(common_delays_module, "scan", lambda *given: asked.append(given[3]) or [])
    there = replace(start.fit, effects=(*start.fit.effects, make_effect("torque_delay")))
    with_a_common_delay(bench, replace(start, fit=there), [], 1000)
    assert [[effect.name for effect in kinds] for kinds in asked] == [["position_delay"]]


@pytest.mark.scenario
def test_it_is_not_asked_for_where_one_effect_explains_all(late, nothing_missing, monkeypatch):
    """Nor found where nothing is missing."""
    bench, start, candidates = late
    whole = refitted(bench, start.fit.effects, make_effect("torque_delay"), (), start.noise, start.fit.parameters)
    assert with_a_common_delay(bench, start, [], 1000) is not start
    more = SimpleNamespace(gain=1.001 * (start.fit.statistic - whole.statistic))
    with monkeypatch.context() as patched:
        patched.setattr(common_delays_module, "one_promises_all", lambda *given: False)
        assert with_a_common_delay(bench, start, [more], 1000) is start
        patched.setattr(common_delays_module, "explained_by_one", lambda *given: more.gain)
        assert with_a_common_delay(bench, start, [], 1000) is start
    better = SimpleNamespace(gain=1.01 * PROMISED * start.fit.excess)
    assert with_a_common_delay(bench, start, [better, *candidates], 1000) is start
    bench, start = nothing_missing
    assert with_a_common_delay(bench, start, scan(bench, start.fit, start.noise), 1000) is start


@pytest.mark.scenario
def test_a_base_that_leans_is_no_delay(laboratory):
    asked = on_the_bench(laboratory, ("base_tilt", None, [0.03, 0.02], {}))
    assert with_a_common_delay(*asked, 1000) is asked[1]


def test_a_library_without_delays_has_none_of_all(leg, monkeypatch):
    less = {name: kind for name, kind in effect_classes().items() if name != "torque_delay"}
    monkeypatch.setattr(common_delays_module, "effect_classes", lambda: less)
    assert [effect.name for effect in common_delays(leg)] == ["position_delay"]


def test_robots_without_springs_have_one_delay_of_all(leg):
    """Torques that are late are angles that are early; of a single joint the delay is its own."""
    rigid = [SimpleNamespace(n=n, joints=(SimpleNamespace(elastic=False),) * n) for n in (1, 2)]
    assert [[effect.name for effect in common_delays(robot)] for robot in (*rigid, leg)] == [
        [],
        ["torque_delay"],
        ["torque_delay", "position_delay"],
    ]


@pytest.mark.scenario
@pytest.mark.parametrize(("name", "delay", "least"), [("torque_delay", 0.006, 5e-5), ("position_delay", 0.002, 1e-7)])
def test_currents_or_encoders_that_another_device_recorded_are_told(laboratory, leg, name, delay, least):
    """Beside a spring that hangs beside a joint; what is repaired goes on another motion, in torque and simulation."""
    effects = [(name, None, [], {"delay": delay}), ("parallel_spring", "hip", [20.0, 0.0], {})]
    recording, holdout = (
        laboratory.record(effects, periods=p, seed=s, motion=m) for p, s, m in ((10, 3, 0), (6, 7, 1))
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        found = diagnose(identify(leg, recording, period=5.0), recording, holdout=holdout)
    assert found.verdict in ("named", "named_with_remainder")
    assert {(m.effect, m.joint) for m in found.missing} == {(name, None), ("parallel_spring", "hip")}
    own = next(m for m in found.missing if m.effect == name)
    assert own.title == f"{name} at all joints"
    (parameter,) = own.parameters
    assert parameter.value == pytest.approx(delay, abs=3.0 * parameter.std)
    assert least < parameter.std < 0.1 * delay
    assert found.holdout.shrink > 0.6
    assert found.simulation_gap["q"].shrink > 0.8
