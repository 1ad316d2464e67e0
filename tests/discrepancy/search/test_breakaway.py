"""Stiction that lets go at another instant in every pass: it is gone from their mean, and every pass shows it."""

import sys
import warnings
from dataclasses import replace

import numpy as np
import pytest

from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.settle import settle
from sea_ident.discrepancy.diagnose import diagnose
from sea_ident.discrepancy.measured.standing import known_speed
from sea_ident.discrepancy.search.breakaway import (
    LEVEL,
    Breakaway,
    breakaway_excess,
    breakaway_p,
    let_go,
    lets_go_late,
    stiction,
)
from sea_ident.discrepancy.words import stiction as words_of_stiction
from sea_ident.effects import make_effect
from sea_ident.estimation import identify
from sea_ident.exceptions import SeaIdentWarning

KNEE = 1
"""Index of the knee of the leg."""

BEFORE, AFTER = 3, 2
"""Samples before a motor is let go in which stiction holds it with all it has, and after."""


def events_of(data, motion, lasts=4):
    return let_go(motion.dtheta[:, KNEE], known_speed(data, KNEE), lasts)


def with_stiction(data, sizes):
    """The same passes with a torque of its own in each, about the instants at which the knee lets go."""
    torque = data.period_tau_motor.copy()
    for motion, size, tau in zip(data.period_motions, sizes, torque, strict=True):
        for k, direction in events_of(data, motion):
            tau[np.arange(k - BEFORE, k + AFTER + 1) % len(tau), KNEE] += size * direction
    return replace(data, period_tau_motor=torque, tau_motor=torque.mean(axis=0))


def test_what_stood_and_keeps_moving_was_let_go():
    speed = np.array([0.0, 0.0, 0.5, 0.6, 0.7, 0.3, 0.0, -0.4, -0.4, -0.4, -0.4, 0.05])
    assert let_go(speed, 0.1, 2) == [(2, 1), (7, -1)]


def test_what_only_twitches_was_not_let_go():
    speed = np.array([0.0, 0.0, 0.5, 0.0, 0.0, -0.5, -0.5, -0.5, 0.0])
    assert let_go(speed, 0.1, 2) == [(5, -1)]


def test_what_turns_without_standing_was_not_let_go():
    assert let_go(np.array([-0.5, -0.5, -0.5, 0.5, 0.5, 0.5]), 0.1, 1) == []


def test_what_is_let_go_at_the_end_of_a_period_moves_on_in_its_beginning():
    assert let_go(np.array([0.5, 0.6, 0.0, 0.0, 0.4]), 0.1, 2) == [(4, 1)]


@pytest.fixture(scope="module")
def settled(jittery, laboratory):
    """A leg without stiction, its model, and what its knee shows where it lets go."""
    bench = Bench(jittery, laboratory.effects)
    fit = settle(bench, bench.effects).fit
    return bench, fit, breakaway_excess(bench, fit, "knee")


def test_the_excess_is_the_torque_that_is_there(settled, laboratory):
    bench, fit, before = settled
    sizes = np.linspace(0.5, 1.5, bench.data.periods)
    after = breakaway_excess(Bench(with_stiction(bench.data, sizes), laboratory.effects), fit, "knee")
    assert len(after) == bench.data.periods
    np.testing.assert_allclose(after - before, sizes, rtol=1e-9)


def test_the_same_torque_the_other_way_is_no_stiction(settled, laboratory):
    bench, fit, _ = settled
    other = Bench(with_stiction(bench.data, -np.ones(bench.data.periods)), laboratory.effects)
    assert breakaway_p(other, fit, "knee") == 1.0


def test_friction_that_only_slides_is_never_exceeded(settled):
    bench, fit, _ = settled
    for joint in bench.robot.joint_names:
        assert np.all(breakaway_excess(bench, fit, joint) < 0.0)
        assert breakaway_p(bench, fit, joint) == 1.0


def test_a_torque_that_comes_and_goes_with_the_passes_is_no_stiction(settled, laboratory):
    """In the mean it is as large as what shows it, from pass to pass it is anything."""
    bench, fit, before = settled
    sizes = np.where(np.arange(bench.data.periods) % 4 == 0, 20.0, 0.0) - before
    found = breakaway_excess(Bench(with_stiction(bench.data, sizes), laboratory.effects), fit, "knee")
    assert np.mean(found) == pytest.approx(5.0)
    assert LEVEL < breakaway_p(Bench(with_stiction(bench.data, sizes), laboratory.effects), fit, "knee") < 0.1


def test_only_stiction_lets_go_late(settled, laboratory):
    bench, fit, before = settled
    held = Bench(with_stiction(bench.data, 1.0 - before), laboratory.effects)
    assert lets_go_late(held, fit, make_effect("stribeck_friction", "knee"))
    assert not lets_go_late(held, fit, make_effect("stribeck_friction", "hip"))
    assert not lets_go_late(held, fit, make_effect("nonlinear_viscous_friction", "knee"))


