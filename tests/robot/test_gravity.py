"""A robot that hangs or is mounted on a wall feels gravity from another side."""

import warnings

import numpy as np
import pinocchio as pin
import pytest
from typer.testing import CliRunner

from sea_ident import export_mjcf, export_urdf, identify, load_robot, read_model, simulate
from sea_ident.cli.app import app
from sea_ident.cli.inputs import read_robot
from sea_ident.effects import base_effects
from sea_ident.estimation.misplaced import misplaced_columns
from sea_ident.exceptions import RobotError, SeaIdentWarning
from sea_ident.motion import FourierSeries
from sea_ident.processing import process
from sea_ident.regressor import build_regressor, prior_parameters
from sea_ident.robot.load import robot_from_text

ARM = """<robot name="arm"><link name="base"/>{mount}
<link name="upper"><inertial><origin xyz="0.1 0.02 -0.01"/><mass value="2"/>
<inertia ixx="0.01" iyy="0.03" izz="0.03" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="fore"><inertial><origin xyz="0.15 0 0.03"/><mass value="1"/>
<inertia ixx="0.004" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="shoulder" type="revolute"><parent link="{foot}"/><child link="upper"/><axis xyz="0 0 1"/>
<limit lower="-2" upper="2" velocity="4" effort="40"/></joint>
<joint name="elbow" type="revolute"><parent link="upper"/><child link="fore"/><origin xyz="0.3 0 0"/><axis xyz="0 1 0"/>
<limit lower="-2" upper="2" velocity="4" effort="20"/></joint>
{drives}</robot>"""
DRIVES = "".join(
    f'<transmission name="{j}_drive" type="transmission_interface/SimpleTransmission"><joint name="{j}"/>'
    f'<actuator name="{j}_motor"><mechanicalReduction>50</mechanicalReduction><rotorInertia>2e-5</rotorInertia>'
    "</actuator></transmission>"
    for j in ("shoulder", "elbow")
)


def arm(gravity=None, rpy=None):
    """The arm, its base turned in the description or not."""
    mount, foot = "", "base"
    if rpy is not None:
        foot = "foot"
        mount = (
            '<link name="foot"/><joint name="mount" type="fixed"><parent link="base"/><child link="foot"/>'
            f'<origin rpy="{rpy[0]} {rpy[1]} {rpy[2]}"/></joint>'
        )
    text = ARM.format(mount=mount, foot=foot, drives=DRIVES)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        return robot_from_text(text, "arm.urdf", None, None, gravity)


def motion_of(robot):
    rng = np.random.default_rng(1)
    return FourierSeries(0.2, np.array([0.2, -0.3]), *(0.25 * rng.normal(size=(2, 2, 4)))).sample(samples=500)


def torque_of(robot):
    effects = base_effects(robot)
    return build_regressor(robot, effects, motion_of(robot)).sum @ np.nan_to_num(prior_parameters(robot, effects))


@pytest.mark.parametrize("rpy", [(np.pi / 2, 0.0, 0.0), (np.pi, 0.0, 0.0), (0.3, -0.7, 1.1)])
def test_gravity_of_the_base_is_a_base_that_is_turned(rpy):
    turned = pin.rpy.rpyToMatrix(*rpy)
    gravity = turned.T @ np.array([0.0, 0.0, -9.81])
    told, described = arm(gravity), arm(rpy=rpy)
    np.testing.assert_allclose(torque_of(told), torque_of(described), atol=1e-10)
    assert np.abs(torque_of(told) - torque_of(arm())).max() > 1.0
    np.testing.assert_array_equal(told.gravity, gravity)
    np.testing.assert_allclose(told.with_gravity((0.0, 0.0, -9.81)).gravity, arm().gravity)


