"""Arms whose links swing on their springs within the harmonics of a usual design."""

import warnings

from sea_ident.exceptions import SeaIdentWarning
from sea_ident.robot import Robot, robot_from_text

_LINK = (
    '<link name="{name}"><inertial><origin xyz="0.3 0.01 0.02"/><mass value="{mass}"/>'
    '<inertia ixx="0.02" iyy="0.3" izz="0.3" ixy="0.001" ixz="0.01" iyz="0"/></inertial></link>'
)
_JOINT = (
    '<joint name="{name}" type="revolute"><origin xyz="{at}"/><parent link="{parent}"/><child link="{child}"/>'
    '<axis xyz="0 -1 0"/><limit lower="-0.9" upper="0.7" velocity="1.5" effort="{effort}"/></joint>'
    '<transmission name="{name}_t" type="sea_ident/SeriesElastic">'
    '<joint name="{name}"><limit acceleration="4"/></joint>'
    '<actuator name="{name}_m"><mechanicalReduction>100</mechanicalReduction><rotorInertia>2e-5</rotorInertia>'
    "<viscousFriction>3</viscousFriction></actuator>{spring}</transmission>"
)


def soft_arm(stiffness: float | None = 80.0, effort: float = 60.0) -> Robot:
    """Two links in a vertical plane, the second spring a quarter of the first [N m/rad]; no dry friction."""
    springs = [
        "<seriesElastic/>"
        if stiffness is None
        else f'<seriesElastic stiffness="{k}" cubicStiffness="{2.0 * k}" damping="{0.02 * k}"/>'
        for k in ([None, None] if stiffness is None else [stiffness, 0.25 * stiffness])
    ]
    parts = [
        '<link name="base"/>',
        _LINK.format(name="upper", mass=3.0),
        _LINK.format(name="lower", mass=1.0),
        _JOINT.format(name="shoulder", at="0 0 1", parent="base", child="upper", effort=effort, spring=springs[0]),
        _JOINT.format(name="elbow", at="0.6 0 0", parent="upper", child="lower", effort=effort, spring=springs[1]),
    ]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        return robot_from_text(f'<robot name="soft_arm">{"".join(parts)}</robot>', "soft_arm.urdf")
