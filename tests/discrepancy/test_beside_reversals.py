"""Friction that acts beside reversals only is found there or not, as large as was said that it would have to be."""

from dataclasses import replace

import numpy as np
import pytest

from sea_ident.discrepancy import beside_reversals
from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.judge import EQUALLY_GOOD
from sea_ident.discrepancy.bench.lack import lack_of_fit
from sea_ident.discrepancy.bench.settle import settle
from sea_ident.discrepancy.beside_reversals import friction_of_the_slow, searched_beside_reversals
from sea_ident.discrepancy.compared.heldout import held_out
from sea_ident.discrepancy.evidence.assess import detectability
from sea_ident.discrepancy.measured.data import away_from_reversals
from sea_ident.discrepancy.measured.standing import BESIDE_REVERSALS, compared_beside_reversals
from sea_ident.discrepancy.search.candidates import scan
from sea_ident.discrepancy.search.confirm import FAR, Confirmed, confirm
from sea_ident.discrepancy.search.search import Selection, search
from sea_ident.effects import make_effect
from sea_ident.simulation import FrictionJitter, SmoothCoulomb

SIZE, SPEED, EXPONENT = 1.2, 0.03, 1.0
"""Friction of the knee that is gone where what a search compares begins."""


def with_friction(data, size, speed, exponent):
    """The same passes with more friction of the knee where it is slow: what a sensor of that torque would have seen."""
    knee = data.robot.index("knee")
    speeds = np.stack([motion.dtheta[:, knee] for motion in data.period_motions])
    more = size * np.tanh(speeds / 0.002) * np.exp(-(np.abs(speeds / speed) ** exponent))
    torque, mean = data.period_tau_motor.copy(), data.tau_motor.copy()
    torque[:, :, knee] += more
    mean[:, knee] += more.mean(axis=0)
    return replace(data, period_tau_motor=torque, tau_motor=mean)


def named(selection):
    return [(effect.name, effect.joint) for effect in selection.effects]


def unsearched(bench):
    """What was found: nothing."""
    start = settle(bench, bench.effects)
    return confirm(bench, Selection(start, start, 0, ()))


@pytest.fixture(scope="module")
def sticking(jittery, laboratory):
    """A knee whose friction is larger where it turns, on the bench that shows it, and what was found."""
    bench = Bench(with_friction(jittery, SIZE, SPEED, EXPONENT), laboratory.effects)
    return bench, searched_beside_reversals(bench, unsearched(bench))


@pytest.fixture(scope="module")
def least(jittery, laboratory):
    """What could be seen of Stribeck friction of the knee where nothing is missing."""
    bench = Bench(jittery, laboratory.effects)
    same, confirmed = searched_beside_reversals(bench, unsearched(bench))
    assert same is bench
    assert confirmed.selection.added == 0
    start = confirmed.selection.start
    found = detectability(bench, start.fit, start.noise, scan(bench, start.fit, start.noise), confirmed.beside)
    return next(d for d in found if (d.effect, d.joint) == ("stribeck_friction", "knee"))


@pytest.mark.scenario
@pytest.mark.parametrize(("late", "seen"), [(False, []), (True, [("stribeck_friction", "knee")])])
def test_a_search_sees_what_acts_beside_reversals_only_by_what_lets_go_late(sticking, monkeypatch, late, seen):
    bench, _ = sticking
    if not late:
        for module in ("next_effect", "confirm"):
            monkeypatch.setattr(f"sea_ident.discrepancy.search.{module}.lets_go_late", lambda *_: False)
    assert named(confirm(bench, search(bench, bench.effects)).selection) == seen


