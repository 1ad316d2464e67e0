"""Shapes refined together with the parameters."""

from dataclasses import replace

import numpy as np
import pytest

from sea_ident.discrepancy.bench.free_shapes import free_shapes, moved, moved_within, room, turning_in_sight
from sea_ident.discrepancy.bench.settle import settle, settle_again
from sea_ident.discrepancy.evidence.uncertainty import uncertainties
from sea_ident.effects import effect_classes, make_effect
from sea_ident.simulation import SensorNoise

PUSH = {"start": 2.0, "stop": 3.0, "period": 5.0}


@pytest.fixture(scope="module")
def pushed(laboratory):
    """A shank that is pushed farther from its centre of mass than any push is looked for."""
    planted = [("external_force", "knee", [8.0, 0.0, 5.0], {**PUSH, "point_x": 0.1, "point_z": -0.8})]
    bench = laboratory.bench(laboratory.record(planted, periods=5))
    return bench, settle(bench, bench.effects)


@pytest.mark.scenario
@pytest.mark.parametrize(("x", "z"), [(0.2, -0.5), (-0.2, -0.5), (0.3, 0.2)])
def test_a_shape_at_the_end_of_its_range_does_not_hold_up_the_others(pushed, x, z):
    """However it begins: where the fit ends, no shape that can move brings the statistic down."""
    bench, start = pushed
    push = make_effect("external_force", "knee", **PUSH, point_x=x, point_y=0.001, point_z=z)
    model, only = (*start.fit.effects, push), len(start.fit.effects)
    fit = bench.refine(model, start.noise, start=start.fit.parameters, only=only)
    assert fit.effects[-1].point_z == -0.5
    for position, shape in free_shapes(fit.effects):
        if position < only:
            continue
        for step in (-0.01, 0.01):
            effects = list(fit.effects)
            effects[position] = moved(effects[position], shape, step)
            other = bench.fit(effects, start.noise, start=fit.parameters, tangents=False)
            assert other.statistic > fit.statistic - 0.05 - 1e-3 * fit.excess, (shape.name, step)


def test_what_runs_away_does_not_hold_up_the_others(rippled, monkeypatch):
    """Its shape stays where it is, and the others go all the way that they have beside it."""
    bench, _, now = rippled
    only, spring = len(bench.effects), make_effect("asymmetric_spring", "knee", exponent=1.5)
    off = replace(now.fit.effects[-1], order=now.fit.effects[-1].order + 0.2)

    def runs_away(self, before, after):
        return {only} if after.effects[only] != before.effects[only] else set()

    def refined(only):
        model = (*now.fit.effects[:-1], spring, off)
        return bench.refine(model, now.noise, start=now.fit.parameters, only=only)

    free, alone = refined(only), refined(only + 1)
    assert free.effects[only] != spring
    monkeypatch.setattr(type(bench), "_run_away", runs_away)
    held = refined(only)
    assert held.effects[only] == spring
    assert held.effects[-1].order == pytest.approx(alone.effects[-1].order, abs=0.005)
    assert held.statistic < alone.statistic + 0.1 + 2e-3 * alone.excess


@pytest.mark.scenario
@pytest.mark.parametrize(("begun", "planted"), [(1.4, 0.7), (0.7, 1.5)])
def test_a_power_of_the_speed_passes_one_on_its_way(laboratory, monkeypatch, begun, planted):
    """Near one it does what viscous friction does, at any size: from both sides it ends where it was planted."""
    law = "nonlinear_viscous_friction"
    bench = laboratory.bench(laboratory.record([(law, "knee", [9.0], {"exponent": planted})]))
    start, steps, step = settle(bench, bench.effects), [], type(bench)._refine_step

    def counted(self, *args):
        steps.append(args)
        return step(self, *args)

    monkeypatch.setattr(type(bench), "_refine_step", counted)
    model = (*start.fit.effects, make_effect(law, "knee", exponent=begun))
    fit = bench.refine(model, start.noise, start=start.fit.parameters)
    number, (_, exponent) = next((k, f) for k, f in enumerate(fit.free_shapes) if f[0] == len(model) - 1)
    std = fit.std(len(fit.columns) + number) * (exponent.upper - exponent.lower)
    assert fit.effects[-1].exponent == pytest.approx(planted, abs=4.0 * std)
    assert std < 0.2
    amount = next(k for k, column in enumerate(fit.columns) if column.name == f"knee.{law}")
    assert fit.values[amount] == pytest.approx(9.0, abs=4.0 * fit.std(amount))
    assert len(steps) < 12


def test_only_what_is_anchored_in_the_friction_of_a_motor_moves_with_it():
    friction, other = make_effect("coulomb_friction", "hip"), make_effect("coulomb_friction", "knee")
    loss, away = (make_effect("load_dependent_friction", joint) for joint in ("hip", "knee"))
    sharper = make_effect("stribeck_friction", "hip", smoothing=0.5 * friction.smoothing)
    model = (friction, other, loss, away, sharper)
    there = moved_within(model, 0, friction.shapes[0], np.log(2.0))
    twice = 2.0 * friction.smoothing
    assert [e.smoothing for e in there] == pytest.approx(
        [twice, other.smoothing, twice, away.smoothing, sharper.smoothing]
    )
    order = make_effect("torque_ripple", "hip").shapes[0]
    ripple = make_effect("torque_ripple", "hip")
    assert moved_within((ripple, friction, loss), 0, order, 0.1)[1:] == (friction, loss)


