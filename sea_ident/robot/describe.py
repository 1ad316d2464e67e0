"""What was understood of a robot, as text."""

from typing import TYPE_CHECKING
from unicodedata import east_asian_width

import numpy as np

from sea_ident.robot.actuator import Actuator, SeriesElasticActuator

if TYPE_CHECKING:
    from sea_ident.robot.model import Joint, Robot


def counted(count: int, thing: str) -> str:
    """A number of things in words: 1 joint, 2 joints."""
    return f"{count} {thing}" if count == 1 else f"{count} {thing}s"


def robot_summary(robot: "Robot") -> str:
    """A table of joints, with limits, motors and springs as far as the description states them."""
    counts = ((robot.n, "joint"), (len(robot.rotors), "motor"), (sum(robot.elastic), "spring"))
    lines = [f"{robot.name}: {', '.join(counted(*each) for each in counts)}"]
    width = max((_cells(joint.name) for joint in robot.joints), default=5)
    for i, joint in enumerate(robot.joints):
        lower, upper = robot.limits.lower[i], robot.limits.upper[i]
        gear = "" if joint.actuator is None else f"  gear {joint.actuator.gear_ratio:g}"
        kind = "elastic" if joint.elastic else "rigid"
        name = joint.name + " " * (width - _cells(joint.name))
        lines.append(f"  {name}  {joint.type:<10} {kind:<7}  [{lower:.4g}, {upper:.4g}] {joint.position_unit}{gear}")
        lines.extend(f"      {text}" for text in _details(robot, i, joint))
    held = ", ".join(f"{name} at {value:.4g}" for name, value in robot.locked.items())
    lines.extend([f"  locked: {held}"] if held else [])
    lines.extend(f"  warning: {text}" for text in robot.warnings)
    return "\n".join(lines)


def _cells(text: str) -> int:
    """Columns of a terminal that a text fills."""
    return sum(2 if east_asian_width(letter) in "WF" else 1 for letter in text)


def _details(robot: "Robot", i: int, joint: "Joint") -> list[str]:
    """Limits, motor, spring and friction of a joint; a line only where something is known."""
    position, torque, limits = joint.position_unit, joint.torque_unit, robot.limits
    most = [
        (limits.velocity[i], f"{position}/s"),
        (limits.acceleration[i], f"{position}/s2"),
        (limits.jerk[i], f"{position}/s3"),
        (limits.torque[i], torque),
        (limits.deflection[i], f"{position} of deflection"),
    ]
    lines = _line("at most", [(value if np.isfinite(value) else None, unit) for value, unit in most])
    lines += [f"followed by {', '.join(joint.followers)}"] if joint.followers else []
    if joint.actuator is not None:
        lines += _motor(joint.actuator, position, torque)
    if isinstance(joint.actuator, SeriesElasticActuator):
        spring = joint.actuator
        numbers = [
            (spring.stiffness, f"{torque}/{position}"),
            (spring.cubic_stiffness, f"{torque}/{position}3"),
            (spring.damping, f"{torque} s/{position} of damping"),
        ]
        lines += _line("spring", numbers) or ["spring: identified, nothing is stated"]
    return lines + _line("friction at the link", [(joint.damping, f"{torque} s/{position}"), (joint.friction, torque)])


def _motor(actuator: Actuator, position: str, torque: str) -> list[str]:
    shared = f" (motors {actuator.rotor_group!r} alike)" if actuator.rotor_group != actuator.joint else ""
    numbers = [
        (actuator.torque_constant, "N m/A"),
        (actuator.rotor_inertia, f"kg m2{shared}"),
        (actuator.efficiency, "efficiency"),
        (actuator.viscous_friction, f"{torque} s/{position} of viscous friction"),
        (actuator.coulomb_friction, f"{torque} of Coulomb friction"),
    ]
    return _line("motor", numbers)


def _line(title: str, numbers: list[tuple[float | None, str]]) -> list[str]:
    known = [f"{value:g} {unit}" for value, unit in numbers if value is not None]
    return [f"{title}: {', '.join(known)}"] if known else []
