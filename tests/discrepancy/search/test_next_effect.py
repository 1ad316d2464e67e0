"""Which candidate is added next, and what it must come to."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.free_shapes import is_signal
from sea_ident.discrepancy.bench.judge import own_torque, torque_change
from sea_ident.discrepancy.bench.settle import Settled, settle
from sea_ident.discrepancy.search.candidates import scan
from sea_ident.discrepancy.search.next_effect import (
    CANCELLED,
    LARGE_TORQUE,
    _acceptable,
    _where_it_rests,
    least_useful,
    next_effect,
)
from sea_ident.discrepancy.search.refit import refitted
from sea_ident.effects import make_effect


@pytest.mark.scenario
def test_what_promised_about_as_much_as_what_explains_it_all_is_compared(laboratory, monkeypatch):
    """Two links that a push moves in nearly the same way promise the same; which was first says nothing."""
    bench = laboratory.bench(laboratory.record([("torque_offset", "knee", [2.0], {})]))
    start = settle(bench, bench.effects)
    found = {(c.effect.name, c.effect.joint): c for c in scan(bench, start.fit, start.noise)}
    first, others = found["torque_offset", "knee"], [found["torque_constant", "knee"], found["parallel_spring", "knee"]]
    shares = 0.97, 0.5
    given = [first, *(replace(c, gain=share * first.gain) for c, share in zip(others, shares, strict=True))]
    tried = []

    def noted(bench, before, effect, *rest):
        tried.append(effect.name)
        return refitted(bench, before, effect, *rest)

    monkeypatch.setitem(next_effect.__globals__, "refitted", noted)
    fit, _ = next_effect(bench, start, given, 1000, np.full(len(bench.data.equations), 1e-3))
    assert tried == ["torque_offset", "torque_constant"]
    assert fit.effects[-1].name == "torque_offset"


@pytest.mark.scenario
@pytest.mark.parametrize(
    ("name", "joint", "promised", "is_tried"),
    [
        ("external_force", "knee", 0.3, False),
        # a push that may come to two and a half times what it promises comes before what explains half as much
        ("external_force", "knee", 0.7, False),
        ("external_force", "knee", 0.9, True),
        ("parallel_spring", "knee", 0.3, False),
        ("encoder_offset", "ankle", 0.3, True),
    ],
)
def test_what_promises_little_beside_what_is_explained_is_not_refitted_but_for_signals(
    rippled, monkeypatch, name, joint, promised, is_tried
):
    """A wave that no effect is stands beside the ripple, so that the best does not explain all."""
    data = rippled[0].data
    time, torque = data.motion.time - data.motion.time[0], data.tau_motor.copy()
    torque[:, 0] += 0.8 * np.sin(2.0 * np.pi * 23.0 * time / data.period)
    bench = Bench(replace(data, tau_motor=torque), rippled[0].effects)
    start = settle(bench, bench.effects)
    found = {(c.effect.name, c.effect.joint): c for c in scan(bench, start.fit, start.noise)}
    first = found["torque_ripple", "hip"]
    tried = []

    def noted(bench, before, effect, *rest):
        tried.append(effect.name)
        return refitted(bench, before, effect, *rest) if effect.name == "torque_ripple" else start.fit

    monkeypatch.setitem(next_effect.__globals__, "refitted", noted)
    given = [first, replace(found[name, joint], gain=promised * first.gain)]
    fit, _ = next_effect(bench, start, given, 1000, np.full(len(bench.data.equations), 1e-3))
    assert fit.effects[-1].name == "torque_ripple"
    assert (name in tried) is is_tried


def test_what_promises_about_as_much_as_the_best_is_refitted_though_others_come_first(rippled):
    bench, start, _ = rippled
    scanned = scan(bench, start.fit, start.noise)
    right = next(c for c in scanned if (c.effect.name, c.effect.joint) == ("torque_ripple", "hip"))
    motor = [c for c in scanned if c.effect.side is right.effect.side and c.key != right.key]
    others = [c for c in motor if not is_signal(c.effect) and c.effect.joint != "hip"][:4]
    smallest = np.full(len(bench.data.equations), 1e-3)

    def chosen(share):
        first = [replace(c, gain=1.01 * right.gain) for c in others]
        step = next_effect(bench, start, [*first, replace(right, gain=share * right.gain)], 1000, smallest)
        return step is not None and step[0].effects[-1].name == "torque_ripple"

    assert len(others) == 4
    assert chosen(1.0)
    assert not chosen(0.5)


@pytest.mark.parametrize(
    ("needed", "wave", "share", "beside_few", "beside_many"),
    [
        (1.0, 0.4, 0.7, True, True),
        (1.0, 0.75, 0.35, True, False),
        (1.0, 1.8, 0.06, False, False),
        (0.1, 0.75, 0.35, True, True),
    ],
)
def test_beside_many_effects_one_more_must_explain_half_of_what_is_left(
    nothing_missing, needed, wave, share, beside_few, beside_many
):
    """A ripple, and a wave in time that no effect of the library is: the larger it is, the less the ripple explains.

    Where it explains more than what was found before it, it is as useful as these are.
    """
    data = nothing_missing[0].data
    time, theta = data.motion.time - data.motion.time[0], data.motion.theta[:, 0]
    torque = data.tau_motor.copy()
    torque[:, 0] += np.sin(12.0 * theta) + wave * np.sin(2.0 * np.pi * 23.0 * time / data.period)
    others = [make_effect("torque_offset", joint) for joint in ("hip", "knee", "ankle")]
    others.append(make_effect("nonlinear_viscous_friction", "ankle", exponent=2.0))
    state = nothing_missing[0].state(())
    torque += needed * sum(effect.evaluate(state).motor[:, :, 0] for effect in others)
    changed = replace(data, tau_motor=torque)
    usual = nothing_missing[0].effects
    bench = Bench(changed, usual)
    fit = bench.fit((*usual, *others), nothing_missing[1].noise)
    new = bench.fit((*fit.effects, make_effect("torque_ripple", "hip", order=12.0)), nothing_missing[1].noise)
    assert (fit.statistic - new.statistic) / fit.excess == pytest.approx(share, abs=0.1)
    quiet, nothing = np.random.default_rng(0).standard_normal((8, len(fit.whitened))), np.zeros(len(data.equations))
    assert _acceptable(bench, fit, new, nothing_missing[1].noise, quiet, nothing)
    # the same two models, with four effects that were added before it and with three
    now, gain = Settled(fit, nothing_missing[1].noise), fit.statistic - new.statistic
    assert (gain >= least_useful(bench, now)) is beside_many
    assert (gain >= least_useful(Bench(changed, (*usual, others[0])), now)) is beside_few


@pytest.mark.scenario
def test_a_term_of_the_law_of_a_spring_may_be_cancelled_by_others_of_it(laboratory):
    """A spring that softens has a large one; what counts is that the whole law is stiff."""
    bench = laboratory.bench(laboratory.record([("spring_stiffening", "knee", [3000.0], {"exponent": 2.0})], periods=5))
    start = settle(bench, bench.effects)
    effect = make_effect("spring_stiffening", "knee", exponent=2.0)
    new = bench.fit((*start.fit.effects, effect), start.noise, start=start.fit.parameters)
    names = [column.name for column in new.columns]
    linear, power = (names.index(f"knee.{name}") for name in ("spring_stiffness", "spring_stiffening_power"))
    quiet, nothing = (
        np.random.default_rng(0).standard_normal((8, len(new.whitened))),
        np.zeros(len(bench.data.equations)),
    )
    for stiffness, accepted in ((1e6, True), (1e3, False)):
        values = new.values.copy()
        values[linear], values[power] = stiffness, -1e5
        large = replace(new, values=values)
        assert own_torque(bench, large, -1) > LARGE_TORQUE
        assert torque_change(bench, start.fit, large) < CANCELLED * own_torque(bench, large, -1)
        assert _acceptable(bench, start.fit, large, start.noise, quiet, nothing) is accepted


@pytest.mark.parametrize(
    ("friction", "joint", "gain", "constant", "first"),
    [
        ("spring_hysteresis", "knee", 900.0, 665.0, True),
        ("spring_hysteresis", "hip", 900.0, 665.0, False),
        # what is possible explains more, or much more than the constant, or it is no dry friction
        ("spring_hysteresis", "knee", 600.0, 665.0, False),
        ("spring_hysteresis", "knee", 900.0, 500.0, False),
        ("presliding_friction", "knee", 900.0, 665.0, False),
    ],
)
def test_where_dry_friction_in_a_spring_rests_comes_before_it(friction, joint, gain, constant, first):
    def leaving(name, explained):
        return SimpleNamespace(statistic=1000.0 - explained, effects=(make_effect(name, "knee"),)), 1e-9

    fit = SimpleNamespace(statistic=1000.0)
    accepted = [leaving("encoder_eccentricity", 669.0), leaving("spring_offset", constant)]
    found = _where_it_rests(fit, accepted, [(make_effect(friction, joint), gain)])
    assert found == (accepted[1:] if first else [])
    assert _where_it_rests(fit, accepted, []) == []
