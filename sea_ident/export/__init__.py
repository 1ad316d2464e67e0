"""The identified model for other tools: URDF, MJCF, MuJoCo."""

from sea_ident.export.files import Export, export_mjcf, export_urdf, model_values
from sea_ident.export.mjcf import mjcf_text
from sea_ident.export.mujoco_robot import MujocoRobot, build_mujoco_robot
from sea_ident.export.urdf import urdf_text
from sea_ident.export.values import ExportValues, JointValues, collect_values

__all__ = [
    "Export",
    "ExportValues",
    "JointValues",
    "MujocoRobot",
    "build_mujoco_robot",
    "collect_values",
    "export_mjcf",
    "export_urdf",
    "mjcf_text",
    "model_values",
    "urdf_text",
]
