"""First moments that a level robot does not feel."""

import numpy as np
import pinocchio as pin
import pytest

from sea_ident import load_robot
from sea_ident.effects.unfelt_moments import unfelt_moments


@pytest.mark.parametrize(
    ("name", "expected"),
    [("exo_leg", []), ("emps", []), ("hebi_x5", ["plate.mx", "plate.my"])],
)
@pytest.mark.filterwarnings("ignore:.*no transmission")
def test_they_are_those_across_the_first_axis_where_that_is_upright(name, expected):
    robot = load_robot(name)
    moments = unfelt_moments(robot)
    assert [robot.inertial_names[int(np.argmax(moment))] for moment in moments] == expected
    for moment in moments:
        np.testing.assert_allclose(np.sort(np.abs(moment))[-2:], [0.0, 1.0], atol=1e-6)


def test_a_base_that_leans_feels_them_and_one_without_gravity_nothing():
    robot = load_robot("hebi_x5")
    gravity = np.asarray(robot.model.gravity.linear)
    assert unfelt_moments(robot.with_gravity(pin.exp3(np.array([0.1, 0.0, 0.0])) @ gravity)) == ()
    assert unfelt_moments(robot.with_gravity(np.zeros(3))) == ()
    # an axis given to seven digits is upright
    assert len(unfelt_moments(robot.with_gravity(pin.exp3(np.array([1e-7, 0.0, 0.0])) @ gravity))) == 2