def test_friction_that_turns_over_out_of_sight_is_brought_where_samples_tell_of_it():
    friction, link = make_effect("coulomb_friction", "hip"), make_effect("link_friction", "hip")
    loss, other = make_effect("load_dependent_friction", "hip"), make_effect("coulomb_friction", "knee")
    sharp = [replace(effect, smoothing=2e-4) for effect in (friction, loss, link, other)]
    slowest = {("hip", friction.side): 0.004, ("hip", link.side): 0.02, ("knee", friction.side): np.inf}
    found = turning_in_sight(sharp, slowest)
    # what is anchored in the friction of the motor goes with it; nothing slow is compared at the knee
    assert [effect.smoothing for effect in found] == pytest.approx([1.6e-3, 1.6e-3, 8e-3, 2e-4])
    assert turning_in_sight(sharp, slowest, only=2)[:2] == tuple(sharp[:2])
    assert turning_in_sight((friction, loss, link), slowest) == (friction, loss, link)


@pytest.mark.scenario
@pytest.mark.parametrize("joint", ["knee", "ankle"])
def test_friction_that_turned_over_out_of_sight_comes_back(laboratory, joint):
    """From a turn that no sample tells from a sharper one, the fit ends where it does from anywhere else."""
    quiet = SensorNoise(5e-6, 3e-6, link_resolution=6e-6, motor_resolution=3e-6, current=0.005, motor_torque=0.02)
    bench = laboratory.bench(laboratory.record(sensors=quiet))
    now, at = settle(bench, bench.effects), ("coulomb_friction", joint)
    effects = list(now.fit.effects)
    position = next(k for k, effect in enumerate(effects) if (effect.name, effect.joint) == at)
    effects[position] = replace(effects[position], smoothing=1e-4)
    lost = bench.fit(effects, now.noise, start=now.fit.parameters, tangents=False)
    assert lost.statistic > now.fit.statistic + 0.5
    found = bench.refine(effects, now.noise, start=now.fit.parameters)
    assert found.statistic == pytest.approx(now.fit.statistic, abs=0.1)
    assert found.effects[position].smoothing == pytest.approx(now.fit.effects[position].smoothing, rel=0.1)


@pytest.mark.parametrize("name", sorted(name for name, kind in effect_classes().items() if hasattr(kind, "smoothing")))
def test_a_model_whose_friction_moved_is_anchored_in_it_already(nothing_missing, name):
    """Whatever turns over at the speed that the friction does."""
    bench, now = nothing_missing
    effect = next(e for e in effect_classes()[name].instances(bench.robot) if e.joint == "knee")
    others = [e for e in now.fit.effects if (e.name, e.joint) != (name, "knee")]
    model = bench.anchored((*others, effect), now.fit.parameters)
    frictions = [k for k, e in enumerate(model) if (e.name, e.joint) == ("coulomb_friction", "knee")]
    moved_model = moved_within(model, frictions[0], model[frictions[0]].shapes[0], 0.3)
    assert moved_model != model
    assert bench.anchored(moved_model, now.fit.parameters) == moved_model


@pytest.mark.scenario
def test_a_loss_that_is_much_larger_than_the_friction_beside_it_settles(laboratory):
    """The speed around which both turn over is one shape of both: it swung from fit to fit, and the misfit by two."""
    sensors = SensorNoise(1e-5, 5e-6, link_resolution=0.0, motor_resolution=0.0, current=0.005)
    planted = [("load_dependent_friction", "hip", [0.3], {"smoothing": 0.01})]
    bench = laboratory.bench(laboratory.record(planted, sensors=sensors))
    start = settle(bench, bench.effects)
    model = (*start.fit.effects, make_effect("load_dependent_friction", "hip"))
    now = settle_again(bench, bench.refine(model, start.noise, start=start.fit.parameters))
    again = settle_again(bench, now.fit)
    assert again.fit.statistic == pytest.approx(now.fit.statistic, rel=0.02)
    friction = next(e for e in again.fit.effects if (e.name, e.joint) == ("coulomb_friction", "hip"))
    assert friction.smoothing == pytest.approx(0.01, rel=0.1)
    amount = again.fit.parameters["hip.load_dependent_friction"]
    told = uncertainties(bench, again)[[c.name for c in again.fit.columns].index("hip.load_dependent_friction")]
    assert amount == pytest.approx(0.3, abs=3.0 * told)


def test_a_shape_has_the_room_that_is_left_in_its_range():
    play = make_effect("backlash", "knee", half_width=0.01)
    width = next(shape for shape in play.shapes if shape.name == "half_width")
    low, high = room(play, width)
    assert low < 0.0 < high
    assert (moved(play, width, low).half_width, moved(play, width, high).half_width) == pytest.approx(
        (width.lower, width.upper)
    )
    assert room(make_effect("backlash", "knee", half_width=width.upper), width)[1] == 0.0
    assert moved(play, width, 1e4).half_width == width.upper
    push = make_effect("external_force", "knee", point_x=0.7)
    point = next(shape for shape in push.shapes if shape.name == "point_x")
    assert room(push, point) == pytest.approx((-1.2, 0.0))
    assert np.isfinite(room(push, point)).all()
