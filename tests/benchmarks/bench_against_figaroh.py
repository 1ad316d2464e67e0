"""Accuracy and speed beside FIGAROH on the same robots, motions and noise.

    pip install figaroh && OMP_NUM_THREADS=1 python tests/benchmarks/bench_against_figaroh.py

FIGAROH (1.0) is a toolbox for rigid robots. Two comparisons: (1) rigid arms, where both tools answer the same question:
rank, identity with the inverse dynamics, time; (2) the exoskeleton leg, whose springs and rotors FIGAROH's model does
not have: how well the model of each predicts a gait. Times are the best of three.
"""

import logging
import time
import warnings
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np

from sea_ident import build_regressor, find_base_parameters, identify, load_robot, process, simulate, validate
from sea_ident.base_parameters import random_motion
from sea_ident.demo import gait
from sea_ident.effects.rigid_bodies import RigidBodies
from sea_ident.excitation import design_excitation
from sea_ident.motion import Motion
from sea_ident.regressor import inverse_dynamics
from sea_ident.robot import Robot
from sea_ident.simulation import ComputedTorque

warnings.simplefilter("ignore")
logging.disable(logging.WARNING)

ARMS = {
    "UR5": ("example:ur_description/urdf/ur5_robot.urdf", None),
    "Panda arm": ("example:panda_description/urdf/panda.urdf", [f"panda_joint{k}" for k in range(1, 8)]),
    "Kinova": ("example:kinova_description/robots/kinova.urdf", None),
}
SAMPLES = 1000
SEEDS = 10


def best(work: Callable[[], Any], times: int = 3) -> tuple[float, Any]:
    """Shortest time [s] and the result."""
    found, answer = np.inf, None
    for _ in range(times):
        begin = time.perf_counter()
        answer = work()
        found = min(found, time.perf_counter() - begin)
    return found, answer


def figaroh_base(robot: Robot, motion: Motion, *, friction: bool, inertia: bool) -> tuple[Any, ...]:
    """FIGAROH's regressor of the rigid model and its base parameters."""
    from figaroh.identification.parameter import add_standard_additional_parameters, get_standard_parameters
    from figaroh.tools.qrdecomposition import get_baseParams
    from figaroh.tools.regressor import build_regressor_basic, build_regressor_reduced, get_index_eliminate

    config = {
        "has_friction": friction, "has_actuator_inertia": inertia, "is_joint_torques": True,
        "act_idxv": list(range(robot.n)),
    }  # fmt: skip
    holder = SimpleNamespace(model=robot.model, data=robot.model.createData())
    names = get_standard_parameters(robot.model)
    names |= add_standard_additional_parameters(robot.model, config)

    def regressor() -> Any:
        return build_regressor_basic(holder, motion.q, motion.dq, motion.ddq, config)

    seconds, matrix = best(regressor)

    def base() -> Any:
        dropped, kept = get_index_eliminate(matrix, names, 1e-6)
        return get_baseParams(build_regressor_reduced(matrix, dropped), kept, names)

    base_seconds, (base_matrix, base_names, _) = best(base)
    return seconds, base_seconds, matrix, base_matrix, base_names, names


def rigid_arms() -> None:
    """Rank, identity and time on rigid arms."""
    print(f"rigid arms, {SAMPLES} samples: base parameters; largest |Phi psi - rnea| [N m]; seconds")
    print(f"{'robot':<10} {'tool':<10} {'rank':>5} {'identity':>10} {'regressor':>10} {'base':>8}")
    for name, (source, joints) in ARMS.items():
        robot = load_robot(source, joints=joints)
        motion = random_motion(robot, SAMPLES, 1)
        torque = sum(inverse_dynamics(robot, motion))
        effects = RigidBodies.instances(robot)
        seconds, regressor = best(lambda r=robot, e=effects, m=motion: build_regressor(r, e, m))
        base_seconds, base = best(lambda r=robot, e=effects: find_base_parameters(r, e))
        error = np.abs(regressor.sum @ robot.inertial_parameters - torque).max()
        rigid_error = np.abs(
            regressor.sum[:, :, base.independent] @ base.project(robot.inertial_parameters) - torque
        ).max()
        report(name, "sea_ident", base.rank, max(error, rigid_error), seconds, base_seconds)
        seconds, base_seconds, matrix, base_matrix, _, names = figaroh_base(
            robot, motion, friction=False, inertia=False
        )
        error = np.abs(matrix @ np.array(list(names.values())) - torque.T.ravel()).max()
        report(name, "FIGAROH", base_matrix.shape[1], error, seconds, base_seconds)


def report(robot: str, tool: str, rank: int, error: float, seconds: float, base_seconds: float) -> None:
    """One line of the table."""
    print(f"{robot:<10} {tool:<10} {rank:>5} {error:>10.1e} {seconds:>10.3f} {base_seconds:>8.3f}")


def leg() -> None:
    """A gait of the exoskeleton leg, predicted by the model of each tool from one and the same recording."""
    robot = load_robot("exo_leg")
    excitation = design_excitation(robot, starts=2, seed=0)
    walk = gait()
    ours, theirs, floor = [], [], []
    for seed in range(SEEDS):
        recording = simulate(robot, excitation, periods=20, seed=seed).recording
        walking = simulate(robot, walk, periods=20, seed=1000 + seed, controller=ComputedTorque())
        processed = process(recording, robot, period=excitation.period)
        walked = process(walking.recording, robot, period=walk.period)
        exact = walking.tau_motor.reshape(20, -1, robot.n).mean(axis=0)
        model = identify(robot, processed)
        ours.append(rms(validate(model, walked).predicted - exact))
        theirs.append(rms(figaroh_prediction(robot, processed.motion, processed.tau_motor, walked.motion) - exact))
        floor.append(rms(exact))
    print(f"\nexoskeleton leg, {SEEDS} seeds, gait torque of {np.mean(floor):.3g} N m rms")
    print("predicted less exact torque [N m rms]")
    print(f"  sea_ident                      {np.mean(ours):.4f} +- {np.std(ours):.4f}")
    print(f"  FIGAROH (rigid, motor inertia) {np.mean(theirs):.4f} +- {np.std(theirs):.4f}")


def figaroh_prediction(robot: Robot, motion: Motion, torque: Any, other: Motion) -> Any:
    """Torque of another motion by FIGAROH's rigid model with friction and actuator inertia, fitted by least squares."""
    _, _, matrix, _, _, _ = figaroh_base(robot, motion, friction=True, inertia=True)
    _, _, target, _, _, _ = figaroh_base(robot, other, friction=True, inertia=True)
    values = np.linalg.lstsq(matrix, torque.T.ravel(), rcond=1e-8)[0]
    return (target @ values).reshape(robot.n, -1).T


def rms(values: Any) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


if __name__ == "__main__":
    rigid_arms()
    leg()
