"""Robots: URDF and annotation in, links and rotors as one Pinocchio model out."""

from sea_ident.robot.actuator import Actuator, SeriesElasticActuator
from sea_ident.robot.limits import Limits
from sea_ident.robot.load import find_urdf, load_robot, robot_from_text, robots_folder, shipped_robots
from sea_ident.robot.model import INERTIAL_NAMES, INERTIAL_UNITS, Joint, Robot

__all__ = [
    "INERTIAL_NAMES",
    "INERTIAL_UNITS",
    "Actuator",
    "Joint",
    "Limits",
    "Robot",
    "SeriesElasticActuator",
    "find_urdf",
    "load_robot",
    "robot_from_text",
    "robots_folder",
    "shipped_robots",
]