def test_how_late_a_model_with_stiction_lets_go_is_told(settled, laboratory):
    bench, fit, before = settled
    sizes = 1.0 + 0.2 * np.resize([-1.0, 1.0], bench.data.periods)
    held = Bench(with_stiction(bench.data, sizes - before), laboratory.effects)
    model = (
        *fit.effects,
        make_effect("stribeck_friction", "knee", speed=0.01),
        make_effect("stribeck_friction", "hip"),
    )
    now = settle(held, model)
    rest = held.fit(now.fit.effects[:-2] + now.fit.effects[-1:], now.noise, start=now.fit.parameters, tangents=False)
    expected = breakaway_excess(held, rest, "knee")
    found = stiction(held, now.fit, len(model) - 2, now.noise)
    assert found.passes == bench.data.periods
    assert found.excess == pytest.approx(np.mean(expected))
    assert found.std == pytest.approx(np.std(expected, ddof=1) / np.sqrt(found.passes))
    # about the torque that was put there, for sliding friction is fitted beside it
    assert found.excess == pytest.approx(1.0, abs=0.3)
    assert stiction(held, now.fit, len(model) - 1, now.noise) is None
    assert stiction(held, now.fit, 0, now.noise) is None


def test_friction_that_falls_at_speeds_at_which_it_slides_is_no_stiction(settled, laboratory):
    """Its law has the larger torque at low speed already, so nothing is said of a motor that sticks."""
    bench, fit, _ = settled
    motion = bench.data.motion
    falling = make_effect("stribeck_friction", "knee", speed=0.1)
    added = 3.0 * falling.local_columns(*(getattr(motion, k)[:, 1] for k in ("q", "dq", "theta", "dtheta")))[:, 0]
    torque = bench.data.period_tau_motor + np.column_stack([0.0 * added, added, 0.0 * added])
    held = Bench(replace(bench.data, tau_motor=torque.mean(axis=0), period_tau_motor=torque), laboratory.effects)
    now = settle(held, (*fit.effects, falling))
    rest = held.fit(fit.effects, now.noise, start=now.fit.parameters, tangents=False)
    assert lets_go_late(held, rest, falling)  # beside the model without it, it does
    assert stiction(held, now.fit, len(now.fit.effects) - 1, now.noise) is None


def test_stiction_is_told_with_its_spread():
    words = words_of_stiction(Breakaway("lift", 12.345, 0.321, 20), "N")
    assert words == (
        "stiction at lift: in 20 passes friction lets the motor go only at 12.3 +- 0.32 N above what it slides in"
    )


def test_a_small_excess_is_none(settled, laboratory):
    """As certain as it may be: where friction turns, a torque of limited bandwidth overshoots."""
    bench, fit, before = settled
    sliding = fit.parameters["knee.coulomb_friction"]
    for share, seen in ((0.08, False), (0.12, True)):
        held = Bench(with_stiction(bench.data, share * sliding - before), laboratory.effects)
        assert (breakaway_p(held, fit, "knee") <= LEVEL) == seen


def test_without_sliding_friction_there_is_nothing_to_compare_with(settled, laboratory):
    bench, _, before = settled
    held = Bench(with_stiction(bench.data, 1.0 - before), laboratory.effects)
    slippery = [e for e in laboratory.effects if (e.name, e.joint) != ("coulomb_friction", "knee")]
    assert breakaway_p(held, held.fit(slippery, None), "knee") == 1.0


def test_few_passes_prove_nothing(settled, laboratory):
    bench, fit, before = settled
    data = with_stiction(bench.data, 1.0 - before)
    few = replace(
        data, period_motions=data.period_motions[:3], period_tau_motor=data.period_tau_motor[:3], places=(0, 1, 2)
    )
    assert breakaway_p(Bench(few, laboratory.effects), fit, "knee") == 1.0


def test_a_joint_that_is_not_measured_is_refused(settled):
    bench, fit, _ = settled
    with pytest.raises(ValueError, match="no equation with the motor of joint 'toe'"):
        breakaway_excess(bench, fit, "toe")


@pytest.mark.scenario
def test_a_torque_that_is_late_is_none_that_lets_go_late(laboratory):
    """In the model the delay is nothing that breaks away; without it the torque of another instant stands there."""
    delay = make_effect("torque_delay", "knee", delay=0.02)
    data = laboratory.data(laboratory.record([(delay, [])], periods=10))
    bench = Bench(data, laboratory.effects)
    start = settle(bench, (*bench.effects, delay)).fit
    prompt = replace(start, effects=tuple(e for e in start.effects if e.name != "torque_delay"))
    assert breakaway_p(bench, start, "knee") == 1.0
    assert breakaway_p(bench, prompt, "knee") < 1e-3


@pytest.mark.scenario
def test_a_diagnosis_warns_of_the_stiction_it_found(laboratory, monkeypatch):
    """Whatever was found is taken for stiction here: what the passes say of it reaches the user."""
    recording = laboratory.record([("torque_offset", "knee", [2.0], {})])
    module = sys.modules["sea_ident.discrepancy.diagnose"]  # the package has the function by that name
    monkeypatch.setattr(module, "stiction", lambda *_: Breakaway("knee", 0.5, 0.1, 8))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        found = diagnose(identify(laboratory.leg, recording, period=5.0), recording)
    assert any(text.startswith("stiction at knee") for text in found.warnings)
