"""Columns of bodies for all samples at once: against Pinocchio, sample by sample."""

import numpy as np
import pinocchio as pin
import pytest

from sea_ident.excitation.bodies import BodyColumns

ROBOTS = ["exo_leg", "ur10", "panda", "baxter arm", "tiago"]


def states(model, samples, seed=0):
    rng = np.random.default_rng(seed)
    return [rng.uniform(-2.0, 2.0, (model.nv, samples)) for _ in range(3)]


@pytest.mark.parametrize("name", ROBOTS)
def test_columns_are_those_of_pinocchio(robot_of, name):
    model = robot_of(name).extended_model
    x, v, a = states(model, 7)
    found = BodyColumns.of(model, np.arange(10 * (model.njoints - 1))).at(x, v, a).columns()
    data = model.createData()
    for k in range(7):
        expected = pin.computeJointTorqueRegressor(model, data, *(s[:, k].copy() for s in (x, v, a)))
        np.testing.assert_allclose(found[:, :, k], expected, atol=1e-12 * max(1.0, np.abs(expected).max()))


@pytest.mark.parametrize("name", ROBOTS)
def test_torque_and_its_derivatives_are_those_of_pinocchio(robot_of, name):
    """computeRNEADerivatives differentiates by other formulas (of the recursion, not of the columns)."""
    model = robot_of(name).extended_model
    x, v, a = states(model, 5, seed=1)
    motion = BodyColumns.torque(model).at(x, v, a)
    torque, slopes = motion.columns()[:, 0], motion.slopes()[:, :, 0]
    data = model.createData()
    for k in range(5):
        state = [s[:, k].copy() for s in (x, v, a)]
        by_q, by_v, by_a = pin.computeRNEADerivatives(model, data, *state)
        expected = np.hstack([by_q, by_v, np.triu(by_a) + np.triu(by_a, 1).T])
        scale = np.abs(expected).max()
        np.testing.assert_allclose(slopes[k], expected, atol=1e-11 * scale)
        np.testing.assert_allclose(torque[:, k], pin.rnea(model, data, *state), atol=1e-11 * np.abs(torque).max())


@pytest.mark.parametrize("name", ["exo_leg", "ur10", "panda"])
def test_slopes_match_central_differences(robot_of, name):
    model = robot_of(name).extended_model
    columns = BodyColumns.of(model, np.arange(10 * (model.njoints - 1)))
    state = states(model, 4, seed=2)
    slopes = columns.at(*state).slopes()
    step = 1e-4
    for s in range(3 * model.nv):

        def moved(steps, s=s):
            there = [part.copy() for part in state]
            there[s // model.nv][s % model.nv] += steps * step
            return columns.at(*there).columns().transpose(2, 0, 1)

        expected = (8.0 * (moved(1) - moved(-1)) - (moved(2) - moved(-2))) / (12.0 * step)
        np.testing.assert_allclose(slopes[..., s], expected, atol=1e-8 * max(1.0, np.abs(expected).max()))


@pytest.mark.parametrize("name", ROBOTS)
def test_pull_is_the_transpose_of_slopes(robot_of, name):
    model = robot_of(name).extended_model
    rng = np.random.default_rng(3)
    chosen = rng.permutation(10 * (model.njoints - 1))[:12]
    motion = BodyColumns.of(model, chosen).at(*states(model, 6, seed=4))
    slopes = motion.slopes()
    lever = rng.normal(size=(model.nv, 12, 6))
    expected = np.einsum("jpn,njps->sn", lever, slopes)
    np.testing.assert_allclose(motion.pull(lever), expected, atol=1e-11 * np.abs(expected).max())
    np.testing.assert_array_equal(motion.slopes(stride=2), slopes[::2])
