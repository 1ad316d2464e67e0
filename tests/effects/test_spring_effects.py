"""The springs of the paper (eq. 21), against the equation written out."""

import re
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from sea_ident.base_parameters import random_motion
from sea_ident.effects import Anchor, State, make_effect, spring_effects
from sea_ident.robot import load_robot, robot_from_text


def test_torque_of_the_annotated_springs_is_that_of_equation_21():
    leg = load_robot("exo_leg")
    motion = random_motion(leg, samples=50, seed=4)
    link, motor = np.zeros((50, leg.n)), np.zeros((50, leg.n))
    for effect in spring_effects(leg):
        rows, stated = effect.evaluate(State(leg, motion)), effect.prior(leg)
        link += rows.link @ stated
        motor += rows.motor @ stated
    deflection, rate = motion.theta - motion.q, motion.dtheta - motion.dq
    # the numbers that robots/exo_leg states
    stiffness, cubic, damping = np.array([[600.0, 200.0, 120.0], [15000.0, 8000.0, 4000.0], [5.0, 1.2, 0.25]])
    spring = stiffness * deflection + cubic * deflection**3 + damping * rate
    np.testing.assert_allclose(motor, spring, rtol=1e-12)
    np.testing.assert_allclose(link, -spring, rtol=1e-12)


def test_what_the_description_does_not_state_is_not_zero_but_unknown():
    leg = load_robot("exo_leg")
    bare = re.sub(r"<seriesElastic[^>]*/>", "<seriesElastic/>", leg.urdf)
    robot = robot_from_text(bare, "bare.urdf")
    assert robot.elastic == leg.elastic
    for effect in spring_effects(robot):
        assert np.all(np.isnan(effect.prior(robot)))


def test_widths_of_play_that_a_search_tries_leave_no_gap_where_the_deflection_keeps_its_sign():
    leg = load_robot("exo_leg")
    motion = random_motion(leg, samples=200, seed=4)
    # from 20 to 30 mrad: play below 20 never closes, and only its stiffness times its width shows
    theta = motion.q + 0.025 + 0.005 * np.sin(np.linspace(0.0, 2.0 * np.pi, 200))[:, None]
    one_way = replace(motion, theta=theta)
    plays = make_effect("backlash", "knee").variants(State(leg, one_way))
    softest = max(play.softness for play in plays)
    widths = [play.half_width for play in plays if play.softness < softest]
    assert np.all(np.diff(widths) > 0.0)
    assert {play.half_width for play in plays if play.softness == softest} < set(widths)
    assert np.max(np.array(widths[1:]) / np.array(widths[:-1])) <= 2.0 + 1e-9
    offset = 0.008 * 200.0
    fitting = [v for v in widths if v < 0.02 and make_effect("backlash", "knee", half_width=v).plausible(
        np.array([offset / v]), {"knee.spring_stiffness": 200.0})]  # fmt: skip
    assert len(fitting) >= 2


@pytest.mark.parametrize("exponent", [1.0, 1.5])
@pytest.mark.parametrize("kink", [-0.01, 0.0, 0.01])
def test_a_spring_with_two_sides_rests_without_torque_wherever_its_kink_is(kink, exponent):
    leg = load_robot("exo_leg")
    motion = random_motion(leg, samples=5, seed=4)
    d = np.array([-0.02, -0.01, 0.0, 0.01, 0.02])
    theta = motion.q.copy()
    theta[:, 1] += d
    spring = make_effect("asymmetric_spring", "knee", kink=kink, exponent=exponent)
    column = spring.evaluate(State(leg, replace(motion, theta=theta))).motor[:, 1, 0]
    np.testing.assert_allclose(column, np.abs(d - kink) ** exponent - np.abs(kink) ** exponent, atol=1e-12)
    assert column[2] == pytest.approx(0.0, abs=1e-12)


def on_one_side(sign):
    """Springs that are deflected by 0.02 to 0.03 rad of one sign."""
    leg = load_robot("exo_leg")
    motion = random_motion(leg, samples=200, seed=4)
    theta = motion.q + sign * (0.025 + 0.005 * np.sin(np.linspace(0.0, 2.0 * np.pi, 200))[:, None])
    return State(leg, replace(motion, theta=theta))


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_kink_that_is_not_passed_is_an_offset_and_a_stiffer_spring(sign):
    state = on_one_side(sign)
    column = make_effect("asymmetric_spring", "knee", kink=0.01 * sign).evaluate(state).motor[:, 1, 0]
    np.testing.assert_allclose(column, sign * state.motion.deflection[:, 1] - 0.02, rtol=1e-9)


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_kinks_nearer_to_rest_do_the_same_where_the_motion_is_on_one_side(sign):
    state = on_one_side(sign)

    both_sides = State(state.robot, random_motion(state.robot, samples=200, seed=4))

    def alike(spring, where=state):
        return [each.kink for each in spring.same_here(where)]

    spring = make_effect("asymmetric_spring", "knee", kink=0.018 * sign)
    np.testing.assert_allclose(alike(spring), sign * 0.02 * np.array([0.45, 0.225, 0.1125]), rtol=1e-3)
    # passed, beyond rest, curved, or a motion of both sides
    assert alike(replace(spring, kink=0.022 * sign)) == alike(replace(spring, kink=-0.01 * sign)) == []
    assert alike(replace(spring, exponent=2.0)) == alike(spring, both_sides) == []
    assert make_effect("spring_offset", "knee").same_here(state) == ()


