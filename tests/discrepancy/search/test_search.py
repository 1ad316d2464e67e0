"""What the search adds to a model: small effects beside large ones, and the simpler of two that say the same."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest

from sea_ident import side_by_side
from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.judge import EQUALLY_GOOD, own_torque, penalty, slowest
from sea_ident.discrepancy.bench.lack import lack_of_fit
from sea_ident.discrepancy.bench.settle import Settled, settle, settle_again
from sea_ident.discrepancy.search.candidates import scan
from sea_ident.discrepancy.search.exchange import Outdone
from sea_ident.discrepancy.search.formed import formed
from sea_ident.discrepancy.search.next_effect import BESIDE_ANOTHER, LARGE_TORQUE, visible_changes
from sea_ident.discrepancy.search.search import Selection, _lost, search, still_needed
from sea_ident.effects import make_effect
from sea_ident.effects.nonlinear_viscous_friction import NonlinearViscousFriction


def named(selection):
    return {(effect.name, effect.joint) for effect in selection.effects}


@pytest.mark.scenario
def test_two_processes_find_what_one_does(unequal, monkeypatch):
    """To the last digit."""
    bench, alone = unequal
    received = []
    receive = side_by_side._Pair._take
    monkeypatch.setattr(
        side_by_side._Pair, "_take", lambda *args: (received.append(len(args[0]._received)), receive(*args))
    )
    monkeypatch.setattr(side_by_side, "_cores", lambda: 2)
    there = side_by_side.second_core()
    both = side_by_side.shared(search)(Bench(bench.data, bench.effects), bench.effects)
    assert sum(received) > 10 or not there
    assert both.effects == alone.effects
    assert both.p_values == alone.p_values
    assert both.final.fit.parameters == alone.final.fit.parameters
    assert both.final.fit.statistic == alone.final.fit.statistic
    assert [(c.key, c.gain) for c in both.candidates] == [(c.key, c.gain) for c in alone.candidates]


@pytest.mark.scenario
@pytest.mark.parametrize(("far", "tried"), [(np.inf, [1, 2]), (0.0, [2])])
def test_far_from_right_nothing_gives_way_before_all_is_added(unequal, monkeypatch, far, tried):
    """But then it does: what was added first may be the wrong one."""
    bench, found = unequal
    calls = []
    monkeypatch.setattr("sea_ident.discrepancy.search.search.FAR_FROM_RIGHT", far)
    monkeypatch.setattr(
        "sea_ident.discrepancy.search.search.exchange", lambda bench, now, added, *_: (calls.append(added), now)[1]
    )
    again = search(Bench(bench.data, bench.effects), bench.effects)
    assert calls == tried
    assert named(again) == named(found)


@pytest.mark.scenario
def test_a_small_effect_at_another_joint_is_found_beside_a_large_one(unequal):
    found = unequal[1]
    assert named(found) == {("torque_offset", "knee"), ("stribeck_friction", "hip")}
    offset = next(k for k, c in enumerate(found.final.fit.columns) if c.name == "knee.torque_offset")
    assert found.final.fit.values[offset] == pytest.approx(-2.0, abs=4.0 * found.final.fit.std(offset))


@pytest.mark.scenario
def test_the_small_one_would_not_count_at_the_joint_of_the_large_one(unequal):
    """What it changes is less than the share of the large one that counts as never known better, but elsewhere."""
    bench, found = unequal
    fit, noise = found.final.fit, found.final.noise
    changes = {}
    for effect in found.effects:
        others = [e for e in fit.effects if e is not effect]
        without = bench.fit(others, noise, start=fit.parameters)
        changes[effect.joint] = visible_changes(
            bench, without, bench.fit([*others, effect], noise, start=fit.parameters)
        )
    assert np.max(changes["hip"]) < BESIDE_ANOTHER * np.max(changes["knee"])
    assert np.any(changes["hip"] > BESIDE_ANOTHER * changes["knee"])


@pytest.mark.scenario
def test_what_was_found_stands_still(unequal):
    bench, found = unequal
    again = settle_again(bench, found.final.fit)
    assert again.fit.statistic == pytest.approx(found.final.fit.statistic, rel=0.02)


@pytest.mark.scenario
def test_a_model_settles_after_an_exchange(unequal, monkeypatch):
    """What takes the place of another may come with shapes that are not yet right beside the rest."""
    bench, found = unequal

    def exchanged(bench, now, added, tried, ruled_out):
        effects = tuple(replace(e, speed=2.0 * e.speed) if hasattr(e, "speed") else e for e in now.fit.effects)
        if effects == now.fit.effects:
            return now
        return Settled(bench.fit(effects, now.noise, start=now.fit.parameters), now.noise)

    monkeypatch.setitem(search.__globals__, "exchange", exchanged)
    again = search(bench, bench.effects)
    assert named(again) == named(found)
    assert again.final.fit.statistic == pytest.approx(found.final.fit.statistic, rel=0.02)


@pytest.mark.scenario
def test_a_push_has_its_edges_right_before_another_takes_its_place(unequal, monkeypatch):
    bench, _ = unequal
    calls = []
    for function, name in ((formed, "sharpened"), (search, "exchange")):
        there = function.__globals__
        monkeypatch.setitem(there, name, lambda *a, n=name, f=there[name]: (calls.append(n), f(*a))[1])
    added = search(bench, bench.effects).added
    assert calls == ["sharpened", "exchange"] * added


@pytest.mark.scenario
def test_a_search_that_goes_on_from_another_keeps_what_is_needed_and_no_more(unequal):
    """Begun with what was found and a push that a drift, known by now, had looked like."""
    bench, found = unequal
    push = make_effect("external_force", "knee", start=1.0, stop=1.5, period=bench.data.period)
    model = (*found.final.fit.effects, push)
    final = settle_again(bench, bench.fit(model, found.final.noise, start=found.final.fit.parameters))
    begun = replace(found, final=final, added=found.added + 1, p_values=(*found.p_values, 1e-9))
    assert named(search(bench, bench.effects, still_needed(bench, begun))) == named(found)
    alone = replace(begun, final=settle_again(bench, bench.fit((*bench.effects, push), final.noise)), added=1)
    left = still_needed(bench, replace(alone, p_values=(1e-9,)))
    assert left.added == 0
    assert named(search(bench, bench.effects, left)) == named(found)


def test_when_a_push_begins_and_ends_is_paid_for(nothing_missing):
    """A force of three components that meets the link anywhere at any time: eight parameters, an offset has one."""
    bench = nothing_missing[0]
    push, offset = (penalty(make_effect(name, "knee"), bench) for name in ("external_force", "torque_offset"))
    assert push == pytest.approx(8.0 * offset)


@pytest.mark.scenario
def test_a_torque_constant_is_all_that_a_motor_with_another_one_lacks(nothing_missing):
    """Of three motors that share one rotor inertia the torque of one is recorded two fifths too large."""
    data = nothing_missing[0].data
    factor = np.where(np.arange(data.robot.n) == data.robot.index("knee"), 1.4, 1.0)
    assert len(data.robot.rotor_groups) == 1
    other = replace(data, tau_motor=factor * data.tau_motor, period_tau_motor=factor * data.period_tau_motor)
    bench = Bench(other, nothing_missing[0].effects)
    found = search(bench, bench.effects)
    assert named(found) == {("torque_constant", "knee")}
    fit = found.final.fit
    assert fit.parameters["knee.torque_constant"] == pytest.approx(0.4, abs=4.0 * fit.std(len(fit.columns) - 1))
    assert lack_of_fit(bench, found.final)[2] > 0.01


def test_the_longest_wave_costs_more_than_a_constant(nothing_missing):
    bench = nothing_missing[0]
    order = next(s for s in make_effect("torque_ripple", "hip").shapes if s.name == "order")
    longest, shorter = (make_effect("torque_ripple", "hip", order=factor * order.lower) for factor in (1.0, 2.0))
    assert slowest(longest)
    assert not slowest(shorter)
    assert penalty(longest, bench) == pytest.approx(penalty(shorter, bench) + EQUALLY_GOOD)
    assert penalty(make_effect("torque_offset", "hip"), bench) < penalty(shorter, bench)


@pytest.mark.scenario
def test_a_small_effect_beside_a_large_one_counts_where_it_explains_all_that_is_left(nothing_missing):
    """Less than what counts as the form of the ripple, but a ripple in the wrong form would leave something."""
    data = nothing_missing[0].data
    theta, sign = data.motion.theta[:, 0], np.tanh(data.motion.dtheta[:, 0] / 0.02)
    torque = data.tau_motor.copy()
    torque[:, 0] += 8.0 * np.sin(12.0 * theta) + 0.8 * sign * np.sin(9.0 * theta)
    bench = Bench(replace(data, tau_motor=torque), nothing_missing[0].effects)
    found = search(bench, bench.effects)
    assert named(found) == {("torque_ripple", "hip"), ("position_dependent_friction", "hip")}
    fit = found.final.fit
    sizes = {
        effect.name: np.hypot(*(fit.parameters[c.name] for c in effect.columns(bench.robot)))
        for effect in found.effects
    }
    assert sizes["torque_ripple"] == pytest.approx(8.0, rel=0.05)
    assert sizes["position_dependent_friction"] < BESIDE_ANOTHER * sizes["torque_ripple"]


@pytest.mark.scenario
def test_another_power_of_the_deflection_beside_the_cubic_stiffness(laboratory):
    """The model has the cubic stiffness; a spring that stiffens with the square is no asymmetric one for that."""
    planted = [("spring_stiffening", "knee", [3000.0], {"exponent": 2.0})]
    bench = laboratory.bench(laboratory.record(planted, periods=5))
    start = settle(bench, bench.effects)
    best = scan(bench, start.fit, start.noise)[0].effect
    assert (best.name, best.joint, best.exponent) == ("spring_stiffening", "knee", 2.0)
    fit = bench.fit((*start.fit.effects, best), start.noise, start=start.fit.parameters)
    (column,) = best.columns(bench.robot)
    assert fit.parameters[column.name] == pytest.approx(3000.0, rel=0.05)
    assert fit.parameters["knee.spring_stiffening"] == pytest.approx(8000.0, rel=0.1)
    assert ("spring_stiffening", "knee") not in {(c.effect.name, c.effect.joint) for c in scan(bench, fit, start.noise)}


@pytest.mark.scenario
def test_two_orders_at_one_joint_are_found_within_their_uncertainties(laboratory):
    planted = [
        ("torque_ripple", "hip", [0.8, 0.5], {"order": 12.0}),
        ("torque_ripple", "hip", [0.3, 0.4], {"order": 36.0}),
    ]
    bench = laboratory.bench(laboratory.record(planted))
    found = search(bench, bench.effects)
    fit = found.final.fit
    assert [effect.title for effect in found.effects] == ["torque_ripple at hip", "torque_ripple 2 at hip"]
    free = {(len(fit.effects) - 2 + k, "order"): truth for k, truth in enumerate((12.0, 36.0))}
    for k, (position, shape) in enumerate(fit.free_shapes):
        truth = free.pop((position, shape.name), None)
        if truth is not None:
            std = fit.std(len(fit.columns) + k) * truth
            assert std < 0.05 * truth
            assert abs(fit.effects[position].order - truth) < 4.0 * std
    assert not free
    assert lack_of_fit(bench, found.final)[2] > 1e-3


@dataclass(frozen=True)
class Thinning(NonlinearViscousFriction):
    """Friction of a grease that thins with the speed of shear: c theta' / (1 + |theta'| / speed)."""

    speed: float = 1.0

    def local_columns(self, q, dq, theta, dtheta):
        return (dtheta / (1.0 + np.abs(dtheta) / self.speed))[:, None]


@pytest.mark.scenario
@pytest.mark.parametrize(("joint", "size", "speed"), [("ankle", 15.0, 1.0), ("hip", 150.0, 0.3), ("knee", 30.0, 1.0)])
def test_friction_that_thins_with_speed_is_nonlinear_viscous(laboratory, joint, size, speed):
    """Power and viscous friction cancel in large part: what they come to brakes at any speed."""
    bench = laboratory.bench(laboratory.record([(Thinning(joint, speed=speed), [size])]))
    found = search(bench, bench.effects)
    assert named(found) == {("nonlinear_viscous_friction", joint)}
    fit = found.final.fit
    assert own_torque(bench, fit, -1) > LARGE_TORQUE
    speeds = np.linspace(0.25, 1.0, 20) * np.abs(bench.data.motion.dtheta[:, bench.robot.index(joint)]).max()
    power = fit.parameters[f"{joint}.nonlinear_viscous_friction"] * speeds ** fit.effects[-1].exponent
    usual = {c.name: value for c, value in zip(fit.columns, fit.values, strict=True)}
    law = usual[f"{joint}.coulomb_friction"] + usual[f"{joint}.viscous_friction"] * speeds + power
    actuator = bench.robot.joints[bench.robot.index(joint)].actuator
    true = actuator.viscous_friction * speeds + actuator.coulomb_friction + size * speeds / (1.0 + speeds / speed)
    np.testing.assert_allclose(law, true, rtol=0.1)


@pytest.mark.scenario
@pytest.mark.parametrize(
    ("coulomb", "motion"),
    [
        (0.034, 0),  # a push would explain more of both than either alone does, but not all
        (0.068, 1),  # without the spring the viscous part of the friction is negative
    ],
)
def test_two_effects_of_a_link_are_found_by_their_laws(laboratory, coulomb, motion):
    planted = [("parallel_spring", "knee", [0.4, 0.14], {}), ("link_friction", "knee", [0.006, coulomb], {})]
    bench = laboratory.bench(laboratory.record(planted, periods=6, motion=motion))
    found = search(bench, bench.effects)
    assert named(found) == {("parallel_spring", "knee"), ("link_friction", "knee")}
    for name, value in (("parallel_spring_stiffness", 0.4), ("link_friction_coulomb", coulomb)):
        k = next(k for k, c in enumerate(found.final.fit.columns) if c.name == f"knee.{name}")
        assert found.final.fit.values[k] == pytest.approx(value, abs=4.0 * found.final.fit.std(k))


@pytest.mark.scenario
def test_what_leaves_half_is_not_lost_where_another_promises_the_rest(laboratory, monkeypatch):
    monkeypatch.setattr("sea_ident.discrepancy.search.search.HOPELESS", 20.0)
    planted = [("torque_offset", name, [size], {}) for name, size in (("hip", 4.0), ("knee", -2.0), ("ankle", 1.4))]
    bench = laboratory.bench(laboratory.record(planted, periods=10))
    assert named(search(bench, bench.effects)) == {(name, joint) for name, joint, *_ in planted}


@pytest.mark.scenario
def test_what_another_search_found_is_no_step_of_this_one(laboratory, monkeypatch):
    """Two that matter alike are left beside that, none of which promises most of what is left: there it begins."""
    planted = [("torque_offset", name, [size], {}) for name, size in (("hip", 4.0), ("knee", -2.0), ("ankle", 1.4))]
    planted.append(("parallel_spring", "knee", [1.5, 0.2], {}))
    bench = laboratory.bench(laboratory.record(planted, periods=10))
    start = settle(bench, bench.effects)
    two = (*start.fit.effects, *(make_effect("torque_offset", name) for name in ("hip", "knee")))
    begun = Selection(
        start, settle_again(bench, bench.fit(two, start.noise, start=start.fit.parameters)), 2, (0.0, 0.0)
    )
    monkeypatch.setattr("sea_ident.discrepancy.search.search.HOPELESS", 20.0)
    assert named(search(bench, bench.effects, begun)) == {(name, joint) for name, joint, *_ in planted}


@pytest.mark.parametrize(
    ("added", "statistic", "promised", "lost"),
    [
        (3, 6e4, 2e4, True),
        (3, 6e4, 4e4, False),  # another one promises most of what is left
        (3, 3e4, 1e4, False),  # it took most of what was there
        (2, 6e4, 2e4, False),  # one of many that matter alike
        (3, 5e2, 2e2, False),  # little is left
    ],
)
def test_a_search_is_lost_far_from_right_where_nothing_takes_most_of_what_is_left(added, statistic, promised, lost):
    before, now = (SimpleNamespace(fit=SimpleNamespace(statistic=s, dof=100, excess=s - 100)) for s in (1e5, statistic))
    candidates = [SimpleNamespace(gain=promised), SimpleNamespace(gain=0.0)]
    assert _lost(now, before, added, candidates) == lost


@pytest.mark.scenario
def test_a_search_that_goes_on_knows_what_was_outdone_before(unequal, monkeypatch):
    bench, found = unequal
    outdone = {(("torque_offset", "knee"), ("torque_ripple", "knee")): Outdone(0.5, 0.1)}
    assert found.tried
    known = []

    def exchanged(bench, now, added, tried, ruled_out):
        known.append(dict(tried))
        return now

    monkeypatch.setattr("sea_ident.discrepancy.search.search.exchange", exchanged)
    again = search(bench, bench.effects, replace(found, tried=outdone))
    assert known[0] == outdone
    assert outdone.items() <= again.tried.items()
    search(bench, bench.effects, replace(found, tried={}))
    assert known[-1] == {}


@pytest.mark.scenario
@pytest.mark.parametrize("short", [True, False])
def test_what_became_too_short_while_the_model_settled_is_not_kept(laboratory, monkeypatch, short):
    """Friction that builds up over less than the passes differ by, which was more before the noise floor was right."""
    planted = [("presliding_friction", "knee", [1.2], {"displacement": 0.003})]
    bench = laboratory.bench(laboratory.record(planted, periods=8))
    monkeypatch.setitem(search.__globals__, "too_short", lambda bench, effect: short)
    assert named(search(bench, bench.effects)) == (set() if short else {("presliding_friction", "knee")})
