"""Limited torques are those of the equations of motion; their slopes those of central differences."""

from dataclasses import replace

import numpy as np
import pytest

from sea_ident.excitation.bodies import BodyColumns
from sea_ident.excitation.dynamic_limits import dynamic_limits
from sea_ident.motion import Motion


@pytest.mark.parametrize("name", ["exo_leg", "quanser_2dof", "emps", "baxter wrist"])
def test_torques_and_slopes(robot_of, name):
    robot = robot_of(name)
    limits = robot.limits.replace(torque=np.full(robot.n, 50.0))
    dynamic = dynamic_limits(robot, limits, [])
    rng = np.random.default_rng(0)
    states = [rng.normal(size=(7, robot.n)) for _ in range(3)]

    def torques(states):
        return dynamic.evaluate(Motion.rigid(np.arange(7.0), *states), derivatives=False)[0]

    torque, slopes = dynamic.evaluate(Motion.rigid(np.arange(7.0), *states))
    np.testing.assert_allclose(torque, torques(states), rtol=0.0, atol=1e-12 * np.abs(torque).max())
    # without friction: the columns of all bodies with their own parameters, computed without Pinocchio's RNEA
    both = robot.link_map + robot.motor_map
    x, v, a = (both @ part.T for part in states)
    bodies = BodyColumns.torque(robot.extended_model).at(x + robot.offset[:, None], v, a).columns()[:, 0].T
    frictionless = replace(dynamic, friction=())
    plain = frictionless.evaluate(Motion.rigid(np.arange(7.0), *states), derivatives=False)[0]
    np.testing.assert_allclose(plain, bodies @ dynamic.fold, rtol=0.0, atol=1e-11 * np.abs(plain).max())
    for order in range(3):
        for i in range(robot.n):
            there, back = (
                [part + sign * 1e-6 * (k == order) * np.eye(robot.n)[i] for k, part in enumerate(states)]
                for sign in (1.0, -1.0)
            )
            difference = (torques(there) - torques(back)) / 2e-6
            np.testing.assert_allclose(
                slopes[:, :, order * robot.n + i], difference, rtol=0.0, atol=2e-8 * np.abs(slopes).max() + 1e-7
            )
