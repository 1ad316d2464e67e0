"""The springs of the paper (eq. 21), against the equation written out."""

import re

import numpy as np

from sea_ident.base_parameters import random_motion
from sea_ident.effects import State, spring_effects
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
