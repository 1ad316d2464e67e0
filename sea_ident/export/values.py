"""What an exported robot is made of: values of bodies, motors, friction and springs, whatever the format."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects import Column
from sea_ident.exceptions import ExportError
from sea_ident.robot import Robot


@dataclass(frozen=True)
class JointValues:
    """Values at one joint; None where the model has no such parameter.

    Attributes:
        joint: name of the joint.
        viscous_friction: of the motor; at a rigid joint, of the joint [N m s/rad] or [N s/m].
        coulomb_friction: of the motor; at a rigid joint, of the joint [N m] or [N].
        link_viscous_friction: of the link side of an elastic joint [N m s/rad].
        link_coulomb_friction: of the link side of an elastic joint [N m].
        torque_offset: constant torque that the motor has to overcome [N m] or [N].
        stiffness: K1 [N m/rad].
        cubic_stiffness: K3 [N m/rad3].
        damping: D of the spring [N m s/rad].
    """

    joint: str
    viscous_friction: float | None = None
    coulomb_friction: float | None = None
    link_viscous_friction: float | None = None
    link_coulomb_friction: float | None = None
    torque_offset: float | None = None
    stiffness: float | None = None
    cubic_stiffness: float | None = None
    damping: float | None = None


@dataclass(frozen=True, eq=False)
class ExportValues:
    """A robot with the values to be written.

    Attributes:
        robot: the robot, bodies and rotors with the values to be written.
        joints: (n,) further values.
        left_out: names of parameters that no format can carry.
    """

    robot: Robot
    joints: tuple[JointValues, ...]
    left_out: tuple[str, ...]


# effect, end of the parameter's name -> field of JointValues
_FIELDS = {
    ("viscous_friction", ".viscous_friction"): "viscous_friction",
    ("coulomb_friction", ".coulomb_friction"): "coulomb_friction",
    ("link_friction", ".link_friction_viscous"): "link_viscous_friction",
    ("link_friction", ".link_friction_coulomb"): "link_coulomb_friction",
    ("torque_offset", ".torque_offset"): "torque_offset",
    ("spring_stiffness", ".spring_stiffness"): "stiffness",
    ("spring_stiffening", ".spring_stiffening"): "cubic_stiffness",
    ("spring_damping", ".spring_damping"): "damping",
}


def collect_values(robot: Robot, columns: Sequence[Column], parameters: FloatArray) -> ExportValues:
    """Sort the parameters of a model by where they belong.

    Args:
        robot: the robot.
        columns: (p,) labels of the parameters, as `sea_ident.regressor.model_columns` gives them.
        parameters: (p,) their values, all of them standard parameters (not base parameters).

    Returns:
        The values.

    Raises:
        ExportError: if a value is not finite, or the inertial parameters of a link are missing.
    """
    if len(columns) != len(parameters):
        raise ExportError(f"{len(columns)} parameters have {len(parameters)} values; give one for each")
    inertial: dict[str, float] = {}
    rotors: dict[str, float] = {}
    fields: dict[str, dict[str, float]] = {joint: {} for joint in robot.joint_names}
    left_out = []
    for column, value in zip(columns, parameters, strict=True):
        if not np.isfinite(value):
            raise ExportError(f"parameter {column.name} is {value}; give it a finite value")
        stem = column.name.removeprefix(column.joint or "")
        field = _FIELDS.get((column.effect, stem))
        if column.effect == "rigid_bodies":
            inertial[column.name] = float(value)
        elif column.effect == "rotor_inertia":
            rotors[column.name] = float(value)
        elif field is not None and column.joint in fields:
            fields[column.joint][field] = float(value)
        else:
            left_out.append(column.name)
    missing = [name for name in robot.inertial_names if name not in inertial]
    if missing:
        raise ExportError(f"the model has no value for {', '.join(missing[:5])}; add the effect rigid_bodies")
    shaft = [rotors.get(f"{rotor.rotor_group}.rotor_inertia", rotor.rotor_inertia or 0.0) for rotor in robot.rotors]
    filled = robot.with_inertial_parameters(np.array([inertial[n] for n in robot.inertial_names]), np.array(shaft))
    joints = tuple(JointValues(name, **values) for name, values in fields.items())
    return ExportValues(filled, joints, tuple(left_out))
