"""Every URDF of example-robot-data: used exactly, or refused with a reason that a user can act on."""

import re
import warnings

import numpy as np
import pytest
from independent_dynamics import energy_rank

from sea_ident.base_parameters import find_base_parameters, random_motion
from sea_ident.effects.rigid_bodies import RigidBodies
from sea_ident.effects.rotor_inertia import RotorInertia
from sea_ident.exceptions import RobotError, SeaIdentWarning
from sea_ident.regressor import build_regressor, inverse_dynamics, prior_parameters
from sea_ident.robot import Robot, example_robots_folder, load_robot

FOLDER = example_robots_folder()
URDFS = tuple(sorted(str(path.relative_to(FOLDER)) for path in FOLDER.rglob("*.urdf")))

# What cannot be identified, and the joints (if any) with which it can.
REFUSED = {
    "alex_description/urdf/alex_psyonic_hands.urdf": ("mimics 'index_q1', which does not exist", ("SpineYaw",)),
    "hector_description/robots/quadrotor_base.urdf": ("all its joints are fixed", None),
    "iris_description/robots/iris_simple.urdf": ("all its joints are fixed", None),
    "romeo_description/urdf/romeo.urdf": ("moves no mass: link .* give their <inertial>, or hold", ("LElbowRoll",)),
    "romeo_description/urdf/romeo_laas_small.urdf": ("negative principal moment .* correct", ("LElbowRoll_joint",)),
    "ur_description/urdf/ur3.urdf": ("has no <link>", None),
}


def load(source: str, joints: tuple[str, ...] | None = None) -> Robot:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        return load_robot(f"example:{source}", joints=joints)


def test_release_holds_the_robots_that_are_judged_here() -> None:
    assert len(URDFS) >= 69
    assert set(REFUSED) <= set(URDFS)


@pytest.mark.parametrize("source", [u for u in URDFS if u not in REFUSED])
def test_robot_is_used_exactly(source: str, capfd: pytest.CaptureFixture[str]) -> None:
    robot = load(source)
    assert robot.n == len(set(robot.joint_names)) > 0
    assert capfd.readouterr() == ("", "")  # no chatter of the URDF parser

    effects = (*RigidBodies.instances(robot), *RotorInertia.instances(robot))
    motion = random_motion(robot, 3, seed=8)
    regressor = build_regressor(robot, effects, motion)
    psi = np.nan_to_num(prior_parameters(robot, effects))
    torque = sum(inverse_dynamics(robot, motion))
    np.testing.assert_allclose(regressor.sum @ psi, torque, rtol=0.0, atol=1e-10 * max(np.abs(torque).max(), 1.0))


@pytest.mark.parametrize("source", [u for u in URDFS if u not in REFUSED])
def test_rank_equals_that_of_the_energy_model_and_the_grouping_holds(source: str) -> None:
    robot = load(source)
    effects = RigidBodies.instances(robot)
    base = find_base_parameters(robot, effects)
    assert base.rank == energy_rank(robot)
    assert base.gap > 1e6
    assert base.warnings == ()
    fresh = build_regressor(robot, effects, random_motion(robot, 3, seed=9)).sum
    psi = np.random.default_rng(0).normal(size=len(base.columns))
    torque = fresh @ psi
    grouped = fresh[:, :, base.independent] @ base.project(psi)
    np.testing.assert_allclose(grouped, torque, rtol=0.0, atol=1e-8 * np.abs(torque).max())


@pytest.mark.parametrize("source", REFUSED)
def test_robot_is_refused_with_a_reason(source: str, capfd: pytest.CaptureFixture[str]) -> None:
    reason, joints = REFUSED[source]
    with pytest.raises(RobotError, match=reason) as caught:
        load(source)
    assert str(caught.value).startswith(f"example:{source}: ")
    assert capfd.readouterr() == ("", "")
    if joints is not None:  # the way out that the message names
        assert "--joints" in str(caught.value)
        assert load(source, joints).joint_names == joints


def test_unknown_robot_gets_a_list_of_those_alike() -> None:
    with pytest.raises(RobotError, match=re.escape("ur_description/urdf/ur5_robot.urdf")):
        load_robot("example:ur_description/urdf/ur5.urdf")
