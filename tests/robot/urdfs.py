"""URDFs for tests, written from their parts."""

import warnings

from sea_ident.exceptions import SeaIdentWarning
from sea_ident.robot import Robot, robot_from_text


def link(name: str, mass: float | str | None = 1.0, inertia: str = 'ixx="0.1" iyy="0.1" izz="0.1"') -> str:
    if mass is None:
        return f'<link name="{name}"/>'
    tensor = f'<inertia {inertia} ixy="0" ixz="0" iyz="0"/>'
    return f'<link name="{name}"><inertial><origin xyz="0.1 0 0.2"/><mass value="{mass}"/>{tensor}</inertial></link>'


def joint(
    name: str,
    parent: str,
    child: str,
    kind: str = "revolute",
    axis: str = "0 1 0",
    limit: str | None = 'lower="-1" upper="2" velocity="3" effort="10"',
    more: str = "",
) -> str:
    limits = "" if limit is None else f"<limit {limit}/>"
    return (
        f'<joint name="{name}" type="{kind}"><origin xyz="0 0 0.5" rpy="0.1 0.2 0.3"/><parent link="{parent}"/>'
        f'<child link="{child}"/><axis xyz="{axis}"/>{limits}{more}</joint>'
    )


def sea(
    joint_name: str, actuator: str = "", spring: str = 'stiffness="100"', ratio: str = "50", limit: str = ""
) -> str:
    return (
        f'<transmission name="{joint_name}_sea" type="sea_ident/SeriesElastic">'
        f'<joint name="{joint_name}">{limit}</joint>'
        f'<actuator name="{joint_name}_motor"><mechanicalReduction>{ratio}</mechanicalReduction>{actuator}</actuator>'
        f"<seriesElastic {spring}/></transmission>"
    )


def urdf(*parts: str) -> str:
    return f'<robot name="test">{"".join(parts)}</robot>'


ARM = (link("base"), link("upper"), link("lower"), joint("shoulder", "base", "upper"), joint("elbow", "upper", "lower"))


def build(*parts: str, annotation: str | None = None, joints: tuple[str, ...] | None = None) -> Robot:
    """The robot, its warnings kept in it and otherwise unheard."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        return robot_from_text(urdf(*parts), "test.urdf", annotation, joints)
