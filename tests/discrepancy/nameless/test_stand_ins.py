"""Effects that were found without what makes them what they are.

Torque is added to that of a leg that has nothing but what the model has, on its motion as it was measured.
"""

import warnings
from dataclasses import replace

import numpy as np
import pytest

from sea_ident import load_robot
from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.judge import slowest
from sea_ident.discrepancy.bench.settle import Settled, settle, settle_again
from sea_ident.discrepancy.nameless.stand_ins import NOTHING, stand_ins, too_slow
from sea_ident.discrepancy.search.search import Selection
from sea_ident.effects import Effect, make_effect
from sea_ident.exceptions import SeaIdentWarning

KNEE = 1


def ripple_found(start_bench: Bench, torque: np.ndarray, order: float) -> tuple[Bench, Selection]:
    """What a search would give that found a ripple at the knee where a torque (N,) of its motor is not in the model."""
    total = start_bench.data.tau_motor.copy()
    total[:, KNEE] += torque
    bench = Bench(replace(start_bench.data, tau_motor=total), start_bench.effects)
    return bench, found(bench, make_effect("torque_ripple", "knee", order=order))


def found(bench: Bench, effect: Effect) -> Selection:
    """What a search would give that found this."""
    start = settle(bench, bench.effects)
    begun = bench.anchored((*start.fit.effects, effect), start.fit.parameters)
    fit = bench.refine(begun, start.noise, start=start.fit.parameters, only=len(bench.effects))
    return Selection(start, settle_again(bench, fit), 1, (0.0,))


@pytest.fixture(scope="module")
def angle(nothing_missing):
    """(N,) angle of the motor from the middle of its path, and how far that is to either side [rad]."""
    theta = nothing_missing[0].data.motion.theta[:, KNEE]
    away = theta - 0.5 * (theta.max() + theta.min())
    return away, float(away.max())


@pytest.mark.scenario
def test_what_changes_along_the_path_is_no_ripple(nothing_missing, angle):
    away, reach = angle
    spring = 2.0 * (away / reach) + 1.0 * (away / reach) ** 2 + 0.15 * np.sin(9.0 * away)
    bench, selection = ripple_found(nothing_missing[0], spring, 0.6)
    assert slowest(selection.effects[0])
    (wave,) = stand_ins(bench, selection)
    assert (wave.effect, wave.joint) == ("torque_ripple", "knee")
    assert "nothing in it turns so slowly" in wave.sentence


@pytest.mark.scenario
def test_a_wave_of_which_the_motion_shows_but_a_part_keeps_its_name(nothing_missing, angle):
    """It ended as the longest too, but with nothing left beside it."""
    bench, selection = ripple_found(nothing_missing[0], np.sin(0.45 * angle[0] + 0.4), 0.5)
    assert slowest(selection.effects[0])
    assert stand_ins(bench, selection) == ()


def test_a_straight_line_through_the_zero_of_an_encoder_is_no_ripple(nothing_missing):
    """A wrong gear ratio makes one, and nothing is left beside it."""
    theta = nothing_missing[0].data.motion.theta[:, KNEE]
    bench, selection = ripple_found(nothing_missing[0], 2.0 * np.sin(0.5 * theta), 0.5)
    assert selection.effects[0].order < 1.0
    (wave,) = stand_ins(bench, selection)
    assert "a wrong gear ratio" in wave.sentence


def test_a_slow_wave_of_a_slide_is_told_without_turns():
    said = too_slow(quietly(load_robot, "emps"), make_effect("torque_ripple", "slider"))
    assert said == "as hardly more than a straight line over the way of the joint"


def quietly(function, *args):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        return function(*args)


@pytest.mark.scenario
def test_a_short_wave_keeps_its_name_where_something_else_is_missing(nothing_missing, angle):
    away, reach = angle
    bench, selection = ripple_found(nothing_missing[0], np.sin(12.0 * away) + (away / reach) ** 2, 12.0)
    assert selection.final.fit.statistic > 2.0 * selection.final.fit.dof
    assert stand_ins(bench, selection) == ()


