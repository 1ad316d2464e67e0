"""The bound on log det: above every motion, and its conditions hold along motions."""

import warnings

import numpy as np
import pytest

from sea_ident.effects import make_effect
from sea_ident.exceptions import ExcitationError, SeaIdentWarning
from sea_ident.excitation import design_excitation
from sea_ident.excitation.efficiency import _FINEST, _States, bound_log_det
from sea_ident.motion import FourierSeries


@pytest.fixture(scope="module")
def emps(robot_of):
    robot = robot_of("emps")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        designs = [design_excitation(robot, harmonics=4, starts=2, rate=50.0, seed=seed) for seed in range(3)]
    return robot, designs


def test_conditions_hold_along_every_periodic_motion(robot_of):
    """Means of total derivatives vanish; the band inequality is positive."""
    robot = robot_of("exo_leg")
    box = _States(robot, (make_effect("rigid_bodies"),), 0.1, 4)
    rng = np.random.default_rng(0)
    for _ in range(3):
        series = FourierSeries(0.1, *(rng.normal(size=3),), *(0.3 * rng.normal(size=(2, 3, 4))))
        motion = series.sample(samples=100)
        x = (np.hstack([motion.q, motion.dq, motion.ddq]) - box.middle) / box.half
        conditions = box.conditions(x)
        mean = conditions.mean(axis=0)
        np.testing.assert_allclose(mean[:-3], 0.0, atol=1e-12 * np.abs(conditions).max())
        assert np.all(mean[-3:] > 0.0)


def test_no_motion_in_the_box_leaves_the_states_that_can_be_reached(robot_of):
    """Random motions, scaled until they touch a limit of the box: nothing of them is cut."""
    robot = robot_of("exo_leg")
    box = _States(robot, (make_effect("rigid_bodies"),), 0.1, 4)
    rng = np.random.default_rng(1)
    for _ in range(20):
        order = np.arange(1, 5) if rng.random() < 0.5 else np.array([1, 8, 27, 64])
        waves = rng.normal(size=(2, 3, 4)) * order
        series = FourierSeries(0.1, np.zeros(3), *waves)
        motion = series.sample(samples=2000)
        # every joint touches one of its own limits of position, velocity or acceleration
        low, high = motion.q.min(axis=0), motion.q.max(axis=0)
        sizes = [0.5 * (high - low), np.abs(motion.dq).max(axis=0), np.abs(motion.ddq).max(axis=0)]
        factor = np.min([half / size for half, size in zip(box.half.reshape(3, 3), sizes, strict=True)], axis=0)
        q = box.middle[:3] + factor * (motion.q - 0.5 * (low + high))
        x = (np.hstack([q, factor * motion.dq, factor * motion.ddq]) - box.middle) / box.half
        # squared, as the inequalities are: near its turning point a speed hangs on the last digits of the position
        np.testing.assert_allclose(box.reached(x) ** 2, x**2, atol=1e-3)
    corner = box.reached(np.ones((1, 9)))[0]
    np.testing.assert_array_equal(corner[3:6], 0.0)
    assert np.all(corner[6:] > 0.0)


def test_no_design_exceeds_the_bound(emps):
    robot, designs = emps
    bound = bound_log_det(robot, designs[0], states=300)
    best = max(design.log_det for design in designs)
    assert best < bound.log_det < best + 3.0
    assert 0.3 < bound.efficiency(best) < 1.0
    assert bound.slack < 0.02


def test_bound_of_one_column_is_its_largest_mean_square(robot_of):
    """Viscous friction alone: log of N times the largest mean of v^2, which cannot exceed the square of its limit."""
    robot = robot_of("emps")
    effects = (make_effect("viscous_friction", "slider"),)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        design = design_excitation(robot, harmonics=3, starts=1, rate=50.0, effects=effects)
    bound = bound_log_det(robot, design, effects=effects, states=200)
    box = _States(robot, effects, 0.1, 3)
    # to the accuracy with which the multipliers are found
    assert bound.log_det <= np.log(design.samples * box.half[1] ** 2) + _FINEST
    assert bound.log_det >= design.log_det


def test_too_few_states(emps):
    robot, designs = emps
    with pytest.raises(ExcitationError, match="3 columns need at least 12"):
        bound_log_det(robot, designs[0], states=5)
