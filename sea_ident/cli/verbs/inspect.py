"""`sea-ident inspect`: joints, actuators, base parameters."""

from typing import TYPE_CHECKING, Any

from sea_ident.cli.inputs import read_robot
from sea_ident.cli.options import AnnotationFile, AsJson, Gravity, JointNames, RobotSource
from sea_ident.cli.output import emit, progress

if TYPE_CHECKING:
    from sea_ident.base_parameters import BaseParameters
    from sea_ident.robot import Joint, Robot


def inspect(
    robot: RobotSource,
    annotation: AnnotationFile = None,
    joints: JointNames = None,
    gravity: Gravity = None,
    as_json: AsJson = False,
) -> None:
    """Show joints, actuators, limits and base parameters of a robot."""
    from sea_ident.base_parameters import find_base_parameters
    from sea_ident.effects import base_effects

    loaded = read_robot(robot, annotation, joints, gravity)
    with progress("finding base parameters"):
        base = find_base_parameters(loaded, base_effects(loaded))
    emit(_record(loaded, base), f"{loaded.summary()}\n{base.summary()}", as_json=as_json)


def _spring(joint: "Joint") -> dict[str, float | None] | None:
    """What the annotation states of the spring of a joint; None at a rigid joint."""
    from sea_ident.robot import SeriesElasticActuator

    if not isinstance(joint.actuator, SeriesElasticActuator):
        return None
    return {kind: getattr(joint.actuator, kind) for kind in ("stiffness", "cubic_stiffness", "damping")}


def _record(robot: "Robot", base: "BaseParameters") -> dict[str, Any]:
    limits = robot.limits
    kinds = ("lower", "upper", "velocity", "acceleration", "jerk", "torque", "deflection")
    joints = []
    for i, joint in enumerate(robot.joints):
        actuator = joint.actuator
        joints.append(
            {
                "name": joint.name,
                "type": joint.type,
                "elastic": joint.elastic,
                "gear_ratio": None if actuator is None else actuator.gear_ratio,
                "followers": joint.followers,
                "damping": joint.damping,
                "friction": joint.friction,
                "spring": _spring(joint),
                "limits": {kind: float(getattr(limits, kind)[i]) for kind in kinds},
                "actuator": None
                if actuator is None
                else {
                    "name": actuator.name,
                    "torque_constant": actuator.torque_constant,
                    "rotor_inertia": actuator.rotor_inertia,
                    "efficiency": actuator.efficiency,
                    "viscous_friction": actuator.viscous_friction,
                    "coulomb_friction": actuator.coulomb_friction,
                    "rotor_group": actuator.rotor_group,
                    "carrier": actuator.carrier,
                    "rotor_axis": actuator.rotor_axis,
                },
            }
        )
    combinations = [
        {
            "name": name,
            "coefficients": {j: c for j, c in zip(robot.joint_names, row, strict=True) if c != 0.0},
            "lower": low,
            "upper": high,
        }
        for name, row, low, high in zip(
            limits.combination_names,
            limits.combinations.tolist(),
            limits.combination_lower.tolist(),
            limits.combination_upper.tolist(),
            strict=True,
        )
    ]
    return {
        "robot": robot.name,
        "joints": joints,
        "limit_combinations": combinations,
        "parameters": [column.name for column in base.columns],
        "base_parameters": [
            {"name": name, "unit": unit, "combination": base.combination(k)}
            for k, (name, unit) in enumerate(zip(base.names, base.units, strict=True))
        ],
        "rank": base.rank,
        "singular_value_gap": base.gap,
        "warnings": [*robot.warnings, *base.warnings],
    }
