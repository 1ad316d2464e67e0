"""Gravity of a base that does not stand level, small angle or not."""

import numpy as np
import pinocchio as pin
import pytest

from sea_ident import load_robot
from sea_ident.effects import Anchor, State, base_effects, effect_from_dict, make_effect, spring_effects
from sea_ident.effects.base_tilt import level_axes, with_gravity
from sea_ident.motion import FourierSeries, Motion
from sea_ident.regressor import inverse_dynamics, model_columns, prior_parameters


@pytest.mark.parametrize("name", ["exo_leg", "exo_leg_abduction", "hebi_x5"])
@pytest.mark.parametrize("angles", [(0.002, -0.001), (0.12, 0.0), (-0.2, 0.35)])
def test_columns_times_angles_are_what_turned_gravity_does(name, angles):
    robot, generator = load_robot(name), np.random.default_rng(4)
    q, dq, ddq = generator.uniform(-1.0, 1.0, (3, 20, robot.n))
    motion = Motion(np.arange(20) / 100.0, q, dq, ddq, q, dq, ddq)
    plain = make_effect("base_tilt")
    effects = (*base_effects(robot), *spring_effects(robot), plain)
    names = [column.name for column in model_columns(robot, effects)]
    parameters = dict(zip(names, np.nan_to_num(prior_parameters(robot, effects)), strict=True))
    parameters.update(zip([c.name for c in plain.columns(robot)], angles, strict=True))
    ready = plain.anchored(Anchor(robot, effects, parameters))
    found = ready.evaluate(State(robot, motion)).link @ np.array(angles)
    turned = plain.modified(robot, np.array(angles))
    expected = inverse_dynamics(turned, motion)[0] - inverse_dynamics(robot, motion)[0]
    np.testing.assert_allclose(found, expected, atol=1e-9 * (1.0 + np.abs(expected).max()))
    assert effect_from_dict(ready.to_dict()) == ready


def test_a_tilt_that_no_base_has_is_not_followed():
    """Where gravity hardly shows, an estimate may be any; columns that vanish near a right angle would drive it off."""
    robot = load_robot("exo_leg")
    plain = make_effect("base_tilt")
    parameters = {column.name: value for column, value in zip(plain.columns(robot), (3.0, -40.0), strict=True)}
    assert plain.anchored(Anchor(robot, (plain,), parameters)).angles == (1.0, -1.0)


def test_an_axis_in_the_plane_of_a_robot_is_not_felt_however_the_plane_was_given():
    """By 1e-4 rad from upright the column would be all digits, and its angle of a rad or two anything."""
    leg = load_robot("exo_leg")
    axes = level_axes(np.asarray(leg.model.gravity.linear))
    motion = FourierSeries(0.2, np.zeros(leg.n), *np.random.default_rng(1).normal(0.0, 0.3, (2, leg.n, 3))).sample(50.0)
    tilt = make_effect("base_tilt")
    exact = tilt.evaluate(State(leg, motion)).link
    felt = int(np.argmax(np.linalg.norm(exact, axis=(0, 1))))
    # turned about the axis that is felt nothing changes in kind; about the other the plane is no upright one
    for turn, seen in ((1e-4, False), (1e-2, True)):
        leaning = with_gravity(leg, pin.exp3(turn * axes[1 - felt]) @ np.asarray(leg.model.gravity.linear))
        columns = tilt.evaluate(State(leaning, motion)).link
        sizes = np.linalg.norm(columns, axis=(0, 1))
        assert sizes[1 - felt] == 0.0 or seen
        assert sizes[felt] == pytest.approx(np.linalg.norm(exact[:, :, felt]), rel=1e-3)
    assert sizes[1 - felt] > 0.0
