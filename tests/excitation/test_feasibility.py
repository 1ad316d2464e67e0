"""Limits that exclude each other, positions well inside, trajectories repaired."""

import re

import numpy as np
import pytest

from sea_ident.exceptions import InfeasibleError
from sea_ident.excitation.feasibility import at_rest, inner_position, random_start, repair, shrink
from sea_ident.excitation.linear_limits import linear_limits
from sea_ident.motion import FourierSeries


def with_combination(robot, rows, lower, upper, names):
    return robot.limits.replace(
        combinations=np.array(rows, dtype=float),
        combination_lower=np.array(lower, dtype=float),
        combination_upper=np.array(upper, dtype=float),
        combination_names=names,
    )


def test_conflict_is_named_with_the_slack_it_needs(robot_of):
    """hip <= 0.698, knee <= 0: hip + knee >= 1 lacks 0.302 in all, 0.1006 if each of the three gives its part."""
    robot = robot_of("exo_leg")
    limits = with_combination(robot, [[1, 1, 0], [0, 0, 1]], [1.0, -1.0], [np.inf, 3.0], ("sum", "ankle_again"))
    with pytest.raises(InfeasibleError) as caught:
        inner_position(linear_limits(robot, limits))
    text = str(caught.value)
    assert all(name in text for name in ("hip.position", "knee.position", "sum in [1, inf]"))
    assert "ankle" not in text
    slack = float(re.search(r"more than ([\d.e-]+) rad", text)[1])
    assert slack == pytest.approx((1.0 - 2.0 * np.pi / 9.0) / 3.0, rel=1e-3)
    wider = robot.limits.upper.copy()
    wider[:2] += 1.01 * slack
    inner_position(
        linear_limits(robot, limits.replace(upper=wider, combination_lower=np.array([1.0 - 1.01 * slack, -1.0])))
    )


@pytest.mark.parametrize("name", ["exo_leg", "ur10", "panda", "tiago"])
def test_inner_position_is_inside(robot_of, name):
    robot = robot_of(name)
    limits = linear_limits(robot, robot.limits)
    position = inner_position(limits)
    margins = limits.margins(FourierSeries.from_coefficients(at_rest(position, 2), 0.1))
    assert np.all(margins > 0.0)


@pytest.mark.parametrize("harmonics", [1, 5, 10])
def test_random_starts_are_inside_for_all_t(robot_of, harmonics):
    robot = robot_of("exo_leg")
    limits = linear_limits(robot, robot.limits)
    centre = at_rest(inner_position(limits), harmonics)
    starts = []
    for seed in range(4):
        point = random_start(limits, 0.1, centre, np.random.default_rng(seed))
        starts.append(point)
        assert np.all(limits.margins(FourierSeries.from_coefficients(point, 0.1)) >= -1e-12)
        assert np.abs(point[:, :-1]).max() > 0.05
    assert len({round(float(start[0, 0]), 9) for start in starts}) == 4


def test_repair_leaves_a_feasible_trajectory_alone_and_is_nearest(robot_of):
    robot = robot_of("exo_leg")
    limits = linear_limits(robot, robot.limits)
    centre = at_rest(inner_position(limits), 5)
    inside = centre + 0.5 * (random_start(limits, 0.1, centre, np.random.default_rng(0)) - centre)
    np.testing.assert_allclose(repair(limits, 0.1, centre, inside), inside, atol=1e-5)
    wish = centre + 3.0 * (inside - centre)
    nearest = repair(limits, 0.1, centre, wish)
    straight = centre + shrink(limits, FourierSeries.from_coefficients(wish, 0.1), centre[:, -1]) * (wish - centre)
    weight = np.ones(wish.shape)
    weight[:, -1] = (0.2 * np.pi) ** 2

    def distance(x):
        return float((weight * (x - wish) ** 2).sum())

    assert distance(nearest) < distance(straight)
    # no feasible point on the way to others is nearer: the gradient of the distance points out of the set
    for seed in range(5):
        other = random_start(limits, 0.1, centre, np.random.default_rng(seed))
        assert (weight * (nearest - wish) * (other - nearest)).sum() > -1e-2 * distance(nearest)


def test_shrink_is_exact(robot_of):
    robot = robot_of("exo_leg")
    limits = linear_limits(robot, robot.limits)
    position = inner_position(limits)
    centre = at_rest(position, 3)
    wish = centre + np.random.default_rng(3).normal(size=centre.shape)
    factor = shrink(limits, FourierSeries.from_coefficients(wish, 0.1), position)
    assert 0.0 < factor < 1.0
    margins = limits.margins(FourierSeries.from_coefficients(centre + factor * (wish - centre), 0.1))
    assert margins.min() == pytest.approx(0.0, abs=1e-12)