@pytest.mark.scenario
def test_the_samples_beside_reversals_show_it(sticking):
    bench, (near, confirmed) = sticking
    assert named(confirmed.selection) == [("stribeck_friction", "knee")]
    assert confirmed.selection.p_values[0] < 1e-6
    assert near is confirmed.bench is confirmed.beside[0]
    assert near.data.caution == BESIDE_REVERSALS
    assert np.mean(near.data.left_out) < np.mean(bench.data.left_out)
    fit = confirmed.final.fit
    effect, size = fit.effects[-1], fit.parameters["knee.stribeck_friction"]
    for speed in (0.02, 0.04):
        truth = SIZE * np.exp(-((speed / SPEED) ** EXPONENT))
        assert size * np.exp(-((speed / effect.speed) ** effect.exponent)) == pytest.approx(truth, rel=0.2)


@pytest.mark.scenario
@pytest.mark.parametrize("short", [True, False])
def test_what_became_too_short_in_its_own_noise_floor_is_not_added(sticking, monkeypatch, short):
    bench, _ = sticking
    module = "sea_ident.discrepancy.beside_reversals"
    monkeypatch.setattr(f"{module}._let_go_late", lambda near, now, most: (now, []))
    monkeypatch.setattr(f"{module}.too_short", lambda bench, effect: short)
    found = searched_beside_reversals(bench, unsearched(bench))[1].selection
    assert named(found) == ([] if short else [("stribeck_friction", "knee")])


@pytest.mark.scenario
def test_what_only_the_slow_samples_show_is_found_once_the_rest_is_explained(
    sticking, jittery, laboratory, monkeypatch
):
    bench, (near, _) = sticking

    def without_the_slow(bench):
        far = bench.comparing(away_from_reversals(bench.data, FAR))
        start = settle(far, far.effects)
        return Confirmed(Selection(start, start, 0, ()), far, start, start)

    found = friction_of_the_slow(bench, without_the_slow(bench))
    assert found is not None
    assert named(found[1].selection) == [("stribeck_friction", "knee")]
    np.testing.assert_array_equal(found[0].data.left_out, near.data.left_out)
    # what only the usual samples need is found there and nowhere else
    quiet = Bench(jittery, laboratory.effects)
    assert friction_of_the_slow(quiet, without_the_slow(quiet)) is None
    # and what leaves much there is not what made them differ
    monkeypatch.setattr(beside_reversals, "lack_of_fit", lambda bench, now: (*lack_of_fit(bench, now)[:2], 0.0))
    assert friction_of_the_slow(bench, without_the_slow(bench)) is None


@pytest.mark.scenario
def test_another_motion_is_compared_beside_its_reversals_too(sticking, laboratory):
    _, (near, confirmed) = sticking
    held, _ = held_out(near, confirmed.selection, laboratory.record(periods=2, motion=1))
    assert held.other_motion
    assert held.bench.data.caution == BESIDE_REVERSALS


@pytest.mark.scenario
@pytest.mark.parametrize(("possible", "first"), [(True, True), (True, False), (False, True)])
def test_a_start_of_sliding_that_a_search_did_not_see_is_no_friction_more(laboratory, monkeypatch, possible, first):
    """Its speed was left so low that no sample is slower: no step leads back, and none may be possible beside it.

    Whether the joint promises most or only comes out best.
    """
    if not possible:
        monkeypatch.setattr(beside_reversals, "next_effect", lambda *_: None)
    if not first:
        monkeypatch.setattr(
            beside_reversals, "scan", lambda *given: sorted(scan(*given), key=lambda c: c.effect.joint == "ankle")
        )
    speed = 0.01
    recording = laboratory.record(periods=12, jitter=FrictionJitter(0.02, 0.05), friction=SmoothCoulomb(speed))
    low = make_effect("coulomb_friction", "ankle", smoothing=1e-4)
    bench = laboratory.bench(
        recording, [low if e.name == low.name and e.joint == low.joint else e for e in laboratory.effects]
    )
    _, confirmed = searched_beside_reversals(bench, unsearched(bench))
    assert named(confirmed.selection) == []
    (own,) = (e for e in confirmed.beside[1].fit.effects if e.name == low.name and e.joint == low.joint)
    assert own.smoothing == pytest.approx(speed, rel=0.2)


