"""A model with another effect: what cannot win is given up, what can is not."""

from dataclasses import replace

import numpy as np
import pytest

from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.judge import EQUALLY_GOOD
from sea_ident.discrepancy.bench.physics import physical
from sea_ident.discrepancy.bench.settle import settle
from sea_ident.discrepancy.search.candidates import scan
from sea_ident.discrepancy.search.refit import _open, refitted
from sea_ident.effects import make_effect


@pytest.fixture
def steps(monkeypatch):
    """Steps of shapes that are taken."""
    taken = []
    step = Bench._refine_step

    def counted(self, fit, *args):
        taken.append(fit.statistic)
        return step(self, fit, *args)

    monkeypatch.setattr(Bench, "_refine_step", counted)
    return taken


@pytest.fixture(scope="module")
def candidates(rippled):
    bench, start, _ = rippled
    return {(c.effect.name, c.effect.joint): c.effect for c in scan(bench, start.fit, start.noise)}


def test_what_is_far_above_and_comes_down_slowly_is_given_up(rippled, steps):
    bench, start, right = rippled
    wrong = make_effect("torque_ripple", "knee", order=14.0)
    args = (bench, start.fit.effects, wrong, (), start.noise, start.fit.parameters)
    whole = refitted(*args)
    count = len(steps)
    steps.clear()
    given_up = refitted(*args, right.fit.statistic)
    assert len(steps) < count
    # but not so early that it could have been the better one
    assert whole.statistic > 3.0 * right.fit.statistic
    assert given_up.statistic < start.fit.statistic


def test_what_is_better_is_refined_to_the_end(rippled, candidates, steps):
    bench, start, _ = rippled
    ripple = candidates["torque_ripple", "hip"]
    args = (bench, start.fit.effects, ripple, (), start.noise, start.fit.parameters)
    whole = refitted(*args)
    asked = list(steps)
    steps.clear()
    assert refitted(*args, 1.01 * whole.statistic).statistic == pytest.approx(whole.statistic, rel=1e-9)
    assert steps == pytest.approx(asked)
    assert whole.effects[-1].order == pytest.approx(
        4.0, abs=3.0 * whole.std(len(whole.columns) + len(whole.free_shapes) - 1)
    )


def test_beginnings_that_are_worse_than_the_estimate_are_not_followed(rippled, steps):
    """An offset of a right encoder: from the far ends of its range there is nothing to be learned."""
    bench, _, right = rippled
    offset = make_effect("encoder_offset", "knee")
    assert len(offset.beginnings()) == 5
    refitted(bench, right.fit.effects, offset, (), right.noise, right.fit.parameters)
    assert max(steps) < 3.0 * right.fit.statistic


def bent_to_one_side(bench):
    """A joint whose spring a motion bends to one side only, and by how much at least."""
    deflection = bench.data.motion.deflection
    joint = int(np.argmin(np.ptp(np.sign(deflection), axis=0)))
    assert not np.ptp(np.sign(deflection[:, joint]))
    return bench.robot.joint_names[joint], float(np.abs(deflection[:, joint]).min())


@pytest.mark.scenario
def test_play_that_is_never_closed_is_as_wide_as_its_torque_in_this_spring(laboratory, nothing_missing):
    """Its torque is K times the width: where a fit of both passes on, no K of another spring may come of it."""
    bench, _ = nothing_missing
    name, least = bent_to_one_side(bench)
    spring = bench.robot.spring(name)
    width, cubic = 0.4 * least, spring.cubic_stiffness / spring.stiffness
    planted = ("backlash", name, [spring.stiffness], {"half_width": width, "cubic": cubic})
    bench = laboratory.bench(laboratory.record([planted], periods=6))
    start = settle(bench, bench.effects)
    effect = make_effect("backlash", name, half_width=0.8 * least)
    found = refitted(bench, start.fit.effects, effect, (), start.noise, start.fit.parameters)
    assert physical(bench, found, -1)
    assert found.effects[-1].half_width == pytest.approx(width, rel=0.1)


@pytest.mark.scenario
def test_soft_ends_of_play_are_found_from_hard_ones(laboratory, nothing_missing):
    """Where the motion does not pass the play its softness is all that tells it from a constant."""
    bench, _ = nothing_missing
    name, least = bent_to_one_side(bench)
    spring = bench.robot.spring(name)
    shapes = {"half_width": 0.8 * least, "softness": 0.8, "cubic": spring.cubic_stiffness / spring.stiffness}
    bench = laboratory.bench(laboratory.record([("backlash", name, [spring.stiffness], shapes)], periods=6))
    start = settle(bench, bench.effects)
    now = settle(bench, (*bench.effects, make_effect("backlash", name, **shapes)))
    constant, hard, soft = (
        refitted(bench, start.fit.effects, effect, (), now.noise, start.fit.parameters)
        for effect in (
            make_effect("spring_offset", name),
            make_effect("backlash", name, half_width=0.8 * least, softness=0.01),
            make_effect("backlash", name, half_width=0.5 * least),
        )
    )
    assert soft.statistic == pytest.approx(hard.statistic, rel=0.05)
    assert soft.statistic < 1.2 * soft.dof
    assert constant.statistic > soft.statistic + 10.0 * EQUALLY_GOOD
    widths, softness = (len(soft.columns) + k for k in (len(soft.free_shapes) - 2, len(soft.free_shapes) - 1))
    found = soft.effects[-1]
    assert np.log(found.half_width / shapes["half_width"]) == pytest.approx(0.0, abs=3.0 * soft.std(widths))
    assert np.log(found.softness / shapes["softness"]) == pytest.approx(0.0, abs=3.0 * soft.std(softness))


