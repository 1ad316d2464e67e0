"""Saturation of a motor: the command follows from the torque that is left of it, whatever the power."""

from dataclasses import replace

import numpy as np
import pytest

from sea_ident.base_parameters import random_motion
from sea_ident.effects import State, make_effect
from sea_ident.robot import load_robot


@pytest.fixture(scope="module")
def motion():
    return random_motion(load_robot("exo_leg"), samples=60, seed=4)


@pytest.mark.parametrize("exponent", [2.0, 3.0, 4.5])
def test_what_is_taken_away_is_the_power_of_the_command(motion, exponent):
    leg = load_robot("exo_leg")
    effect = make_effect("torque_saturation", "knee", exponent=exponent)
    torque = effect.motor_torque(State(leg, motion))
    coefficient = 0.03 * np.max(np.abs(torque)) ** (1.0 - exponent)
    known = replace(effect, coefficient=coefficient, found_with=exponent)
    taken = known.evaluate(State(leg, motion)).motor[:, 1, 0]
    command = torque + coefficient * taken
    np.testing.assert_allclose(taken, np.sign(command) * np.abs(command) ** exponent, rtol=1e-9)
    np.testing.assert_array_equal(np.sign(taken), np.sign(torque))


def test_with_another_power_about_as_much_is_taken_away(motion):
    """Else a coefficient that belongs to one power would be absurd with the next: they differ by powers of a torque."""
    leg, cube = load_robot("exo_leg"), make_effect("torque_saturation", "knee")
    torque = cube.motor_torque(State(leg, motion))
    typical = np.sqrt(np.mean(torque**2))
    cube = replace(cube, coefficient=0.02 * typical**-2.0)
    # the power that is left of a command as large as usual, less what came of the power itself
    for exponent in (2.5, 4.0):
        other = replace(cube, exponent=exponent)
        own = replace(other, coefficient=0.02 * typical ** (1.0 - exponent), found_with=exponent)
        np.testing.assert_allclose(
            other.evaluate(State(leg, motion)).motor, own.evaluate(State(leg, motion)).motor, rtol=1e-9
        )


def test_the_unit_of_its_coefficient_follows_its_power():
    leg = load_robot("exo_leg")
    units = [make_effect("torque_saturation", "knee", exponent=p).columns(leg)[0].unit for p in (3.0, 3.5)]
    assert units == ["1/(N m)^2", "1/(N m)^2.5"]
