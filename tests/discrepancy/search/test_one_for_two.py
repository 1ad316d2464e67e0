"""Two pushes at the same time that are one on another link are told as one, and so are delays of joints."""

import pytest

from sea_ident.discrepancy.bench.settle import settle, settle_again
from sea_ident.discrepancy.search import search as search_module
from sea_ident.discrepancy.search.one_for_two import one_for_two
from sea_ident.effects import make_effect

PERIOD = 5.0
START, STOP = 2.64, 3.56


def push(joint, start=START, stop=STOP, **point):
    return make_effect("external_force", joint, start=start, stop=stop, period=PERIOD, **point)


@pytest.fixture(scope="module")
def pushed(laboratory):
    """A leg that is pushed at its knee, and at its ankle at another time."""
    planted = [(push("knee"), [4.0, 0.0, 3.0]), (push("ankle", 0.6, 1.2), [6.0, 0.0, 0.0])]
    bench = laboratory.bench(laboratory.record(planted, periods=6))
    return bench, settle(bench, bench.effects)


def fitted(pushed, *pushes):
    bench, start = pushed
    effects = (*start.fit.effects, *pushes)
    return settle_again(bench, bench.refine(effects, start.noise, start=start.fit.parameters, only=len(bench.effects)))


@pytest.mark.scenario
def test_two_on_the_wrong_links_are_one_on_the_right_one(pushed):
    bench, _ = pushed
    beside = push("ankle", 0.6, 1.2)
    now = fitted(pushed, push("hip"), beside, push("ankle", point_x=0.01, point_z=0.01))
    assert now.fit.statistic < 3.0 * now.fit.dof
    after, left = one_for_two(bench, now, 3)
    assert left == [0, 1]
    found, other = after.fit.effects[len(bench.effects) :]
    assert found.joint == "knee"
    assert (other.joint, other.start) == ("ankle", pytest.approx(0.6))
    assert after.fit.statistic < 1.2 * after.fit.dof
    assert after.fit.parameters["knee.external_force_x"] == pytest.approx(4.0, abs=0.3)
    assert after.fit.parameters["knee.external_force_z"] == pytest.approx(3.0, abs=0.3)


@pytest.mark.scenario
def test_a_search_tells_one(pushed, monkeypatch):
    """Where nothing more is found, and what is there is not exchanged."""
    bench, start = pushed
    now = fitted(pushed, push("hip"), push("ankle", 0.6, 1.2), push("ankle", point_x=0.01, point_z=0.01))
    monkeypatch.setattr(search_module, "next_effect", lambda *given: None)
    monkeypatch.setattr(search_module, "exchange", lambda bench, now, *given: now)
    begun = search_module.Selection(start, now, 3, (0.0, 0.0, 0.0))
    found = search_module.search(bench, bench.effects, begun)
    assert [effect.joint for effect in found.effects] == ["knee", "ankle"]
    assert len(found.p_values) == found.added == 2


@pytest.mark.scenario
def test_pushes_at_other_times_or_other_effects_stay(pushed, monkeypatch):
    """Nothing is tried in their place."""
    bench, _ = pushed
    monkeypatch.setattr("sea_ident.discrepancy.search.one_for_two.side_by_side", None)
    now = fitted(pushed, push("knee"), make_effect("torque_offset", "hip"), push("ankle", 0.6, 1.2))
    after, left = one_for_two(bench, now, 3)
    assert after is now
    assert left == [0, 1, 2]


@pytest.mark.scenario
def test_two_that_no_other_does_for_stay(pushed, laboratory):
    """Pushes at the same time on both ends of the leg, across each other."""
    planted = [(push("hip"), [0.0, 0.0, 40.0]), (push("ankle"), [8.0, 0.0, 0.0])]
    bench = laboratory.bench(laboratory.record(planted, periods=6))
    start = settle(bench, bench.effects)
    now = fitted((bench, start), push("hip"), push("ankle"))
    after, left = one_for_two(bench, now, 2)
    assert left == [0, 1]
    assert after is now
