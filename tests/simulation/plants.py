"""Robots, references and drives for the tests of the simulation."""

import warnings
from dataclasses import dataclass

import numpy as np

from sea_ident import FourierSeries, Robot, SeaIdentWarning, load_robot
from sea_ident.robot import robot_from_text
from sea_ident.simulation import Controller, Drive

LEFT_ARM = tuple(f"left_{name}" for name in ("s0", "s1", "e0", "e1", "w0", "w1", "w2"))


def modest_series(robot, base_frequency=0.5, harmonics=3, share=0.4, seed=1):
    """Small harmonics around mid-range, inside the position limits (3 rad apart where there are none)."""
    rng = np.random.default_rng(seed)
    lower, upper = np.clip(robot.limits.lower, -1.5, 1.5), np.clip(robot.limits.upper, -1.5, 1.5)
    a, b = rng.standard_normal((2, robot.n, harmonics))
    series = FourierSeries(base_frequency, (lower + upper) / 2.0, a, b)
    reach = np.abs(series.sample(200.0).q - series.offset).max(axis=0)
    scale = (share * (upper - lower) / 2.0 / reach)[:, None]
    return FourierSeries(base_frequency, series.offset, a * scale, b * scale)


def quietly(load, *args, **options) -> Robot:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        return load(*args, **options)


def ur10() -> Robot:
    return quietly(load_robot, "example:ur_description/urdf/ur10_robot.urdf")


def baxter_arm() -> Robot:
    return quietly(load_robot, "example:baxter_description/urdf/baxter.urdf", annotation="baxter_sea", joints=LEFT_ARM)


def from_parts(*parts: str) -> Robot:
    return quietly(robot_from_text, f'<robot name="test">{"".join(parts)}</robot>', "test.urdf")


def link(name: str, com: str = "0 0 -0.3", mass: float = 2.0) -> str:
    return (
        f'<link name="{name}"><inertial><origin xyz="{com}"/><mass value="{mass}"/>'
        '<inertia ixx="0.03" iyy="0.04" izz="0.02" ixy="0.001" ixz="0.002" iyz="0.003"/></inertial></link>'
    )


def joint(name: str, parent: str, child: str, axis: str, more: str = "") -> str:
    return (
        f'<joint name="{name}" type="revolute"><origin xyz="0.05 0.02 -0.4"/><parent link="{parent}"/>'
        f'<child link="{child}"/><axis xyz="{axis}"/><limit lower="-1" upper="1" velocity="5" effort="100"/>'
        f"{more}</joint>"
    )


def motor(joint_name: str, spring: str | None, numbers: str = "") -> str:
    kind = "transmission_interface/SimpleTransmission" if spring is None else "sea_ident/SeriesElastic"
    elastic = "" if spring is None else f"<seriesElastic {spring}/>"
    return (
        f'<transmission name="{joint_name}_drive" type="{kind}"><joint name="{joint_name}"/>'
        f'<actuator name="{joint_name}_motor"><mechanicalReduction>80</mechanicalReduction>'
        f"<rotorInertia>3e-5</rotorInertia>"
        f"{numbers or '<viscousFriction>0.4</viscousFriction><coulombFriction>0.6</coulombFriction>'}"
        f"</actuator>{elastic}</transmission>"
    )


def mixed_arm() -> Robot:
    """Elastic, rigid with motor, rigid without motor and mimicked by a fourth; axes that are not parallel."""
    return from_parts(
        link("base"), link("one"), link("two", "0.1 0 -0.2"), link("three", "0 0.05 -0.1", 1.0), link("four", mass=0.5),
        joint("a", "base", "one", "0 1 0"), joint("b", "one", "two", "1 0 0"), joint("c", "two", "three", "0 0 1"),
        joint("d", "three", "four", "0 1 0", '<mimic joint="c" multiplier="-0.5" offset="0.2"/>'),
        motor("a", 'stiffness="300" cubicStiffness="2000" damping="1.5"'), motor("b", None),
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Wave(Controller):
    """A cosine of torque at chosen joints and the gains given, whatever the reference."""

    torque: tuple[float, ...]
    rate: float
    position_gain: tuple[float, ...]
    velocity_gain: tuple[float, ...]

    def drive(self, robot, reference, time):
        bias = np.cos(self.rate * time)[:, None] * np.array(self.torque)
        return Drive(bias, np.array(self.position_gain), np.array(self.velocity_gain), reference.motion(time))
