import warnings
from collections.abc import Callable

import pytest

from sea_ident.exceptions import SeaIdentWarning
from sea_ident.robot import Robot, load_robot

_SPECS = {
    "exo_leg": ("exo_leg", None, None),
    "ur10": ("example:ur_description/urdf/ur10_robot.urdf", None, None),
    "panda": ("example:panda_description/urdf/panda.urdf", None, None),
    "baxter arm": (
        "example:baxter_description/urdf/baxter.urdf",
        "baxter_sea",
        ("left_s0", "left_s1", "left_e0", "left_e1", "left_w0", "left_w1", "left_w2"),
    ),
    "baxter wrist": ("example:baxter_description/urdf/baxter.urdf", "baxter_sea", ("left_w0", "left_w1", "left_w2")),
    "tiago": ("example:tiago_description/robots/tiago_no_hand.urdf", None, ("torso_lift_joint", "arm_1_joint")),
    "emps": ("emps", None, None),
    "quanser_2dof": ("quanser_2dof", None, None),
}
_LOADED: dict[str, Robot] = {}


@pytest.fixture(scope="session")
def robot_of() -> Callable[[str], Robot]:
    def load(name: str) -> Robot:
        if name not in _LOADED:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", SeaIdentWarning)
                _LOADED[name] = load_robot(*_SPECS[name])
        return _LOADED[name]

    return load
