"""Limited torques are those of the equations of motion; their slopes those of central differences."""

from dataclasses import replace

import numpy as np
import pytest

from sea_ident.excitation.bodies import BodyColumns
from sea_ident.excitation.dynamic_limits import dynamic_limits
from sea_ident.motion import Motion
from sea_ident.robot import load_robot


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


def test_friction_of_links_is_not_called_absent(tmp_path):
    """What the prediction has is that of the link; only that of the motor is missing."""
    arm = tmp_path / "arm.urdf"
    arm.write_text(
        '<robot name="arm"><link name="base"/><link name="bar"><inertial><mass value="1"/><origin xyz="0.2 0 0"/>'
        '<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>'
        '<joint name="j" type="revolute"><parent link="base"/><child link="bar"/><axis xyz="0 1 0"/>'
        '<limit lower="-1" upper="1" velocity="2" effort="9"/><dynamics damping="0.8" friction="0.6"/></joint>'
        '<transmission name="t" type="sea_ident/SeriesElastic"><joint name="j"/><actuator name="m">'
        '<mechanicalReduction>50</mechanicalReduction></actuator><seriesElastic stiffness="100"/></transmission>'
        "</robot>"
    )
    notes: list[str] = []
    dynamic = dynamic_limits(load_robot(arm), load_robot(arm).limits, notes)
    assert [friction.link for friction in dynamic.friction] == [True]
    assert notes == [
        "torques are predicted without friction of the motors at j: the description gives that of the links alone; "
        "lower the torque limits by what friction may take"
    ]
