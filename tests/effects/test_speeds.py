"""Speeds that a search looks for friction at: those of the motion where that is slow, and the usual ones elsewhere."""

import numpy as np
import pytest

from sea_ident.discrepancy.bench.free_shapes import free_shapes, room
from sea_ident.discrepancy.bench.judge import at_a_bound
from sea_ident.effects import effect_from_dict, make_effect
from sea_ident.effects.speeds import SLOW, speed_scale
from sea_ident.effects.state import State
from sea_ident.motion import Motion
from sea_ident.robot import load_robot

USUAL = np.geomspace(0.01, 2.0, 8)


def swinging(robot, fastest):
    """Every joint to and fro with its own largest speed."""
    time = 0.005 * np.arange(1000)
    swing = np.sin(0.4 * np.pi * time)[:, None] * np.asarray(fastest)
    return State(robot, Motion.rigid(time, swing, swing, np.zeros_like(swing)))


def speeds(variants):
    return np.unique([variant.speed for variant in variants])


@pytest.mark.filterwarnings("ignore:emps")
@pytest.mark.parametrize(
    ("robot", "fastest", "scale"),
    [
        ("exo_leg", SLOW, 1.0),
        ("exo_leg", 3.0, 1.0),
        ("exo_leg", 0.0, 1.0),  # a joint at rest shows none, whatever the range
        ("exo_leg", 0.01234, 0.012),
        ("emps", 0.3, 0.3),  # a slide moves at tenths of what a joint turns at
    ],
)
def test_a_slow_joint_and_a_slide_have_ranges_of_their_own(robot, fastest, scale):
    robot = load_robot(robot)
    joint = robot.joint_names[0]
    state = swinging(robot, [fastest] + [1.0] * (robot.n - 1))
    friction = make_effect("stribeck_friction", joint)
    assert speed_scale(state, joint, state.motion.dtheta) == scale
    variants = friction.variants(state)
    np.testing.assert_allclose(speeds(variants), USUAL * scale, rtol=1e-12)
    assert scale != 1.0 or np.array_equal(speeds(variants), USUAL)
    assert {variant.exponent for variant in variants} == {0.5, 1.25, 2.0}


def test_a_fit_stays_in_the_range_of_the_motion_and_is_refused_at_its_end():
    leg = load_robot("exo_leg")
    slow = swinging(leg, [1.0, 0.1, 1.0])
    variants = make_effect("stribeck_friction", "knee").variants(slow)
    for end, rooms in ((variants[0], (0.0, np.log(200.0))), (variants[-1], (-np.log(200.0), 0.0))):
        speed = next(shape for _, shape in free_shapes((end,)) if shape.name == "speed")
        np.testing.assert_allclose(room(end, speed), rooms, atol=1e-12)
        assert at_a_bound(end)
        assert effect_from_dict(end.to_dict()) == end
    within = make_effect("stribeck_friction", "knee", speed=0.004)
    assert at_a_bound(within)
    assert not at_a_bound(within.on(slow))
