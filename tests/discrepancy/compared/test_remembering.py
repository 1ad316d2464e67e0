"""A constant in a spring that another motion does not confirm: dry friction that does not slip remembers it."""

from dataclasses import replace

import numpy as np
import pytest

from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.judge import EQUALLY_GOOD
from sea_ident.discrepancy.bench.settle import Settled, settle
from sea_ident.discrepancy.compared.decide import decide
from sea_ident.discrepancy.compared.heldout import tried
from sea_ident.discrepancy.compared.remembering import CONFIRMED, remembering
from sea_ident.discrepancy.diagnose import _tested
from sea_ident.discrepancy.evidence.named import named_effects
from sea_ident.discrepancy.search.confirm import Confirmed
from sea_ident.discrepancy.search.search import Selection
from sea_ident.discrepancy.trends.trend import TrendTest
from sea_ident.effects import effect_classes, make_effect

JOINT = "knee"
HERE = -0.5


@pytest.fixture(scope="module")
def offset(laboratory):
    """A constant torque in the spring of the knee, found."""
    bench = laboratory.bench(laboratory.record([("spring_offset", JOINT, [HERE], {})], periods=12))
    start = settle(bench, bench.effects)
    model = (*start.fit.effects, make_effect("spring_offset", JOINT))
    fit = bench.fit(model, start.noise, start=start.fit.parameters)
    noise = bench.noise(fit)
    return bench, Selection(start, Settled(bench.fit(model, noise, start=fit.parameters), noise), 1, (1e-9,))


@pytest.mark.scenario
@pytest.mark.parametrize(
    ("there", "name"),
    [
        (HERE, "spring_offset"),
        pytest.param(1.02 * HERE, "spring_offset", marks=pytest.mark.slow),
        (0.4 * HERE, "spring_hysteresis"),
    ],
)
def test_another_constant_in_another_motion_is_none(laboratory, offset, there, name):
    """And that the other motion told it is said, for it is then no test of it any more."""
    bench, selection = offset
    recording = laboratory.record([("spring_offset", JOINT, [there], {})], periods=8, seed=9, motion=1)
    confirmed = Confirmed(selection, bench, selection.start, selection.final)
    position = len(selection.start.fit.effects)
    now, left, held, notes = _tested(bench, confirmed, {position: ()}, TrendTest(1.0, (), False), recording)
    found = now.selection
    assert [effect.name for effect in found.effects] == [name]
    assert left[position] == ()
    assert held.transfers[0].holds
    assert held.transfers[0].remembers == (name == "spring_hysteresis")
    assert [note for note in notes if "third" in note and JOINT in note] == list(notes)
    assert bool(notes) == (name == "spring_hysteresis")
    if name == "spring_hysteresis":
        # it never slips on the motion that was used
        travel = bench.data.motion.deflection[:, bench.robot.index(JOINT)]
        assert 2.0 * found.effects[0].slip > travel.max() - travel.min()
        # so nothing but its rest tells it from the stiffness: how large it is is not known
        (told,) = named_effects(bench, found, {}, held)
        assert [p.std >= abs(p.value) for p in told.parameters if p.unit == "N m"] == [True, True]


@pytest.mark.scenario
def test_a_library_without_dry_friction_in_springs_names_none(laboratory, offset, monkeypatch):
    bench, selection = offset
    planted = [("spring_offset", JOINT, [0.4 * HERE], {})]
    other = laboratory.bench(laboratory.record(planted, periods=8, seed=9, motion=1))
    held, position = tried(other, selection, "another motion"), len(selection.start.fit.effects)
    assert remembering(bench, selection, held, position).effect == "spring_hysteresis"
    less = {name: kind for name, kind in effect_classes().items() if name != "spring_hysteresis"}
    monkeypatch.setattr("sea_ident.discrepancy.compared.remembering.effect_classes", lambda: less)
    assert remembering(bench, selection, held, position) is None


@pytest.mark.scenario
@pytest.mark.parametrize("amounts", [[1.0, 3.0], [2.0, 1.0]])
def test_an_element_that_slips_on_the_other_motion_alone_is_found_by_it(laboratory, amounts):
    """The constant is the same on both, and what tells is left on the other motion while it slips."""
    slip = 0.0114
    planted = [("spring_hysteresis", JOINT, amounts, {"slip": slip})]
    used, other = (laboratory.bench(laboratory.record(planted, periods=8, motion=m)) for m in (1, 0))
    travel = [np.ptp(bench.data.motion.deflection[:, bench.robot.index(JOINT)]) for bench in (used, other)]
    assert travel[0] < 2.0 * slip < travel[1]
    start = settle(used, used.effects)
    now = settle(used, (*used.effects, make_effect("spring_offset", JOINT)))
    # nothing is missing on the motion that was used
    assert now.fit.statistic < 1.2 * now.fit.dof
    selection = Selection(start, now, 1, (1e-9,))
    held = tried(other, selection, "another motion")
    before = held.transfers[0]
    assert before.excess > EQUALLY_GOOD * before.unit
    found, left, held = decide(used, selection, {len(start.fit.effects): ()}, held)
    (effect,) = found.effects
    assert effect.name == "spring_hysteresis"
    assert effect.slip == pytest.approx(slip, rel=0.02)
    assert left[len(start.fit.effects)] == ()
    assert held.transfers[0].excess < 0.1 * before.excess


@pytest.mark.scenario
def test_what_else_is_missing_on_the_other_motion_is_no_reason_for_such_an_element(laboratory, offset):
    """The constant is the same there, and hardly anything of what is left would be explained."""
    bench, selection = offset
    ripple = ("torque_ripple", JOINT, [0.3, 0.1], {"order": 5.0})
    recording = laboratory.record([("spring_offset", JOINT, [HERE], {}), ripple], periods=8, seed=9, motion=1)
    held = tried(Bench(laboratory.data(recording), bench.effects), selection, "another motion")
    (found,) = held.transfers
    assert found.excess > EQUALLY_GOOD * found.unit
    assert found.tested
    assert found.share > CONFIRMED
    assert remembering(bench, selection, held, len(selection.start.fit.effects)) is None


@pytest.mark.scenario
@pytest.mark.parametrize(("left", "taken"), [(75.0, False), (65.0, True)])
def test_such_an_element_explains_most_of_what_the_constant_fails_to(laboratory, offset, monkeypatch, left, taken):
    """Of 1000 it explains 900, and 120 are left: 100 are the most that the element could be the reason for."""
    bench, selection = offset
    other = laboratory.bench(laboratory.record([("spring_offset", JOINT, [HERE], {})], periods=8, seed=9, motion=1))
    held = tried(other, selection, "another motion")
    found = replace(held.transfers[0], tested=True, share=0.9, possible=1000.0, excess=120.0)
    held = replace(held, transfers=(found,))
    monkeypatch.setattr(type(held), "worth", lambda *_: replace(found, excess=left))
    element = remembering(bench, selection, held, len(selection.start.fit.effects))
    assert (element is not None) is taken
