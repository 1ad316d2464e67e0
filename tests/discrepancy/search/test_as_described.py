"""Friction of links that the description gives and the model lacks is tried first, at all joints at once."""

from dataclasses import replace

import numpy as np
import pytest

import sea_ident
from sea_ident.discrepancy.bench.judge import penalty
from sea_ident.discrepancy.bench.settle import settle
from sea_ident.discrepancy.search import search as searching
from sea_ident.discrepancy.search.as_described import as_described
from sea_ident.discrepancy.search.search import _as_described, search
from sea_ident.effects import make_effect
from sea_ident.simulation import plant_from_robot

JOINTS = ("hip", "knee", "ankle")


@pytest.fixture(scope="module")
def described(laboratory):
    """A leg of which the description gives friction of every link."""
    return replace(laboratory, leg=sea_ident.load_robot("exo_leg_link_friction"))


@pytest.fixture(scope="module")
def rubbing(described):
    """Bench and settled model of that leg."""
    bench = described.bench(described.record())
    return bench, settle(bench, bench.effects)


def with_friction_at(described, *joints, share=1.0, planted=()):
    """Bench and settled model of a leg with no other friction of links than a share of it at these joints."""
    plant = plant_from_robot(described.leg)
    there = share * np.isin(described.leg.joint_names, joints)
    plant = plant.replace(
        link_viscous_friction=plant.link_viscous_friction * there,
        link_coulomb_friction=plant.link_coulomb_friction * there,
    )
    bench = described.bench(described.record(planted, plant=plant))
    return bench, settle(bench, bench.effects)


def found_in(selection):
    return {(effect.name, effect.joint) for effect in selection.effects}


@pytest.mark.scenario
def test_friction_is_told_at_all_joints_at_once(rubbing):
    bench, start = rubbing
    fit = as_described(bench, start).fit
    assert fit.statistic < 1.3 * fit.dof < start.fit.statistic
    names = [column.name for column in fit.columns]
    for joint in bench.robot.joints:
        for part, value in (("viscous", joint.damping), ("coulomb", joint.friction)):
            k = names.index(f"{joint.name}.link_friction_{part}")
            assert fit.values[k] == pytest.approx(value, abs=4.0 * fit.std(k) + 0.005 * value)


@pytest.mark.scenario
def test_a_search_names_it_and_nothing_else(rubbing, monkeypatch):
    bench, start = rubbing
    monkeypatch.setattr(searching, "next_effect", lambda *given: None)  # it is no discovery
    selection = search(bench, bench.effects, start=start)
    assert found_in(selection) == {("link_friction", joint) for joint in JOINTS}
    assert len(selection.p_values) == 3
    assert max(selection.p_values) < 1e-9


@pytest.mark.scenario
def test_what_a_description_gives_and_no_link_has_is_not_told(described, monkeypatch):
    bench, start = with_friction_at(described)
    monkeypatch.setattr(bench, "fit", None)  # nothing is missing, nothing is tried
    assert as_described(bench, start) is start
    assert _as_described(bench, start) == (start, [])


@pytest.mark.scenario
def test_encoders_of_links_that_are_late_at_all_joints_are_no_friction_there(described):
    """The friction that is described fits nearly as well."""
    bench, start = with_friction_at(described, planted=[("position_delay", None, [], {"delay": 2e-4})])
    rubbing = as_described(bench, start).fit
    assert rubbing.statistic < 0.01 * start.fit.statistic
    now, added = _as_described(bench, start)
    (late,) = now.fit.effects[len(bench.effects) :]
    assert (late.name, late.joint, len(added)) == ("position_delay", None, 1)
    assert late.delay == pytest.approx(2e-4, rel=0.01)
    assert now.fit.statistic < 1.1 * now.fit.dof < rubbing.statistic


@pytest.mark.scenario
def test_what_explains_little_is_not_where_a_search_begins(described):
    bench, start = with_friction_at(described, planted=[("torque_ripple", "hip", [1.0, 0.5], {"order": 4.0})])
    assert as_described(bench, start) is start


@pytest.mark.scenario
def test_what_the_model_has_is_not_added_again(described, rubbing):
    bench = described.bench(described.record(), (*described.effects, make_effect("link_friction", "hip")))
    now = as_described(bench, settle(bench, bench.effects))
    found = [effect.joint for effect in now.fit.effects if effect.name == "link_friction"]
    assert sorted(found) == sorted(JOINTS)


@pytest.mark.scenario
def test_friction_stays_where_it_is_needed(described):
    bench, start = with_friction_at(described, "knee")
    now, p_values = _as_described(bench, start)
    assert [(e.name, e.joint) for e in now.fit.effects[len(bench.effects) :]] == [("link_friction", "knee")]
    assert len(p_values) == 1
    assert p_values[0] < 1e-9
    assert now.fit.statistic < 1.3 * now.fit.dof


@pytest.mark.scenario
def test_how_sure_it_is_follows_from_the_recording(described):
    bench, start = with_friction_at(described, "knee", share=0.006)
    _, (p_value,) = _as_described(bench, start)
    assert 0.0 < p_value < 1e-20


@pytest.mark.scenario
def test_a_model_that_has_it_is_as_it_was(described, rubbing):
    friction = [make_effect("link_friction", joint) for joint in JOINTS]
    bench = described.bench(described.record(), (*described.effects, *friction))
    start = settle(bench, bench.effects)
    assert as_described(bench, start) is start


@pytest.mark.scenario
def test_what_stays_without_friction_of_links_begins_with_nothing(laboratory):
    bench = laboratory.bench(laboratory.record([("link_friction", "knee", [0.1, 0.15], {})]))
    start = settle(bench, bench.effects)
    assert as_described(bench, start) is start  # the description gives none
    assert search(bench, bench.effects, start=start).added == 1


@pytest.mark.scenario
def test_the_friction_that_is_described_takes_no_place_from_others(described, monkeypatch):
    monkeypatch.setattr(searching, "MOST_EFFECTS", 1)
    bench = described.bench(described.record([("torque_ripple", "hip", [1.0, 0.5], {"order": 4.0})]))
    selection = search(bench, bench.effects)
    friction = {("link_friction", joint) for joint in JOINTS}
    assert found_in(selection) == friction | {("torque_ripple", "hip")}
    # nor where a search goes on from it
    only = replace(selection, final=as_described(bench, selection.start), added=3, p_values=3 * (0.0,))
    assert found_in(search(bench, bench.effects, only)) == found_in(selection)


@pytest.mark.scenario
def test_what_is_described_has_no_price(described, laboratory):
    friction = make_effect("link_friction", "knee")
    there, elsewhere = (each.bench(each.record()) for each in (described, laboratory))
    assert penalty(friction, there) == 0.0
    assert penalty(friction, elsewhere) > 0.0
    # a spring that stiffens is in a model by itself where its description does: beyond that it is a discovery
    for name in ("position_delay", "spring_stiffening"):
        assert penalty(make_effect(name, "knee"), there) > 0.0
