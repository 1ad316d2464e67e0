"""Gravity of a base that does not stand level, small angle or not."""

import numpy as np
import pytest

from sea_ident import load_robot
from sea_ident.effects import Anchor, State, base_effects, effect_from_dict, make_effect, spring_effects
from sea_ident.motion import Motion
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
