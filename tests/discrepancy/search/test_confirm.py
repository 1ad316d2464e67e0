"""What only the samples near reversals speak for is dropped, what holds elsewhere stays."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from sea_ident.discrepancy.bench.columns import effect_key
from sea_ident.discrepancy.bench.judge import SMALLEST_SHARE, significance, torque_change
from sea_ident.discrepancy.bench.settle import Settled, settle, settle_again
from sea_ident.discrepancy.measured.data import (
    BARELY_SEEN,
    MOST_LEFT_OUT,
    around_reversals,
    away_from_reversals,
)
from sea_ident.discrepancy.search.candidates import scan
from sea_ident.discrepancy.search.confirm import Confirmed, _begun, confirm, without_the_slow
from sea_ident.discrepancy.search.exchange import Outdone
from sea_ident.discrepancy.search.next_effect import FAMILY_LEVEL
from sea_ident.discrepancy.search.search import MOST_EFFECTS, Selection, search, without
from sea_ident.effects import make_effect
from sea_ident.simulation import FrictionJitter

RIPPLE = make_effect("torque_ripple", "hip", order=4.0)
AT_REVERSALS = make_effect("stribeck_friction", "knee", speed=0.05, exponent=2.0)


def selected(bench, effects):
    """A selection made by hand: the model, and the model with some effects more."""
    start = settle(bench, bench.effects)
    fit = bench.fit((*start.fit.effects, *effects), start.noise, start=start.fit.parameters)
    now = Settled(fit, bench.noise(fit))
    now = Settled(bench.fit(fit.effects, now.noise, start=fit.parameters), now.noise)
    candidates = tuple(scan(bench, now.fit, now.noise))
    p_values = tuple(1e-10 * (k + 1) for k in range(len(effects)))
    return Selection(start, now, len(effects), p_values, candidates, 100)


@pytest.fixture(scope="module")
def both(laboratory):
    """A ripple everywhere, and friction that is larger at the knee just where it turns."""
    planted = [
        ("torque_ripple", "hip", [1.0, 0.5], {"order": 4.0}),
        ("stribeck_friction", "knee", [1.5], {"speed": 0.03}),
    ]
    bench = laboratory.bench(laboratory.record(planted))
    return bench, selected(bench, [AT_REVERSALS, RIPPLE])


@pytest.mark.scenario
def test_before_confirmation_both_seem_to_be_there(both):
    bench, selection = both
    fit = selection.final.fit
    for position in (-2, -1):
        others = [e for e in fit.effects if e is not fit.effects[position]]
        less = bench.fit(others, selection.final.noise, start=fit.parameters)
        assert less.statistic - fit.statistic > 50.0


@pytest.mark.scenario
@pytest.mark.parametrize(
    ("name", "joint", "values", "shape"),
    [
        ("torque_ripple", "ankle", [1.0, 0.5], {"order": 12.0}),
        ("motor_encoder_offset", "knee", [], {"offset": -0.03}),
    ],
)
def test_what_explains_all_is_not_held_against_a_floor_that_is_not_its_own(small_motions, name, joint, values, shape):
    """Where half of the samples are left out: the ripple was not in the library, the zero made a recording wrong."""
    bench = small_motions.bench(small_motions.record([(name, joint, values, shape)], periods=10))
    effects = (*bench.effects, make_effect(name, joint, **shape))
    start, fit = settle(bench, bench.effects), bench.fit(effects, None, tangents=False)
    selection = Selection(start, settle_again(bench, settle_again(bench, fit).fit), 1, (0.0,))
    assert selection.final.fit.statistic < 1.3 * selection.final.fit.dof
    found = confirm(bench, selection)
    assert [(e.name, e.joint) for e in found.selection.effects] == [(name, joint)]
    assert found.final.fit.statistic < 1.3 * found.final.fit.dof
    assert settle_again(found.bench, selection.final.fit).fit.statistic > 1.8 * found.final.fit.dof
    assert found.less(selection).final.fit.statistic < 1.3 * found.final.fit.dof


@pytest.mark.scenario
def test_what_is_seen_only_near_reversals_is_dropped(both):
    bench, selection = both
    found = confirm(bench, selection)
    assert [effect_key(e)[:2] for e in found.selection.effects] == [("torque_ripple", "hip")]
    assert found.selection.p_values == (2e-10,)
    # the model there is the one with what is left
    assert [e.name for e in found.final.fit.effects[-1:]] == ["torque_ripple"]
    assert found.bench.data.caution == 2
    assert found.bench.data.alike == BARELY_SEEN


@pytest.mark.scenario
def test_what_does_not_stand_out_of_the_scatter_of_the_passes_is_dropped(laboratory):
    """Friction that differs from pass to pass far beyond the samples that are left out: the mean of twelve shows it."""
    recording = laboratory.record([], periods=12, seed=1, jitter=FrictionJitter(spread=1.0, speed=0.3))
    bench = laboratory.bench(recording)
    friction = make_effect("nonlinear_viscous_friction", "ankle", exponent=0.4)
    selection = replace(selected(bench, [friction]), tests=1)
    found = confirm(bench, selection)
    assert found.selection.added == 0
    # nothing else speaks against it: it is beyond the noise floor, and large enough
    with_it = settle_again(found.bench, selection.final.fit)
    fit = with_it.fit
    less = found.bench.refine(fit.effects[:-1], with_it.noise, start=fit.parameters, only=len(bench.effects))
    assert significance(less.statistic - fit.statistic, 1, 1, less, with_it.noise) < 0.1 * FAMILY_LEVEL
    assert torque_change(found.bench, fit, less) > 2.0 * SMALLEST_SHARE


@pytest.mark.scenario
def test_the_best_of_several_motors_stands_out_of_the_scatter_by_more_than_one_that_was_asked_for(laboratory):
    """By chance alone one of three does so three times as often."""
    friction = make_effect("nonlinear_viscous_friction", "ankle", exponent=0.4)
    planted, jitter = [("nonlinear_viscous_friction", "ankle", [0.4], {"exponent": 0.4})], FrictionJitter(0.3, 0.3)
    bench = laboratory.bench(laboratory.record(planted, periods=12, seed=1, jitter=jitter))
    selection = replace(selected(bench, [friction]), tests=1)
    assert confirm(bench, replace(selection, candidates=())).selection.added == 1
    assert confirm(bench, selection).selection.added == 0


def test_what_holds_elsewhere_stays_with_its_size(rippled):
    bench, start, with_it = rippled
    found = confirm(bench, Selection(start, with_it, 1, (1e-9,)))
    assert found.selection.p_values == (1e-9,)
    parameters = found.final.fit.parameters
    assert parameters["hip.torque_ripple_sine"] == pytest.approx(1.0, abs=0.1)
    assert parameters["hip.torque_ripple_cosine"] == pytest.approx(0.5, abs=0.1)
    assert found.final.fit.statistic / found.final.fit.dof == pytest.approx(1.0, abs=0.2)
    assert found.start.fit.statistic / found.start.fit.dof > 3.0


@pytest.mark.scenario
@pytest.mark.parametrize("hidden", [False, True])
def test_what_hardly_shows_elsewhere_stays_where_another_takes_it_up(rippled, monkeypatch, hidden):
    bench, *_ = rippled
    selection = selected(bench, [RIPPLE])
    monkeypatch.setattr("sea_ident.discrepancy.search.confirm.torque_change", lambda *args: 0.0)
    monkeypatch.setattr("sea_ident.discrepancy.search.confirm.taken_up", lambda *args: hidden)
    assert confirm(bench, selection).selection.added == (selection.added if hidden else 0)


def test_more_is_left_out_around_reversals(rippled):
    data = rippled[0].data
    away = away_from_reversals(data)
    assert np.all(away.left_out[data.left_out])
    assert np.mean(away.left_out) > 1.3 * np.mean(data.left_out)
    for e, equation in enumerate(data.equations):
        speed = data.motion.dq if str(equation.kind) == "link" else data.motion.dtheta
        turns = np.flatnonzero(np.diff(np.sign(speed[:, equation.index])))
        for turn in turns:
            # four samples before the turn and four after it
            assert np.all(away.left_out[np.arange(turn - 3, turn + 5) % data.samples, e])
    alone = around_reversals(data.motion, data.equations)
    assert np.all(data.left_out[alone])


@pytest.mark.scenario
def test_without_removes_what_is_weak_and_fits_the_rest_anew(both):
    bench, _ = both
    extra = selected(bench, [AT_REVERSALS, RIPPLE, make_effect("torque_offset", "ankle")])
    left = without(bench, extra, [0, 2])
    assert [effect_key(e)[:2] for e in left.effects] == [("torque_ripple", "hip")]
    assert left.added == 1
    assert left.p_values == (2e-10,)
    assert left.start is extra.start
    names = {column.name for column in left.final.fit.columns}
    assert "hip.torque_ripple_sine" in names
    assert not names & {"knee.stribeck_friction", "ankle.torque_offset"}
    # a minimum of its own: fitting again from the description changes nothing
    again = bench.fit(left.final.fit.effects, left.final.noise)
    assert again.statistic == pytest.approx(left.final.fit.statistic, rel=1e-4)
    # what was taken out can be found again
    assert ("stribeck_friction", "knee") in {c.key[:2] for c in left.candidates}


@pytest.mark.scenario
def test_without_everything_is_the_start(both):
    bench, selection = both
    left = without(bench, selection, [0, 1])
    assert left.effects == ()
    assert [effect_key(e) for e in left.final.fit.effects] == [effect_key(e) for e in selection.start.fit.effects]
    assert left.final.fit.statistic / left.final.fit.dof == pytest.approx(
        selection.start.fit.statistic / selection.start.fit.dof, rel=0.05
    )


def test_a_search_with_fewer_samples_begins_with_what_was_taken_out_where_that_explains_it(rippled):
    bench, start, right = rippled
    found = Selection(start, start, 0, ())
    whole = Selection(start, right, 1, (1e-9,))
    taken_out = Confirmed(replace(found, whole=whole), bench, start, start)
    assert _begun(bench, taken_out, start) is whole
    # nothing was found, and nothing taken out
    assert _begun(bench, Confirmed(found, bench, start, start), start) is None
    assert _begun(bench, Confirmed(replace(found, whole=found), bench, start, start), start) is None
    # nothing more could be found beside that many
    full = replace(found, whole=replace(whole, added=MOST_EFFECTS))
    assert _begun(bench, Confirmed(full, bench, start, start), start) is None


def test_a_search_with_fewer_samples_knows_nothing_of_what_was_outdone_among_the_others(rippled, monkeypatch):
    bench, start, right = rippled
    outdone = {(("torque_ripple", "hip"), ("torque_offset", "hip")): Outdone(0.5, 0.1)}
    found = Selection(start, right, 1, (1e-9,), tried=outdone)
    begun = []

    def searched(far, effects, before):
        begun.append(before)
        return Selection(start, start, 0, ())

    monkeypatch.setattr("sea_ident.discrepancy.search.confirm._begun", lambda *_: found)
    monkeypatch.setattr("sea_ident.discrepancy.search.confirm.search", searched)
    monkeypatch.setattr(
        "sea_ident.discrepancy.search.confirm.scan", lambda far, fit, noise: [SimpleNamespace(gain=np.inf)]
    )
    assert without_the_slow(bench, Confirmed(found, bench, start, right)) is None
    (before,) = begun
    assert before.final is right
    assert before.tried == {}
    assert found.tried == outdone


def test_what_explains_little_of_the_rest_is_not_begun_with(rippled):
    bench, start, right = rippled
    useless = make_effect("torque_offset", "knee")
    other = Settled(bench.fit((*start.fit.effects, useless), start.noise, start=start.fit.parameters), start.noise)
    selection = Selection(start, start, 0, (), whole=Selection(start, other, 1, (1e-9,)))
    assert _begun(bench, Confirmed(selection, bench, start, start), start) is None
    # beside what explains nearly all it is left out again
    found = Selection(start, right, 1, (1e-9,))
    more = bench.fit((*right.fit.effects, useless), right.noise, start=right.fit.parameters)
    kept = replace(found, whole=Selection(start, Settled(more, right.noise), 2, (1e-9, 1e-9)))
    assert _begun(bench, Confirmed(kept, bench, start, right), right) is kept


def test_a_search_tells_what_it_had_before_it_took_anything_out(rippled, monkeypatch):
    bench, start, right = rippled
    begun = Selection(start, right, 1, (1e-9,))
    taken = []

    def none_left(bench, now, added, tests, fewest=1):
        taken.append(now)
        return start, []

    monkeypatch.setattr("sea_ident.discrepancy.search.search.eliminate", none_left)
    found = search(bench, bench.effects, begun, start=start)
    assert found.added == 0
    assert found.final is start
    assert found.whole.added >= 1
    assert found.whole.final is taken[0]
    assert found.whole.effects[0].name == "torque_ripple"


@pytest.mark.scenario
def test_few_samples_in_a_period_leave_enough_to_confirm_by(laboratory):
    """At 20 Hz those beside the reversals of a motion of five seconds are most: there only what is slow counts."""
    bench = laboratory.bench(laboratory.record([("torque_offset", "knee", [1.5], {})], periods=10, rate=20.0))
    usual = np.mean(bench.data.left_out, axis=0)
    data = away_from_reversals(bench.data)
    assert np.all(np.mean(data.left_out, axis=0) <= MOST_LEFT_OUT)
    assert np.any(np.mean(data.left_out, axis=0) > usual)
    assert np.all(data.left_out | ~bench.data.left_out)
    found = confirm(bench, search(bench, bench.effects))
    assert [(e.name, e.joint) for e in found.selection.effects] == [("torque_offset", "knee")]