@pytest.mark.parametrize(
    ("gravity", "said"),
    [
        ((0.0, -9.81), "give three numbers"),
        ((0.0, 0.0, float("nan")), "give three numbers"),
        (("down", 0.0, 0.0), "give three numbers"),
        ((0.0, 0.0, -9810.0), "9810 m/s2; is it in m/s2"),
        ((0.0, 0.0, -1e308), r"1e\+308 m/s2; is it in m/s2"),
    ],
)
def test_what_is_no_gravity_is_refused(gravity, said):
    with pytest.raises(RobotError, match=said):
        arm(gravity)


@pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")
def test_a_model_keeps_its_gravity(tmp_path):
    hanging = arm((0.0, 9.81, 0.0))
    recording = simulate(hanging, _series(), periods=3, seed=1).recording
    model = identify(hanging, recording, period=5.0)
    model.save(tmp_path / "model.json")
    again = read_model(tmp_path / "model.json").robot
    np.testing.assert_array_equal(again.gravity, (0.0, 9.81, 0.0))
    np.testing.assert_allclose(torque_of(again), torque_of(hanging))
    notes = [export_urdf(model, tmp_path / "out.urdf").notes, export_mjcf(model, tmp_path / "out.xml").notes]
    assert [sum("no place for gravity" in text and "--gravity=0,9.81,0" in text for text in n) for n in notes] == [1, 0]
    written = load_robot(tmp_path / "out.urdf", gravity=(0.0, 9.81, 0.0))
    assert written.joint_names == hanging.joint_names
    assert 'gravity="0.0 9.81 0.0"' in (tmp_path / "out.xml").read_text()


@pytest.mark.scenario
@pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")
@pytest.mark.parametrize("gravity", [(0.0, 9.81, 0.0), (-9.81, 0.0, 0.0), (0.0, 6.94, -6.94)])
def test_a_robot_on_a_wall_is_told_from_one_that_stands(gravity):
    recording = simulate(arm(gravity), _series(), periods=4, seed=1).recording
    standing = arm()
    said = misplaced_columns(standing, base_effects(standing), process(recording, standing, period=5.0))
    words = ", ".join(f"{value:.3g}" for value in gravity)
    assert f"gravity looks like ({words}) m/s2 in the root link, not (0, 0, -9.81)" in said
    assert f"--gravity={words.replace(' ', '')}" in said
    right = arm(gravity)
    assert misplaced_columns(right, base_effects(right), process(recording, right, period=5.0)) is None


@pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")
def test_a_tilt_of_some_degrees_is_no_wall():
    """Where no axis lies level the bodies, which are free, may be as light as that."""
    text = ARM.format(mount="", foot="base", drives=DRIVES).replace('<axis xyz="0 1 0"/>', '<axis xyz="0 0 1"/>')
    level = robot_from_text(text, "arm.urdf")
    tilted = level.with_gravity(pin.exp3(np.array([0.2, 0.1, 0.0])) @ np.array([0.0, 0.0, -9.81]))
    recording = simulate(tilted, _series(), periods=4, seed=1).recording
    assert misplaced_columns(level, base_effects(level), process(recording, level, period=5.0)) is None


def _series():
    rng = np.random.default_rng(2)
    return FourierSeries(0.2, np.array([0.2, -0.3]), *(0.25 * rng.normal(size=(2, 2, 4))))


def test_the_command_line_takes_gravity(tmp_path):
    path = tmp_path / "arm.urdf"
    path.write_text(ARM.format(mount="", foot="base", drives=DRIVES))
    runner = CliRunner()
    plain, wall = (runner.invoke(app, ["inspect", str(path), *more]) for more in ([], ["--gravity=9.81,0,0"]))
    assert plain.exit_code == wall.exit_code == 0
    assert plain.output != wall.output  # a shoulder whose axis stands upright feels no gravity
    with pytest.raises(RobotError, match="--gravity down: give three numbers"):
        read_robot(str(path), None, None, "down")


def test_shipped_robots_stand():
    np.testing.assert_array_equal(load_robot("exo_leg").gravity, (0.0, 0.0, -9.81))