def test_a_spring_of_two_straight_sides_pushes_back_on_both():
    spring = make_effect("asymmetric_spring", "knee", kink=0.01)
    assert spring.plausible(np.array([150.0]), {"knee.spring_stiffness": 200.0})
    assert not spring.plausible(np.array([-250.0]), {"knee.spring_stiffness": 200.0})


def test_play_in_series_leaves_the_torque_of_the_whole_spring_at_what_is_beyond_it():
    leg = load_robot("exo_leg")
    motion = random_motion(leg, samples=200, seed=4)
    play = make_effect("backlash", "knee", half_width=0.01, softness=1e-6)
    parameters = {"knee.spring_stiffness": 200.0, "knee.spring_stiffening": 8000.0}
    play = play.anchored(Anchor(leg, (), parameters))
    d = motion.deflection[:, 1]
    beyond = d - np.clip(d, -0.01, 0.01)
    torque = 200.0 * d + 8000.0 * d**3 + 200.0 * play.evaluate(State(leg, motion)).motor[:, 1, 0]
    np.testing.assert_allclose(torque, 200.0 * beyond + 8000.0 * beyond**3, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("softness", [0.05, 0.5, 1.5])
def test_soft_ends_of_play_are_met_with_a_logistic_spread(softness):
    """The mean of hard play over ends that lie a little elsewhere each: integrated numerically."""
    leg, width = load_robot("exo_leg"), 0.01
    motion = random_motion(leg, samples=40, seed=4)
    play = make_effect("backlash", "knee", half_width=width, softness=softness)
    d = 0.03 * np.sin(np.linspace(0.0, 2.0 * np.pi, 40))
    motion = replace(motion, theta=motion.q + d[:, None])
    ends = stats.logistic(scale=0.5 * softness * width)
    where = np.linspace(-30.0, 30.0, 40001) * ends.std()
    hard = np.clip(d[:, None] + where, -width, width)
    mean = np.trapezoid(hard * ends.pdf(where), where, axis=1)
    np.testing.assert_allclose(play.evaluate(State(leg, motion)).motor[:, 1, 0], -mean, atol=1e-9)


def test_ends_that_hardly_give_way_are_hard():
    leg = load_robot("exo_leg")
    motion = random_motion(leg, samples=200, seed=4)
    hard, nearly = (make_effect("backlash", "knee", half_width=0.01, softness=s) for s in (1e-9, 1e-5))
    torques = [play.evaluate(State(leg, motion)).motor for play in (hard, nearly)]
    np.testing.assert_allclose(*torques, atol=1e-8)


def test_kinks_that_the_motion_does_not_pass_are_tried_between_it_and_rest():
    leg = load_robot("exo_leg")
    motion = random_motion(leg, samples=200, seed=4)
    for sign in (1.0, -1.0):
        theta = motion.q + sign * (0.025 + 0.005 * np.sin(np.linspace(0.0, 2.0 * np.pi, 200))[:, None])
        springs = make_effect("asymmetric_spring", "knee").variants(State(leg, replace(motion, theta=theta)))
        kinks = [sign * spring.kink for spring in springs if spring.kink != 0.0]
        assert min(kinks) > 0.0
        assert np.sum(np.array(kinks) < 0.02) == 6  # four out of reach, and 0.15 and 0.3 of the largest
        assert max(kinks) < 0.02
    passed = make_effect("asymmetric_spring", "knee").variants(State(leg, motion))
    largest = np.max(np.abs(motion.deflection[:, 1]))
    assert {round(abs(spring.kink) / largest, 9) for spring in passed} == {0.0, 0.15, 0.3}


def test_play_follows_the_cubic_stiffness_only_where_the_spring_has_a_law():
    leg = load_robot("exo_leg")
    play = make_effect("backlash", "knee", cubic=7.0)

    def cubic(**values):
        parameters = {f"knee.{name}": value for name, value in values.items()}
        return play.anchored(Anchor(leg, (), parameters)).cubic

    assert cubic(spring_stiffness=200.0, spring_stiffening=8000.0) == 40.0
    assert cubic(spring_stiffness=200.0) == 0.0
    # a softening law would turn over within a few deflections: nothing that a spring in series does
    assert cubic(spring_stiffness=200.0, spring_stiffening=-8000.0) == 0.0
    # a bent fit is no law
    for stiffness in (0.0, -200.0):
        assert cubic(spring_stiffness=stiffness, spring_stiffening=8000.0) == 7.0


def test_the_stiffness_of_play_is_about_that_of_the_spring_it_is_in_series_with():
    play, spring = make_effect("backlash", "knee"), {"knee.spring_stiffness": 200.0, "hip.spring_stiffness": 2.0}
    assert [play.plausible(np.array([k]), spring) for k in (200.0, 100.0, 400.0)] == [True] * 3
    assert [play.plausible(np.array([k]), spring) for k in (50.0, 700.0, -200.0, 2.0)] == [False] * 4


def test_beside_the_cubic_stiffness_stands_one_other_power_and_none_beside_that():
    leg = load_robot("exo_leg")
    state = State(leg, random_motion(leg, samples=20, seed=4))
    cubic = make_effect("spring_stiffening", "knee")
    other = cubic.beside()
    assert other.beside() is None
    powers = {one.exponent for one in other.variants(state)}
    assert powers == {2.0, 5.0}  # neither the one that is in the model nor its neighbours, which are much like it
    for one in other.variants(state):
        assert {c.name for c in one.columns(leg)}.isdisjoint(c.name for c in cubic.columns(leg))
        assert np.all(np.isnan(one.prior(leg)))
    assert 3.0 in {one.exponent for one in cubic.variants(state)}
