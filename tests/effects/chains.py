"""Chains of rigid joints for tests, from the places of their links."""

import warnings
from collections.abc import Sequence

from sea_ident.exceptions import SeaIdentWarning
from sea_ident.robot import Robot, robot_from_text


def rigid_chain(
    axes: Sequence[str],
    centres: Sequence[str],
    masses: Sequence[float],
    inertia: str,
    places: Sequence[str],
    actuator: str,
    kind: str = "revolute",
) -> Robot:
    """A chain with links `l0`, `l1`, ... on joints `j0`, `j1`, ...; inertia and actuator are those of all."""
    parts, at = ['<link name="base"/>'], "base"
    for k, (axis, centre, mass, place) in enumerate(zip(axes, centres, masses, places, strict=True)):
        parts.append(
            f'<link name="l{k}"><inertial><origin xyz="{centre}"/><mass value="{mass}"/>'
            f'<inertia {inertia} ixy="0" ixz="0" iyz="0"/></inertial></link>'
            f'<joint name="j{k}" type="{kind}"><parent link="{at}"/><child link="l{k}"/>'
            f'<origin xyz="{place}"/><axis xyz="{axis}"/><limit lower="-2" upper="2" velocity="8" effort="60"/></joint>'
            f'<transmission name="t{k}" type="transmission_interface/SimpleTransmission"><joint name="j{k}"/>'
            f'<actuator name="m{k}">{actuator}</actuator></transmission>'
        )
        at = f"l{k}"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        return robot_from_text(f'<robot name="chain">{"".join(parts)}</robot>', "chain.urdf")
