"""Robots and parameters for the export tests."""

import warnings

import numpy as np

from sea_ident.base_parameters import random_motion
from sea_ident.effects import Effect, base_effects, make_effect, spring_effects
from sea_ident.estimation.pseudo_inertia import inertial_parameters, pseudo_inertia
from sea_ident.exceptions import SeaIdentWarning
from sea_ident.export import ExportValues, collect_values
from sea_ident.motion import Motion
from sea_ident.regressor import build_regressor, model_columns, prior_parameters
from sea_ident.robot import Robot, load_robot, robot_from_text

BAXTER = "example:baxter_description/urdf/baxter.urdf"
LEFT_ARM = ("left_s0", "left_s1", "left_e0", "left_e1", "left_w0", "left_w1", "left_w2")
ROBOTS = {
    "exo_leg": ("exo_leg", None, None),
    "exo_leg_link_friction": ("exo_leg_link_friction", None, None),
    "exo_leg_abduction": ("exo_leg_abduction", None, None),
    "quanser_2dof": ("quanser_2dof", None, None),
    "emps": ("emps", None, None),
    "baxter arm": (BAXTER, "baxter_sea", LEFT_ARM),
    "baxter arm, rotors askew": (BAXTER, "baxter_tilted", LEFT_ARM),
    "kinova (rigid, geared)": ("example:kinova_description/robots/kinova.urdf", None, None),
    "panda (mimic)": ("example:panda_description/urdf/panda.urdf", None, None),
    "ur5 (no motors)": ("example:ur_description/urdf/ur5_robot.urdf", None, None),
    "anymal (springs in every leg)": ("example:anymal_b_simple_description/robots/anymal.urdf", "anymal_b_sea", None),
    "tiago (prismatic, mobile)": ("example:tiago_description/robots/tiago_no_hand.urdf", None, None),
}


def load(name: str) -> Robot:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        return load_robot(*ROBOTS[name])


def reload(text: str, robot: Robot) -> Robot:
    """The robot of an exported URDF."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        return robot_from_text(text, "exported.urdf", joints=robot.joint_names)


def effects_of(robot: Robot) -> tuple[Effect, ...]:
    """Bodies, rotors, friction of motors and links, springs."""
    links = tuple(make_effect("link_friction", j.name) for j in robot.joints if j.elastic)
    return (*base_effects(robot), *links, *spring_effects(robot))


def identified(robot: Robot, effects: tuple[Effect, ...], seed: int = 0) -> np.ndarray:
    """(p,) physically consistent parameters unlike those of the description."""
    rng = np.random.default_rng(seed)
    psi = prior_parameters(robot, effects)
    columns = model_columns(robot, effects)
    for b in range(len(robot.bodies)):
        change = np.eye(4) + 0.1 * rng.normal(size=(4, 4))
        reference = pseudo_inertia(psi[10 * b : 10 * b + 10]) + 1e-4 * np.diag([0.1, 0.1, 0.1, 1.0])
        psi[10 * b : 10 * b + 10] = inertial_parameters(change @ reference @ change.T)
    for k, column in enumerate(columns):
        if column.effect != "rigid_bodies":
            known = psi[k] if np.isfinite(psi[k]) and psi[k] > 0.0 else 0.1
            psi[k] = (
                known * rng.uniform(0.5, 1.5) * (1e-4 if column.effect == "rotor_inertia" and known == 0.1 else 1.0)
            )
    return psi


def values_of(robot: Robot, seed: int = 0) -> tuple[ExportValues, tuple[Effect, ...], np.ndarray]:
    effects = effects_of(robot)
    psi = identified(robot, effects, seed)
    return collect_values(robot, model_columns(robot, effects), psi), effects, psi


def torque(robot: Robot, effects: tuple[Effect, ...], psi: np.ndarray, motion: Motion) -> tuple[np.ndarray, np.ndarray]:
    """Link rows and motor rows (N, n)."""
    regressor = build_regressor(robot, effects, motion)
    return regressor.link @ psi, regressor.motor @ psi


def brisk_motion(robot: Robot, samples: int = 20) -> Motion:
    """Random states in which no joint is so slow that tanh is not yet the sign."""
    motion = random_motion(robot, samples, seed=5)

    def away_from_zero(speed: np.ndarray) -> np.ndarray:
        return np.where(speed >= 0.0, speed + 0.3, speed - 0.3)

    return Motion(
        motion.time, motion.q, away_from_zero(motion.dq), motion.ddq,
        motion.theta, away_from_zero(motion.dtheta), motion.ddtheta,
    )  # fmt: skip