@pytest.mark.scenario
@pytest.mark.parametrize(("planted", "said"), [("position_delay", 1), ("link_friction", 0)])
def test_a_late_encoder_is_no_friction_of_the_link(laboratory, planted, said):
    """It looks viscous, but for the inertia that comes late too."""
    how = {"position_delay": ((), {"delay": 0.004}), "link_friction": ((0.25, 0.15), {})}[planted]
    bench = laboratory.bench(laboratory.record([(planted, "ankle", *how)]))
    there = stand_ins(bench, found(bench, make_effect("link_friction", "ankle")))
    assert len(there) == said
    assert all("viscous alone" in one.sentence for one in there)


@pytest.mark.scenario
@pytest.mark.parametrize(("stiffness", "said"), [(0.0, 1), pytest.param(4.0, 0, marks=pytest.mark.slow)])
def test_a_parallel_spring_without_stiffness_is_none(laboratory, stiffness, said):
    bench = laboratory.bench(laboratory.record([("parallel_spring", "knee", (stiffness, 0.5), {})]))
    there = stand_ins(bench, found(bench, make_effect("parallel_spring", "knee")))
    assert len(there) == said
    assert all("without any stiffness" in one.sentence for one in there)


@pytest.mark.scenario
@pytest.mark.parametrize(("values", "said"), [((45.0, 9.0), 0), pytest.param((0.0, 5.0), 1, marks=pytest.mark.slow)])
def test_a_parallel_spring_is_one_where_the_motion_is_too_small_to_tell_its_stiffness(small_motions, values, said):
    """It was said to have none, and not to be in the library: nothing is zero that is known that badly."""
    joint = "knee" if said else "hip"
    bench = small_motions.bench(small_motions.record([("parallel_spring", joint, values, {})]))
    selection = found(bench, make_effect("parallel_spring", joint))
    fit = selection.final.fit
    stiffness = fit.values[len(fit.values) - 2]
    assert abs(stiffness - values[0]) < NOTHING * fit.std(len(fit.values) - 2)
    assert abs(stiffness) < NOTHING * fit.std(len(fit.values) - 2)
    assert len(stand_ins(bench, selection)) == said


@pytest.mark.scenario
@pytest.mark.parametrize(("taken", "said"), [(200.0, 0), (110.0, 1)])
def test_a_spring_that_is_softer_in_its_middle_has_no_play(laboratory, taken, said):
    """Play takes up just what its spring has, 200 N m/rad."""
    shape = {"half_width": 0.005, "softness": 0.05, "cubic": 40.0 if said == 0 else 0.0}
    bench = laboratory.bench(laboratory.record([("backlash", "knee", (taken,), shape)]))
    there = stand_ins(bench, found(bench, make_effect("backlash", "knee", half_width=0.004)))
    assert len(there) == said
    assert all("takes up just what its spring has" in one.sentence for one in there)


def test_play_that_is_never_closed_is_in_any_spring(laboratory, nothing_missing):
    """Then only its stiffness times its width shows, and half the width makes it twice as stiff."""
    bench, start = nothing_missing
    least = float(np.min(np.abs(bench.data.motion.deflection[:, 0])))
    play = make_effect("backlash", "hip", half_width=0.5 * least)
    fit = bench.fit((*start.fit.effects, play), start.noise, start=start.fit.parameters)
    values = fit.values.copy()
    values[-1] = 2.0 * fit.parameters["hip.spring_stiffness"]
    for width, said in ((0.5 * least, 0), (1.5 * least, 1)):
        effects = (*fit.effects[:-1], replace(play, half_width=width))
        held = replace(fit, effects=effects, values=values)
        there = stand_ins(bench, Selection(start, Settled(held, start.noise), 1, (0.0,)))
        assert len(there) == said