@pytest.mark.scenario
def test_play_in_no_spring_gives_way_to_play_that_is_never_closed(laboratory, nothing_missing):
    """Narrow play in a spring of its own is the same constant, and cannot be."""
    bench, _ = nothing_missing
    name, least = bent_to_one_side(bench)
    width, stiffness = 0.3 * least, bench.robot.spring(name).stiffness
    bench = laboratory.bench(laboratory.record([("spring_offset", name, [-stiffness * width], {})], periods=6))
    start = settle(bench, bench.effects)
    narrow = make_effect("backlash", name, half_width=0.2 * width)
    fit = bench.fit((*start.fit.effects, narrow), start.noise, start=start.fit.parameters)
    assert not physical(bench, fit, -1)
    found = _open(bench, fit, start.noise, len(start.fit.effects))
    assert physical(bench, found, -1)
    assert found.effects[-1].half_width == pytest.approx(width, rel=0.1)
    assert found.statistic - fit.statistic < EQUALLY_GOOD * fit.unit
    # but where the motion shows that it is never so wide, what was found stays
    assert (
        _open(bench, replace(fit, whitened=0.5 * fit.whitened), start.noise, len(start.fit.effects)).effects[-1]
        is narrow
    )
    # and what is possible is left as it is
    assert _open(bench, found, start.noise, len(start.fit.effects)) is found


@pytest.mark.scenario
def test_play_whose_ends_a_motion_leaves_open_is_hard_and_in_its_spring(laboratory, nothing_missing):
    """Soft play of half the width, in a spring twice as stiff, is possible too, and wrong on any motion that passes."""
    bench, _ = nothing_missing
    name, least = bent_to_one_side(bench)
    spring = bench.robot.spring(name)
    width, cubic = 0.6 * least, spring.cubic_stiffness / spring.stiffness
    planted = ("backlash", name, [spring.stiffness], {"half_width": width, "cubic": cubic, "softness": 0.05})
    bench = laboratory.bench(laboratory.record([planted], periods=6))
    start = settle(bench, bench.effects)
    soft = make_effect("backlash", name, half_width=0.45 * width, softness=1.0)
    fit = bench.fit((*start.fit.effects, soft), start.noise, start=start.fit.parameters)
    assert physical(bench, fit, -1)
    assert fit.parameters[f"{name}.backlash"] > 1.8 * fit.parameters[f"{name}.spring_stiffness"]
    found = _open(bench, fit, start.noise, len(start.fit.effects))
    play = found.effects[-1]
    assert play.half_width == pytest.approx(width, rel=0.02)
    assert play.softness == 0.05
    assert play.cubic == pytest.approx(found.parameters[f"{name}.spring_stiffening"] / spring.stiffness, rel=0.05)
    assert _open(bench, found, start.noise, len(start.fit.effects)) is found


def test_play_that_is_fitted_is_held_against_play_that_is_never_closed(rippled, monkeypatch):
    bench, start, _ = rippled
    asked = []
    monkeypatch.setitem(refitted.__globals__, "_open", lambda _, fit, *rest: asked.append(fit) or fit)
    for name in ("backlash", "spring_offset"):
        effect = make_effect(name, "hip")
        refitted(bench, start.fit.effects, effect, (), start.noise, start.fit.parameters)
    (fit,) = asked
    assert fit.effects[-1].name == "backlash"


@pytest.mark.scenario
@pytest.mark.parametrize("times", [3.0, 1.0 / 3.0])
def test_of_two_elements_that_slip_the_one_is_not_taken_for_the_other(laboratory, times):
    slip = 0.0015
    bench = laboratory.bench(laboratory.record([("spring_hysteresis", "hip", [1.0, 3.0], {"slip": slip})]))
    start = settle(bench, bench.effects)
    begun = make_effect("spring_hysteresis", "hip", slip=times * slip)
    fit = refitted(bench, bench.effects, begun, (), start.noise, start.fit.parameters)
    std = slip * fit.std(len(fit.values) + len(fit.free_shapes) - 1)
    assert fit.effects[-1].slip == pytest.approx(slip, abs=4.0 * std)
    assert std < 0.02 * slip
    assert (
        fit.statistic
        < EQUALLY_GOOD
        + bench.fit((*bench.effects, replace(begun, slip=slip)), start.noise, start=start.fit.parameters).statistic
    )


@pytest.mark.scenario
def test_a_delay_is_not_hidden_by_friction_that_seemed_to_turn_slowly(laboratory):
    """A motor whose torque is late, in a model whose friction was given three times the width over which it turns."""
    bench = laboratory.bench(laboratory.record([("torque_delay", "hip", [], {"delay": 0.012})], periods=6))
    start = settle(bench, bench.effects)
    wide = tuple(
        replace(e, smoothing=0.03) if (e.name, e.joint) == ("coulomb_friction", "hip") else e for e in bench.effects
    )
    late = make_effect("torque_delay", "hip", delay=0.001)
    found = refitted(bench, wide, late, (), start.noise, start.fit.parameters)
    assert found.effects[-1].delay == pytest.approx(0.012, rel=0.04)
    (friction,) = (e for e in found.effects if (e.name, e.joint) == ("coulomb_friction", "hip"))
    assert friction.smoothing == pytest.approx(0.01, rel=0.4)
    held = bench.refine((*wide, late), start.noise, start=start.fit.parameters, only=len(wide))
    assert held.statistic > found.statistic + 2.0 * EQUALLY_GOOD