def test_fewer_than_ten_periods_are_not_looked_at(nothing_missing):
    bench, start = nothing_missing
    confirmed = confirm(bench, Selection(start, start, 0, ()))
    assert searched_beside_reversals(bench, confirmed) == (bench, confirmed)
    assert confirmed.beside is None


@pytest.mark.scenario
def test_what_is_said_to_be_the_smallest_belongs_to_a_shape(least):
    assert least.shapes == (("speed", 0.1, "rad/s"), ("exponent", 2.0, "-"))


@pytest.mark.scenario
@pytest.mark.parametrize(("times", "seen"), [(0.4, []), (2.0, [("stribeck_friction", "knee")])])
def test_friction_smaller_than_the_smallest_is_not_seen_and_larger_is(jittery, laboratory, least, times, seen):
    shapes = (value for _, value, _ in least.shapes)
    bench = Bench(with_friction(jittery, times * least.smallest, *shapes), laboratory.effects)
    _, confirmed = searched_beside_reversals(bench, confirm(bench, search(bench, bench.effects)))
    assert named(confirmed.selection) == seen


@pytest.mark.scenario
@pytest.mark.parametrize(("late", "seen"), [(1.0, []), (1e-12, [("stribeck_friction", "knee")])])
def test_where_what_is_left_may_be_chance_nothing_is_looked_for_but_in_the_passes(sticking, monkeypatch, late, seen):
    bench, _ = sticking
    monkeypatch.setattr(beside_reversals, "breakaway_p", lambda *asked: late if asked[-1] == "knee" else 1.0)
    monkeypatch.setattr("sea_ident.discrepancy.beside_reversals.lack_of_fit", lambda *_: (1.0, 1, 2e-3))
    same, confirmed = searched_beside_reversals(bench, unsearched(bench))
    assert (same is bench) == (not seen)
    assert named(confirmed.selection) == seen


@pytest.mark.scenario
def test_what_lets_a_motor_go_late_is_stiction_where_the_mean_shows_a_trace_of_it(laboratory, monkeypatch):
    """By the passes, not by the mean: and only where the mean does not speak against it."""
    late = {"knee": 1e-12}
    monkeypatch.setattr(beside_reversals, "breakaway_p", lambda near, fit, joint: late.get(joint, 1.0))
    planted = [("stribeck_friction", "knee", [0.3], {"speed": 0.05})]
    bench = laboratory.bench(laboratory.record(planted))
    near = bench.comparing(compared_beside_reversals(bench.data))
    start = settle(near, near.effects)
    found, added = beside_reversals._let_go_late(near, start, 1)
    assert added == [1e-12]
    assert [(e.name, e.joint) for e in found.fit.effects[len(near.effects) :]] == [("stribeck_friction", "knee")]
    assert start.fit.statistic - found.fit.statistic > EQUALLY_GOOD
    with monkeypatch.context() as patch:
        patch.setattr(beside_reversals, "EQUALLY_GOOD", 1e3 * EQUALLY_GOOD)
        assert beside_reversals._let_go_late(near, start, 1) == (start, [])
    with monkeypatch.context() as patch:
        patch.setattr(beside_reversals, "physical", lambda *_: False)
        assert beside_reversals._let_go_late(near, start, 1) == (start, [])
    assert beside_reversals._let_go_late(near, start, 0) == (start, [])
    late.clear()
    assert beside_reversals._let_go_late(near, start, 1) == (start, [])


@pytest.mark.scenario
@pytest.mark.parametrize(("share", "seen"), [(0.5, [("stribeck_friction", "knee")]), (0.99, [])])
def test_friction_explains_most_of_what_is_left_beside_reversals_or_is_none(sticking, monkeypatch, share, seen):
    """The corner that a speed within the band misses is left there too, and some friction explains a part of it."""
    bench, _ = sticking
    monkeypatch.setattr(beside_reversals, "breakaway_p", lambda *_: 1.0)
    monkeypatch.setattr(beside_reversals, "MOST_OF_IT", share)
    _, confirmed = searched_beside_reversals(bench, unsearched(bench))
    assert named(confirmed.selection) == seen
