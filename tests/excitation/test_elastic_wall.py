"""Linearised limits agree with the true ones where they were linearised, and so do their slopes."""

import numpy as np
import pytest
from test_elastic_limits import limits_of

from sea_ident.excitation.elastic_response import elastic_response
from sea_ident.excitation.elastic_wall import elastic_wall
from sea_ident.excitation.feasibility import at_rest
from sea_ident.excitation.walls import parabolic_overshoot
from sea_ident.motion import FourierSeries


@pytest.mark.parametrize("name", ["exo_leg", "baxter wrist"])
def test_room_and_slopes_are_true_where_they_were_taken(robot_of, name):
    robot = robot_of(name)
    limits = limits_of(robot, torque=np.full(robot.n, 80.0), jerk=np.full(robot.n, 500.0))
    rest = at_rest(np.full(robot.n, 0.05), 4)
    coefficients = rest + 0.02 * np.random.default_rng(2).normal(size=rest.shape)
    wall = elastic_wall(limits, FourierSeries.from_coefficients(coefficients, 0.2), rest)
    time = np.arange(64) / 64 * 5.0

    def true(coefficients):
        """Linear limits of the links, then torques without friction."""
        response = elastic_response(limits.springs, FourierSeries.from_coefficients(coefficients, 0.2))
        linear, motion = limits.linear, response.motion(time)
        rows = [response.links.evaluate(time, int(linear.derivative[k])) @ linear.joints[k] for k in range(len(linear))]
        return np.vstack([*rows, (limits.torques(motion) - limits.friction(motion)).T])

    here, m = true(coefficients), len(limits.linear)
    room = (wall.upper - wall.values(coefficients))[:m]
    inside = np.isfinite(room) & (limits.linear.upper[:, None] - here[:m] > 0.1)
    np.testing.assert_allclose(room[inside], (limits.linear.upper[:, None] - here[:m])[inside], rtol=1e-6, atol=1e-6)
    # what lies between the points of the grid is that of the links themselves
    for told, expected in zip(wall.overshoot(wall.values(coefficients)), parabolic_overshoot(here), strict=True):
        np.testing.assert_allclose(told, expected, atol=1e-9 * np.abs(here).max())
        assert np.any(expected > 0.0)
    change = 1e-5 * np.random.default_rng(5).normal(size=rest.shape)
    difference = (true(coefficients + change) - true(coefficients - change)) / 2.0
    along = wall.tangent(coefficients).push(change)
    scale = np.abs(difference).max(axis=1, keepdims=True)
    np.testing.assert_allclose(along / scale, difference / scale, rtol=0.0, atol=1e-5)
