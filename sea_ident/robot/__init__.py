"""Robots: URDF and annotation in, links and rotors as one Pinocchio model out."""

from sea_ident.robot.actuator import Actuator, SeriesElasticActuator
from sea_ident.robot.limits import Limits
from sea_ident.robot.load import load_robot, robot_from_text
from sea_ident.robot.meshes import mesh_locator
from sea_ident.robot.model import INERTIAL_NAMES, INERTIAL_UNITS, Joint, Robot
from sea_ident.robot.sources import (
    example_robots_folder,
    find_urdf,
    robots_folder,
    shipped_annotations,
    shipped_robots,
)
from sea_ident.robot.workspace import HalfSpace, SelfCollision

__all__ = [
    "INERTIAL_NAMES",
    "INERTIAL_UNITS",
    "Actuator",
    "HalfSpace",
    "Joint",
    "Limits",
    "Robot",
    "SelfCollision",
    "SeriesElasticActuator",
    "example_robots_folder",
    "find_urdf",
    "load_robot",
    "mesh_locator",
    "robot_from_text",
    "robots_folder",
    "shipped_annotations",
    "shipped_robots",
]
