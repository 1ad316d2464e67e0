"""Orders of ripple that a motion shows: up to four samples a period, whole turns of the motor among them."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from sea_ident.discrepancy.bench.free_shapes import room
from sea_ident.discrepancy.bench.judge import slowest
from sea_ident.effects import effect_from_dict, make_effect
from sea_ident.effects.orders import highest_order, motors_too_fast, orders
from sea_ident.effects.state import State
from sea_ident.exceptions import SeaIdentWarning
from sea_ident.motion import Motion
from sea_ident.robot import load_robot


@pytest.fixture(scope="module")
def leg():
    return load_robot("exo_leg")


def turning(leg, speeds, step=0.005):
    """Every joint turning at its own speed [rad/s]."""
    time = step * np.arange(2001)
    speed = np.ones((len(time), 1)) * np.asarray(speeds)
    return State(leg, Motion.rigid(time, time[:, None] * speed, speed, np.zeros_like(speed)))


def with_ratios(leg, ratio):
    """As much of the leg as is asked, with one gear at all joints."""
    return SimpleNamespace(joint_names=leg.joint_names, gear_ratios=np.full(leg.n, ratio), index=leg.index)


def test_the_highest_order_is_passed_with_four_samples_a_period(leg):
    state = turning(leg, [0.5, 1.0, 2.0])
    for joint, speed in zip(leg.joint_names, (0.5, 1.0, 2.0), strict=True):
        highest = highest_order(state, joint)
        assert 2.0 * np.pi / (highest * speed * 0.005) == pytest.approx(4.0)
        assert max(orders(state, joint, 300)) <= highest


def test_motors_that_turn_too_fast_have_no_ripple_of_theirs_in_the_search(leg):
    ratios = dict(zip(leg.joint_names, leg.gear_ratios, strict=True))
    limit = [2.0 * np.pi / (4.0 * 0.005 * ratio) for ratio in ratios.values()]
    slow, fast = turning(leg, [0.9 * v for v in limit]), turning(leg, [0.9 * limit[0], 1.1 * limit[1], 0.9 * limit[2]])
    assert motors_too_fast(slow) == ()
    assert motors_too_fast(fast) == (leg.joint_names[1],)
    for state, there in ((slow, True), (fast, False)):
        tried = {one.order for one in make_effect("torque_ripple", leg.joint_names[1]).variants(state)}
        assert (ratios[leg.joint_names[1]] in tried) is there


def test_a_motor_without_a_gear_has_no_turns_of_its_own(leg):
    """However fast: its ripple is one of the joint, whose orders are looked for as far as the samples show them."""
    direct = replace(turning(leg, [500.0] * 3), robot=with_ratios(leg, 1.0))
    assert highest_order(direct, leg.joint_names[0]) < 1.0
    assert motors_too_fast(direct) == ()
    assert motors_too_fast(replace(direct, robot=with_ratios(leg, 2.0))) == leg.joint_names


def test_the_highest_order_is_that_of_all_but_the_fastest_tenth(leg):
    state = turning(leg, [1.0] * 3)
    speed = state.motion.dtheta.copy()
    speed[:1800] *= 0.5
    other = replace(state, motion=replace(state.motion, dtheta=speed))
    assert highest_order(other, "hip") == pytest.approx(highest_order(state, "hip"))
    speed = speed.copy()
    speed[:1850] = 0.5
    slower = replace(state, motion=replace(state.motion, dtheta=speed))
    assert highest_order(slower, "hip") == pytest.approx(2.0 * highest_order(state, "hip"))


@pytest.mark.filterwarnings("ignore:emps")
@pytest.mark.parametrize("name", ["torque_ripple", "position_dependent_friction"])
def test_a_fit_can_follow_every_wave_that_a_short_way_of_a_slide_shows_up_and_down(name):
    with pytest.warns(SeaIdentWarning, match="no transmission"):
        slide = load_robot("emps")
    time = 0.005 * np.arange(1000)
    way = 0.015 * np.sin(0.4 * np.pi * time)[:, None]
    state = State(slide, Motion.rigid(time, way, np.gradient(way, time, axis=0), np.zeros_like(way)))
    variants = make_effect(name, "slider").variants(state)
    assert max(one.order for one in variants) > 2500.0
    for one in variants:
        down, up = room(one, one.ranges[0])
        assert down < 0.0 < up


@pytest.mark.parametrize("name", ["torque_ripple", "position_dependent_friction"])
def test_a_wave_on_a_slide_is_no_straight_line_over_its_way(name):
    """On a way of 0.2 m a wave of half an order per metre is a constant and a slope, which other effects are."""
    with pytest.warns(SeaIdentWarning, match="no transmission"):
        slide = load_robot("emps")
    time = 0.005 * np.arange(2001)
    q = 0.1 * np.sin(2.0 * np.pi * 0.2 * time)[:, None]
    speed = np.gradient(q[:, 0], time)[:, None]
    state = State(slide, Motion.rigid(time, q, speed, np.zeros_like(speed)))
    tried = make_effect(name, "slider").variants(state)
    assert min(each.order for each in tried) == pytest.approx(10.0)
    assert {each.ranges[0].lower for each in tried} == {5.0}
    assert slowest(replace(tried[0], order=5.05))
    assert not slowest(tried[0])
    # the range comes back from a file
    assert effect_from_dict(tried[0].to_dict()).ranges == tried[0].ranges


def test_a_joint_that_turns_keeps_the_order_of_its_turns(leg):
    tried = make_effect("torque_ripple", "hip").variants(turning(leg, [0.01, 0.01, 0.01]))
    assert {each.ranges[0].lower for each in tried} == {0.5}
