"""Robots of the benchmark and the truth behind their nominal descriptions."""

import tempfile
import warnings
from dataclasses import dataclass, fields, replace
from functools import cache
from pathlib import Path

import numpy as np
import pinocchio as pin

from sea_ident.exceptions import SeaIdentWarning
from sea_ident.robot import Robot, load_robot
from tests.benchmarks.hidden_effects.case import FloatArray
from tests.benchmarks.hidden_effects.drawn_robots import drawn_robot

FOLDER = Path(__file__).parent / "robots"
BAXTER_ARM = tuple(f"left_{j}" for j in ("s0", "s1", "e0", "e1", "w0", "w1", "w2"))


@dataclass(frozen=True)
class RobotSource:
    """How `load_robot` finds a robot, and priors that its description does not give.

    Attributes:
        source: first argument of `load_robot`, or the description itself of a robot that is drawn.
        annotation: second argument.
        joints: third argument.
        viscous: viscous friction of joints without a stated one [N m s/rad].
        coulomb: Coulomb friction of joints without a stated one [N m].
        reach: largest distance from the middle of the motion [rad].
        velocity: largest speed of the motion [rad/s].
        acceleration: largest acceleration of the motion [rad/s2].
    """

    source: str
    annotation: str | None = None
    joints: tuple[str, ...] | None = None
    viscous: tuple[float, ...] = ()
    coulomb: tuple[float, ...] = ()
    reach: float = 0.9
    velocity: float = 1.4
    acceleration: float = 6.0


ROBOTS = {
    "exo_leg": RobotSource("exo_leg"),
    "baxter": RobotSource("example:baxter_description/urdf/baxter.urdf", "baxter_sea", BAXTER_ARM, acceleration=4.0),
    "ur5": RobotSource(
        "example:ur_description/urdf/ur5_robot.urdf",
        viscous=(6.0, 6.0, 4.0, 1.5, 1.5, 1.0),
        coulomb=(6.0, 7.0, 5.0, 1.5, 1.5, 1.0),
    ),
    # two joints; rigid and elastic joints by turns, about axes that are no axes of their links; two arms on one chest
    "prosthesis": RobotSource(str(FOLDER / "prosthesis.urdf")),
    "oblique_arm": RobotSource(
        str(FOLDER / "oblique_arm.urdf"), viscous=(2.0, 0.0, 0.0, 0.3), coulomb=(2.5, 0.0, 0.0, 0.4)
    ),
    "torso": RobotSource(
        str(FOLDER / "torso.urdf"), viscous=(4.0, 0.0, 0.0, 0.0, 0.0), coulomb=(4.0, 0.0, 0.0, 0.0, 0.0)
    ),
    # robots that are there, held at their bases: with the springs that they have been given here, and rigid ones
    "anymal": RobotSource(
        "example:anymal_b_simple_description/robots/anymal.urdf", "anymal_b_sea", ("LF_HAA", "LF_HFE", "LF_KFE")
    ),
    "icub": RobotSource("example:icub_description/robots/icub.urdf", "icub_sea", ("l_knee", "l_ankle_pitch")),
    "centauro": RobotSource(
        "example:centauro_description/urdf/centauro.urdf",
        "centauro_sea",
        tuple(f"j_arm1_{k}" for k in range(1, 7)),
        acceleration=3.0,
    ),
    "panda": RobotSource(
        "example:panda_description/urdf/panda.urdf",
        joints=tuple(f"panda_joint{k}" for k in range(1, 8)),
        viscous=(4.0, 4.0, 3.0, 3.0, 1.0, 1.0, 0.7),
        coulomb=(4.0, 4.0, 3.0, 3.0, 1.0, 1.0, 0.7),
    ),
    "talos": RobotSource(
        "example:talos_data/robots/talos_full_v2.urdf",
        joints=tuple(f"leg_left_{k}_joint" for k in range(1, 7)),
        viscous=(4.0, 6.0, 6.0, 6.0, 4.0, 3.0),
        coulomb=(5.0, 8.0, 8.0, 8.0, 5.0, 3.0),
    ),
}


