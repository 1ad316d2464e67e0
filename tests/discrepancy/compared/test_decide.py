"""Two effects that one motion does not tell apart: another motion chooses, whichever was named first."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.judge import EQUALLY_GOOD, penalty
from sea_ident.discrepancy.bench.settle import Settled, settle
from sea_ident.discrepancy.compared.decide import _better, decide, simplest_first
from sea_ident.discrepancy.compared.heldout import Kind, tried
from sea_ident.discrepancy.compared.transfer import Transfer
from sea_ident.discrepancy.diagnose import _searched_beside, _tested
from sea_ident.discrepancy.result.findings import Alternative
from sea_ident.discrepancy.search.candidates import scan
from sea_ident.discrepancy.search.confirm import Confirmed
from sea_ident.discrepancy.search.edges import at_centre
from sea_ident.discrepancy.search.exchange import exchange
from sea_ident.discrepancy.search.refit import refitted
from sea_ident.discrepancy.search.search import Selection, next_effect
from sea_ident.discrepancy.trends.trend import TrendTest
from sea_ident.effects import make_effect
from sea_ident.effects.external_force import POINT

JOINT = "knee"


@pytest.fixture(scope="module")
def rivals(laboratory):
    """An offset in the spring of the knee, fitted by itself and by hysteresis, and another motion of the same leg."""
    planted = [("spring_offset", JOINT, [0.5], {})]
    bench = laboratory.bench(laboratory.record(planted, periods=10))
    other = Bench(laboratory.data(laboratory.record(planted, periods=10, seed=9, motion=1)), bench.effects)
    start = settle(bench, bench.effects)
    found = {c.effect.name: c for c in scan(bench, start.fit, start.noise) if c.effect.joint == JOINT}
    fits = {
        name: refitted(bench, start.fit.effects, found[name].effect, (), start.noise, start.fit.parameters)
        for name in ("spring_offset", "spring_hysteresis")
    }
    return bench, other, start, fits


def decided(rivals, own, alternative, *, dearer=False, behind=0.0):
    bench, other, start, fits = rivals
    position = len(start.fit.effects)
    selection = Selection(start, Settled(fits[own], start.noise), 1, (1e-9,))
    listed = {position: (Alternative(alternative, JOINT, 1.0, fits[alternative], dearer, behind),)}
    held = tried(other, selection, "another motion")
    selection, left, held = decide(bench, selection, listed, held)
    return selection.effects[0].name, [a.effect for a in left[position]], held


@pytest.mark.scenario
def test_what_holds_on_the_other_motion_is_taken(rivals):
    name, left, held = decided(rivals, "spring_hysteresis", "spring_offset")
    assert (name, left) == ("spring_offset", [])
    assert held.transfers[0].holds
    assert held.transfers[0].share > 0.9


@pytest.mark.scenario
def test_what_does_not_hold_on_the_other_motion_is_ruled_out(rivals):
    name, left, _ = decided(rivals, "spring_offset", "spring_hysteresis")
    assert (name, left) == ("spring_offset", [])


@pytest.mark.scenario
def test_what_does_the_same_on_the_other_motion_is_worth_the_same(rivals):
    """Friction of a spring that only holds it aside is an offset: each in its own noise floor, they seem 20 apart."""
    _, other, start, fits = rivals
    chosen = {name: Selection(start, Settled(fit, start.noise), 1, (1e-9,)) for name, fit in fits.items()}
    position = len(start.fit.effects)
    for own, rival in (("spring_offset", "spring_hysteresis"), ("spring_hysteresis", "spring_offset")):
        held = tried(other, chosen[own], "another motion")
        worth = held.worth(chosen[rival], position)
        assert abs(worth.statistic - held.transfers[0].statistic) < EQUALLY_GOOD
        assert held.worth(chosen[own], position).statistic == pytest.approx(held.transfers[0].statistic, abs=1e-6)


@pytest.mark.scenario
def test_what_takes_more_parameters_is_taken_where_the_other_motion_asks_for_it_only(rivals):
    assert decided(rivals, "spring_hysteresis", "spring_offset", dearer=True)[:2] == ("spring_offset", [])
    assert decided(rivals, "spring_offset", "spring_offset", dearer=True)[:2] == ("spring_offset", [])


@pytest.mark.scenario
@pytest.mark.parametrize(
    ("behind", "name", "left"),
    [
        (0.0, "spring_offset", []),
        (80.0, "spring_offset", []),
        (90.0, "spring_hysteresis", ["spring_offset"]),
        (110.0, "spring_hysteresis", ["spring_offset"]),
        (120.0, "spring_hysteresis", []),
    ],
)
@pytest.mark.parametrize("alike", [False, True])
def test_both_motions_together_decide_about_what_is_a_little_behind(rivals, behind, name, left, alike):
    """100 less on the other motion, and 13.8 tell two apart: the odds of one motion are worth those of the other."""
    bench, _, start, fits = rivals
    position = len(start.fit.effects)
    worth = {
        "spring_hysteresis": Transfer(0.9, True, 1200.0, 1.0, 120.0),
        "spring_offset": Transfer(1.0, True, 1100.0, 1.0, 20.0),
    }

    class There:
        """Another motion on which each is worth as much."""

        def __init__(self, selection):
            self.transfers = (self.worth(selection, position),)

        def worth(self, selection, position, beside=None):
            return worth[selection.final.fit.effects[position].name]

        def again(self, selection):
            return There(selection)

        def foretell_the_same(self, one, other):
            return alike

    if alike:  # then the other motion tells nothing, whatever a fit to it makes of either
        name, left = "spring_hysteresis", [] if behind else ["spring_offset"]
    own = Selection(start, Settled(fits["spring_hysteresis"], start.noise), 1, (1e-9,))
    listed = {position: (Alternative("spring_offset", JOINT, 1.0, fits["spring_offset"], behind=behind),)}
    selection, alternatives, _ = decide(bench, own, listed, There(own))
    assert (selection.effects[0].name, [a.effect for a in alternatives[position]]) == (name, left)
    assert all(a.as_likely for a in alternatives[position])


@pytest.mark.scenario
def test_what_holds_on_the_other_motion_has_nothing_to_fear_from_it(rivals):
    assert decided(rivals, "spring_offset", "spring_hysteresis", behind=20.0)[:2] == ("spring_offset", [])


@pytest.mark.scenario
def test_the_same_motion_again_decides_between_no_equals(rivals, laboratory, monkeypatch):
    """What one motion does not tell apart its repetition does not either, but by noise."""
    bench, _, start, fits = rivals
    position, planted = len(start.fit.effects), [("spring_offset", JOINT, [0.5], {})]
    selection = Selection(start, Settled(fits["spring_hysteresis"], start.noise), 1, (1e-9,))
    other = Alternative("spring_offset", JOINT, 1.0, fits["spring_offset"])
    monkeypatch.setitem(_tested.__globals__, "decide", lambda *_: pytest.fail("decided by the same motion"))
    confirmed = Confirmed(selection, bench, start, selection.final)
    again = laboratory.record(planted, periods=6, seed=9)
    listed = {position: (other, replace(other, dearer=True))}
    now, left, held, _ = _tested(bench, confirmed, listed, TrendTest(1.0, (), False), again)
    assert now is confirmed
    # what does as well by more parameters only is no alternative where no other motion asks for it
    assert left == {position: (other,)}
    assert held.kind is Kind.SAME_MOTION


@pytest.mark.scenario
@pytest.mark.parametrize("beyond", [True, False])
def test_what_the_library_lacks_is_given_no_other_name_by_another_motion(rivals, monkeypatch, beyond):
    """Whatever of its equals it is called, most stays unexplained: that the nearest does not hold changes nothing."""
    bench, _, start, fits = rivals
    position = len(start.fit.effects)
    selection = Selection(start, Settled(fits["spring_hysteresis"], start.noise), 1, (1e-9,))
    other = Alternative("spring_offset", JOINT, 1.0, fits["spring_offset"])
    there = SimpleNamespace(other_motion=True, transfers=(Transfer(0.0, True, 9e3, 1.0, 8e3),))
    weighed = []
    monkeypatch.setitem(_tested.__globals__, "held_out", lambda *_: (there, ()))
    monkeypatch.setitem(_tested.__globals__, "beyond_the_library", lambda *_: beyond)
    monkeypatch.setitem(_tested.__globals__, "decide", lambda *given: (weighed.append(True), *given[1:])[1:])
    confirmed = Confirmed(selection, bench, start, selection.final)
    listed = {position: (other, replace(other, behind=20.0))}
    now, left, _, _ = _tested(bench, confirmed, listed, TrendTest(1.0, (), False), None)
    assert now is confirmed
    assert left == ({position: (other,)} if beyond else listed)
    assert bool(weighed) is not beyond


@pytest.mark.scenario
def test_what_holds_there_as_well_stays_possible(rivals):
    name, left, _ = decided(rivals, "spring_offset", "spring_offset")
    assert (name, left) == ("spring_offset", ["spring_offset"])


@pytest.mark.scenario
@pytest.mark.parametrize("by_its_shape", [False, True])
def test_the_alternative_of_a_second_effect_is_weighed_beside_what_the_first_turned_out_to_be(
    laboratory, monkeypatch, by_its_shape
):
    """Both effects are named wrongly, and both alternatives are right: neither is judged beside the other's error.

    Whether the first gave way to an alternative or to another shape of its own.
    """
    planted = [("spring_offset", JOINT, [0.5], {}), ("load_dependent_friction", "hip", [0.1], {})]
    bench = laboratory.bench(laboratory.record(planted, periods=6))
    other = Bench(laboratory.data(laboratory.record(planted, periods=5, seed=9, motion=1)), bench.effects)
    start = settle(bench, bench.effects)
    found = {(c.effect.name, c.effect.joint): c.effect for c in scan(bench, start.fit, start.noise)}
    wrong = found["asymmetric_spring", JOINT], found["nonlinear_viscous_friction", "hip"]
    right = found["spring_offset", JOINT], found["load_dependent_friction", "hip"]

    def fitted(*added):
        return bench.refine(
            (*start.fit.effects, *added), start.noise, start=start.fit.parameters, only=len(bench.effects)
        )

    own = fitted(*wrong)
    first = len(start.fit.effects)
    listed = {
        first: (Alternative("spring_offset", JOINT, 1.0, fitted(right[0], wrong[1])),),
        first + 1: (Alternative("load_dependent_friction", "hip", 1.0, fitted(wrong[0], right[1])),),
    }
    selection = Selection(start, Settled(own, start.noise), 2, (1e-9, 1e-9))
    if by_its_shape:
        best, listed[first] = listed[first][0].fit, ()

        def shaped(bench, selection, held, position):
            if position != first:
                return selection, held
            other = replace(selection, final=Settled(best, selection.final.noise))
            return other, held.again(other)

        monkeypatch.setattr("sea_ident.discrepancy.compared.decide._with_its_best_shape", shaped)
    selection, left, _ = decide(bench, selection, listed, tried(other, selection, "another motion"))
    assert [e.name for e in selection.effects] == ["spring_offset", "load_dependent_friction"]
    assert left == {first: (), first + 1: ()}


@pytest.fixture(scope="module")
def constant_or_wave(laboratory):
    """A constant torque, and a wave in its place that takes up a little of what a tilted base leaves."""
    planted = [("torque_offset", JOINT, [2.0], {}), ("base_tilt", None, [0.0, -0.05], {})]
    bench = laboratory.bench(laboratory.record(planted))
    start = settle(bench, bench.effects)
    effects = make_effect("torque_offset", JOINT), make_effect("torque_ripple", JOINT, order=2.0)
    constant, wave = (
        refitted(bench, start.fit.effects, effect, (), start.noise, start.fit.parameters) for effect in effects
    )
    dearer = penalty(wave.effects[-1], bench) - penalty(effects[0], bench)
    assert dearer < constant.statistic - wave.statistic < wave.unit * dearer
    return bench, start, constant, wave


@pytest.mark.scenario
def test_what_another_effect_leaves_speaks_for_no_wave(constant_or_wave):
    bench, start, constant, wave = constant_or_wave
    selection = Selection(start, Settled(wave, start.noise), 1, (1e-9,))
    listed = {len(bench.effects): (Alternative("torque_offset", JOINT, 1.0, constant),)}
    assert simplest_first(bench, selection, listed)[0].effects[0].name == "torque_offset"


@pytest.mark.scenario
@pytest.mark.parametrize("first", ["torque_offset", "torque_ripple"])
def test_nor_in_a_search_whichever_is_tried_first(constant_or_wave, first):
    bench, start, *_ = constant_or_wave
    found = [c for c in scan(bench, start.fit, start.noise) if c.effect.joint == JOINT]
    pair = [c for c in found if c.effect.name in ("torque_offset", "torque_ripple")]
    pair.sort(key=lambda c: c.effect.name != first)
    fit, _ = next_effect(bench, start, pair, 1000, np.full(len(bench.data.equations), 1e-3))
    assert fit.effects[-1].name == "torque_offset"


@pytest.mark.scenario
def test_nor_in_an_exchange(constant_or_wave):
    bench, start, _, wave = constant_or_wave
    everything = {c.key for c in scan(bench, start.fit, start.noise)}
    ruled_out = everything - {("torque_offset", JOINT, "")}
    after = exchange(bench, Settled(wave, start.noise), 1, {}, ruled_out)
    assert after.fit.effects[-1].name == "torque_offset"


@pytest.mark.scenario
def test_what_is_ruled_out_takes_the_place_of_nothing(constant_or_wave):
    bench, start, _, wave = constant_or_wave
    now = Settled(wave, start.noise)
    assert exchange(bench, now, 1, {}, {c.key for c in scan(bench, start.fit, start.noise)}) is now


@pytest.mark.scenario
def test_what_is_in_the_model_is_no_alternative_to_another_part_of_it(rivals):
    bench, other, start, _ = rivals
    position = len(start.fit.effects)
    pair = make_effect("spring_offset", JOINT), make_effect("spring_hysteresis", JOINT)
    both, twice = (
        bench.fit((*start.fit.effects, pair[0], each), start.noise, start=start.fit.parameters)
        for each in (pair[1], pair[0])
    )
    selection = Selection(start, Settled(both, start.noise), 2, (1e-9, 1e-9))
    listed = {position + 1: (Alternative("spring_offset", JOINT, 1.0, twice),)}
    assert simplest_first(bench, selection, listed)[0] is selection
    held = tried(other, selection, "another motion")
    assert decide(bench, selection, listed, held)[:2] == (selection, {position + 1: ()})


@pytest.mark.scenario
def test_what_is_ruled_out_makes_room_for_what_it_stood_in_for(laboratory):
    """The wrong friction at the knee does not hold on the other motion: the search goes on beside what does."""
    planted = [("torque_ripple", "hip", [3.0, 1.5], {"order": 4.0}), ("load_dependent_friction", JOINT, [0.08], {})]
    bench = laboratory.bench(laboratory.record(planted, periods=10))
    start = settle(bench, bench.effects)
    found = {(c.effect.name, c.effect.joint): c.effect for c in scan(bench, start.fit, start.noise)}
    wrong = found["torque_ripple", "hip"], found["position_dependent_friction", JOINT]
    model = (*start.fit.effects, *wrong)
    fit = bench.refine(model, start.noise, start=start.fit.parameters, only=len(bench.effects))
    selection = Selection(start, Settled(fit, start.noise), 2, (1e-9, 1e-9))
    confirmed = Confirmed(selection, bench, start, selection.final)
    again = laboratory.record(planted, periods=8, seed=9, motion=1)
    now, _, held, _ = _tested(bench, confirmed, {}, TrendTest(1.0, (), False), again)
    named = {(effect.name, effect.joint) for effect in now.selection.effects}
    assert named == {("torque_ripple", "hip"), ("load_dependent_friction", JOINT)}
    assert all(transfer.holds for transfer in held.transfers)
    assert now.final.fit.statistic < 1.2 * now.final.fit.dof


@pytest.mark.scenario
def test_where_little_holds_nothing_is_searched_beside_it(laboratory, monkeypatch):
    """A library that lacks what is there has always something else to offer."""
    planted = [("torque_ripple", "hip", [0.3, 0.1], {"order": 4.0}), ("load_dependent_friction", JOINT, [0.15], {})]
    bench = laboratory.bench(laboratory.record(planted))
    start = settle(bench, bench.effects)
    ripple = make_effect("torque_ripple", "hip", order=4.0)
    fit = refitted(bench, start.fit.effects, ripple, (), start.noise, start.fit.parameters)
    monkeypatch.setitem(_searched_beside.__globals__, "search", lambda *_: pytest.fail("searched"))
    assert _searched_beside(bench, Selection(start, Settled(fit, start.noise), 1, (1e-9,)), set()) is None
    assert _searched_beside(bench, Selection(start, start, 0, ()), set()) is None


def test_what_neither_explains_leans_to_none():
    """Where much is left on the other motion, a difference that is small beside that decides nothing."""
    leaning = 27.0
    worse = Transfer(share=0.95, tested=True, statistic=1700.0 + leaning, unit=1.1, excess=leaning)
    better = Transfer(share=0.95, tested=True, statistic=1700.0, unit=1.1, excess=0.0)
    assert _better(better, worse)
    assert not _better(worse, better)
    left = 4000.0
    both = [replace(t, statistic=t.statistic + left, excess=t.excess + left) for t in (better, worse)]
    assert not _better(*both)
    assert _better(both[0], replace(both[1], statistic=both[1].statistic + 0.2 * left))


def test_what_the_first_motion_hardly_told_decides_nothing_on_another():
    """Both the better one beyond doubt, and the one that foretells what the other only fits."""
    better = Transfer(share=0.99, tested=True, statistic=1055.0, excess=12.0)
    worse = Transfer(share=0.99, tested=True, statistic=1082.0, excess=39.0)
    unsure = replace(worse, by_chance=26.0)
    assert _better(better, worse)
    assert not _better(better, unsure)
    assert not _better(unsure, better)
    remembers = replace(better, remembers=True)
    assert not _better(worse, remembers)
    assert _better(unsure, remembers)


@pytest.fixture(scope="module")
def pushed(laboratory):
    """A push away from the centre of mass of the shank, found, and another motion of the same leg."""
    push = make_effect("external_force", JOINT, start=1.2, stop=1.9, period=5.0)
    planted = [(replace(push, point_z=0.1), np.array([8.0, 0.0, 4.0]))]
    bench = laboratory.bench(laboratory.record(planted, periods=6))
    other = Bench(laboratory.data(laboratory.record(planted, periods=6, seed=9, motion=1)), bench.effects)
    start = settle(bench, bench.effects)
    fit = refitted(bench, start.fit.effects, push, (), start.noise, start.fit.parameters)
    selection = Selection(start, Settled(fit, start.noise), 1, (1e-9,))
    return bench, selection, tried(other, selection, "another motion")


@pytest.mark.scenario
@pytest.mark.parametrize(("beyond_doubt", "on_the_centre"), [(1.1, True), (0.9, False)])
def test_a_push_is_on_the_centre_of_mass_where_both_motions_together_say_so(
    pushed, monkeypatch, beyond_doubt, on_the_centre
):
    """Its point bends to whatever else is missing: another motion weighs as much as this one."""
    bench, selection, held = pushed
    fit, noise, position = selection.final.fit, selection.final.noise, len(selection.start.fit.effects)
    behind = at_centre(bench, fit, noise, position).statistic - fit.statistic
    assert behind > 0.0
    own = replace(held.transfers[0], statistic=2.0 * behind, excess=20.0)
    there = replace(own, statistic=own.statistic - behind - beyond_doubt * own.margin)
    held = replace(held, transfers=(own,))
    monkeypatch.setattr(type(held), "worth", lambda *_: there)
    monkeypatch.setattr(type(held), "again", lambda held, _: replace(held, transfers=(there,)))
    found, _, held = decide(bench, selection, {position: ()}, held)
    assert any(getattr(found.effects[0], name) for name in POINT) is not on_the_centre
    assert (held.transfers[0] is there) is on_the_centre


@pytest.mark.scenario
def test_a_push_stays_where_both_motions_show_it(pushed):
    bench, selection, held = pushed
    found, _, after = decide(bench, selection, {len(selection.start.fit.effects): ()}, held)
    assert found is selection
    assert after is held
    assert found.effects[0].point_z == pytest.approx(0.1, abs=0.01)
