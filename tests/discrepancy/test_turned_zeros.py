"""A joint whose zero is another posture than the description says, as conventions of makers differ."""

import numpy as np
import pytest

from sea_ident import diagnose, identify, load_robot, simulate
from sea_ident.effects import make_effect
from sea_ident.motion import FourierSeries
from sea_ident.robot import Robot
from sea_ident.simulation import PlantedEffect

PERIOD = 5.0


def link(name: str, mass: float, along: float) -> str:
    """A body whose centre of mass is so far along x [m]."""
    inertia = f'ixx="0.004" iyy="{0.01 * mass}" izz="{0.011 * mass}" ixy="0.0003" ixz="0" iyz="0.0002"'
    inertial = f'<origin xyz="{along} 0.01 -0.02"/><mass value="{mass}"/><inertia {inertia}/>'
    return f'<link name="{name}"><inertial>{inertial}</inertial></link>'


def joint(name: str, parent: str, child: str, origin: str, axis: str) -> str:
    """A rigid joint with a motor."""
    return (
        f'<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/><origin {origin}/>'
        f'<axis xyz="{axis}"/><limit lower="-3" upper="3" velocity="5" effort="150"/></joint>'
        f'<transmission name="{name}_drive" type="transmission_interface/SimpleTransmission"><joint name="{name}"/>'
        f'<actuator name="{name}_motor"><mechanicalReduction>80</mechanicalReduction>'
        "<torqueConstant>0.08</torqueConstant><rotorInertia>4e-5</rotorInertia></actuator></transmission>"
    )


@pytest.fixture(scope="module")
def arm(tmp_path_factory) -> Robot:
    """Three rigid joints."""
    file = tmp_path_factory.mktemp("arm") / "arm.urdf"
    parts = (
        '<robot name="arm"><link name="base"/>',
        link("first", 3.0, 0.02),
        link("second", 2.5, 0.15),
        link("third", 1.5, 0.12),
        joint("turn", "base", "first", 'xyz="0 0 0.2" rpy="0.1 0.05 0"', "0 0 1"),
        joint("lift", "first", "second", 'xyz="0.05 0.03 0.1"', "0 1 0"),
        joint("bend", "second", "third", 'xyz="0.35 0 0" rpy="0.1 0 0"', "0 1 0"),
        "</robot>",
    )
    file.write_text("".join(parts))
    return load_robot(file)


@pytest.mark.scenario
@pytest.mark.filterwarnings("ignore:from the recorded reference")
@pytest.mark.parametrize("offset", [0.5 * np.pi, -1.2, 2.9])
def test_a_turned_zero_of_a_rigid_joint_is_named(arm, offset):
    """By its angle: beyond half a radian it ended at the end of its range, and was not in the library."""
    effect = PlantedEffect(make_effect("encoder_offset", "lift", offset=offset), np.zeros(0))
    recordings = []
    for seed, periods in ((1, 10), (2, 6)):
        a, b = np.random.default_rng(seed).normal(0.0, 0.4, (2, arm.n, 5)) / np.arange(1, 6) ** 0.8
        series = FourierSeries(1.0 / PERIOD, np.array([0.1, -0.3, 0.2]), a, b)
        recordings.append(simulate(arm, series, periods=periods, seed=seed, effects=[effect]).recording)
    first, second = recordings
    found = diagnose(identify(arm, first, period=PERIOD), first, holdout=second)
    assert (found.verdict, [(m.effect, m.joint) for m in found.missing]) == ("named", [("encoder_offset", "lift")])
    told = found.missing[0].parameters[0]
    assert told.value == pytest.approx(offset, abs=3.0 * told.std)
    assert told.std < 0.1