@cache
def source_of(name: str) -> RobotSource:
    """How the robot of a name is found: one of `ROBOTS`, or one that is drawn."""
    if name in ROBOTS:
        return ROBOTS[name]
    drawn = drawn_robot(name)
    return RobotSource(drawn.urdf, **{f.name: getattr(drawn, f.name) for f in fields(drawn) if f.name != "urdf"})


@cache
def nominal_robot(name: str) -> Robot:
    """The robot as its description has it."""
    how = source_of(name)
    with warnings.catch_warnings(), tempfile.TemporaryDirectory() as folder:
        warnings.simplefilter("ignore", SeaIdentWarning)
        if name in ROBOTS:
            return load_robot(how.source, how.annotation, how.joints)
        file = Path(folder) / f"{name}.urdf"
        file.write_text(how.source, encoding="utf-8")
        return load_robot(file)


@dataclass(frozen=True, eq=False)
class Truth:
    """A robot with all numbers of its base model known.

    Attributes:
        robot: with the true inertial parameters; rotor inertias included.
        stiffness: (n,) K1, 0 at rigid joints [N m/rad].
        cubic: (n,) K3 [N m/rad3].
        damping: (n,) D [N m s/rad].
        viscous: (n,) friction of the motors (of the joints where rigid) [N m s/rad].
        coulomb: (n,) [N m].
    """

    robot: Robot
    stiffness: FloatArray
    cubic: FloatArray
    damping: FloatArray
    viscous: FloatArray
    coulomb: FloatArray


def nominal_truth(name: str) -> Truth:
    """The truth that equals the nominal description."""
    robot, how = nominal_robot(name), source_of(name)
    springs = [robot.spring(j.name) if j.elastic else None for j in robot.joints]
    viscous = [j.actuator.viscous_friction if j.actuator else how.viscous[i] for i, j in enumerate(robot.joints)]
    coulomb = [j.actuator.coulomb_friction if j.actuator else how.coulomb[i] for i, j in enumerate(robot.joints)]
    return Truth(
        robot,
        np.array([0.0 if s is None else s.stiffness for s in springs]),
        np.array([0.0 if s is None else s.cubic_stiffness or 0.0 for s in springs]),
        np.array([0.0 if s is None else s.damping or 0.0 for s in springs]),
        np.array(viscous, dtype=float),
        np.array(coulomb, dtype=float),
    )


def drawn_truth(name: str, rng: np.random.Generator) -> Truth:
    """A truth near the nominal description: no number of the description is the truth."""
    truth = nominal_truth(name)
    robot, n = truth.robot, truth.robot.n

    def factor(spread: float) -> FloatArray:
        return np.exp(spread * rng.uniform(-1.0, 1.0, n))

    parts = []
    for index in robot.body_indices:
        body = robot.extended_model.inertias[int(index)]
        size = float(np.sqrt(np.trace(body.inertia) / body.mass))
        scale, spread = float(np.exp(0.1 * rng.uniform(-1, 1))), float(np.exp(0.1 * rng.uniform(-1, 1)))
        lever = body.lever + 0.05 * size * rng.uniform(-1.0, 1.0, 3)
        parts.append(pin.Inertia(scale * body.mass, lever, scale * spread * body.inertia).toDynamicParameters())
    rotors = robot.rotor_inertias()
    groups = {rotor.rotor_group for rotor in robot.rotors}
    change = {group: float(np.exp(0.15 * rng.uniform(-1, 1))) for group in sorted(groups)}
    rotors = rotors * np.array([change[rotor.rotor_group] for rotor in robot.rotors])
    return replace(
        truth,
        robot=robot.with_inertial_parameters(np.concatenate(parts), rotors),
        stiffness=truth.stiffness * factor(0.15),
        cubic=truth.cubic * factor(0.3),
        damping=truth.damping * factor(0.3),
        viscous=truth.viscous * factor(0.3),
        coulomb=truth.coulomb * factor(0.3),
    )
