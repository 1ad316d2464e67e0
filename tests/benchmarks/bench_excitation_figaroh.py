"""UR10 under torque limits by `design_excitation` and by FIGAROH with IPOPT, judged by the same columns and limits.

The problem of bench_excitation_ur10.py. FIGAROH takes it as splines through 7 waypoints 2 s apart (12 s a segment: two
for the rigid case, one with friction), minimises the condition number of its own regressor by IPOPT with finite
differences, and keeps limits at its samples. Whatever it returns is judged here: log det and condition number of the
columns that `design_excitation` is given, at 20 Hz, and how far it lies beyond the limits on a grid 50 times finer.

    python tests/benchmarks/bench_excitation_figaroh.py [--seeds 3] [--first 0] [--iterations 200] [--case friction]
        [--ours]

Says so and ends where FIGAROH and cyipopt are not installed (figaroh 1.0.2, cyipopt-wheels); with --ours only
`design_excitation` runs. 200 iterations a segment are FIGAROH's own default. Times are processor times.
"""

import argparse
import importlib.util
import logging
import sys
import tempfile
import time
import warnings
from pathlib import Path

import numpy as np
import pinocchio as pin
from bench_excitation_ur10 import CASES, limited

from sea_ident.effects import Effect, make_effect
from sea_ident.excitation import DOptimality, design_excitation
from sea_ident.excitation.design_model import design_model
from sea_ident.motion import Motion
from sea_ident.regressor import inverse_dynamics
from sea_ident.robot import Limits, Robot, load_robot

CONFIG = """
robot:
  name: "ur10"
  properties:
    joints:
      active_joints: [{joints}]
      joint_limits:
        position: [{position}]
        velocity: [{velocity}]
        acceleration: [{acceleration}]
        torque: [{torque}]
    mechanics:
      reduction_ratios: [{ones}]
      ratio_essential: 1.0
      friction_coefficients: {{viscous: [{zeros}], static: [{zeros}]}}
      actuator_inertias: [{zeros}]
      joint_offsets: [{zeros}]
tasks:
  identification:
    enabled: true
    problem:
      include_external_forces: false
      use_joint_torques: true
      model_components: {{friction: {friction}, joint_offset: false, actuator_inertia: false,
                         static_regressor: true, inertia_regressor: true}}
    signal_processing: {{sampling_frequency: 20.0, cutoff_frequency: 5.0, filter_type: "butterworth", filter_order: 4}}
  optimal_trajectory:
    enabled: true
    problem: {{soft_lim: 0.2, max_attempts: 500, max_iterations: {iterations}}}
    trajectory: {{waypoints: 7, frequency: 20, segment_duration: 2.0}}
"""


def columns_of(robot: Robot, friction: bool) -> tuple[Effect, ...]:
    """The model: rigid bodies, with viscous and Coulomb friction if asked for."""
    extra = [
        effect
        for name in robot.joint_names
        for effect in (make_effect("viscous_friction", name), make_effect("coulomb_friction", name, smoothing=0.025))
    ]
    return (make_effect("rigid_bodies"), *(extra if friction else ()))


def judged(robot: Robot, effects: tuple[Effect, ...], states: tuple[np.ndarray, ...]) -> tuple[float, float]:
    """Log det and condition number of the columns at samples (N, n) of position, velocity and acceleration."""
    columns = design_model(robot, effects, DOptimality(), None)[0].columns
    phi = columns.at(Motion.rigid(np.arange(len(states[0]), dtype=float), *states)).columns()
    matrix = np.einsum("rpn,rsn->ps", phi, phi)
    return float(np.linalg.slogdet(matrix)[1]), float(np.sqrt(np.linalg.cond(matrix)))


def beyond(robot: Robot, limits: Limits, states: tuple[np.ndarray, ...]) -> float:
    """Largest excess over limits of position, velocity and torque, as a part of each."""
    q, dq, _ = states
    links, motors = inverse_dynamics(robot, Motion.rigid(np.arange(len(q), dtype=float), *states))
    parts = (np.abs(q) / limits.upper, np.abs(dq) / limits.velocity, np.abs(links + motors) / limits.torque)
    return max(float(part.max()) for part in parts) - 1.0


class Figaroh:
    """The problem as FIGAROH takes it."""

    def __init__(self, robot: Robot, friction: bool, iterations: int, folder: Path) -> None:
        from figaroh.optimal.base_optimal_trajectory import BaseOptimalTrajectory, BaseTrajectoryIPOPTProblem

        class Trajectory(BaseOptimalTrajectory):
            def create_ipopt_problem(self, *arguments: object) -> BaseTrajectoryIPOPTProblem:
                return BaseTrajectoryIPOPTProblem(self, *arguments)

        n = robot.n
        model = robot.model.copy()
        model.lowerPositionLimit, model.upperPositionLimit = np.full(n, -2.0 * np.pi), np.full(n, 2.0 * np.pi)
        wrapper = pin.RobotWrapper(model, pin.GeometryModel(), pin.GeometryModel())
        wrapper.geom_model = wrapper.collision_model

        def listed(values: object) -> str:
            return ", ".join(str(float(value)) for value in values)  # type: ignore[attr-defined]

        config = folder / "ur10.yaml"
        config.write_text(
            CONFIG.format(
                joints=", ".join(f'"{name}"' for name in robot.joint_names),
                position=listed([-2.0 * np.pi, 2.0 * np.pi] * n),
                velocity=listed(robot.limits.velocity),
                acceleration=listed([40.0] * n),
                torque=listed(robot.limits.torque),
                ones=listed(np.ones(n)),
                zeros=listed(np.zeros(n)),
                friction=str(friction).lower(),
                iterations=iterations,
            )
        )
        self.trajectory = Trajectory(wrapper, list(robot.joint_names), str(config))
        joints = [model.getJointId(name) for name in robot.joint_names]
        settings = self.trajectory.identif_config
        settings["active_joints"] = list(robot.joint_names)
        settings["act_Jid"], settings["act_J"] = joints, [model.joints[k] for k in joints]
        settings["act_idxq"] = [model.joints[k].idx_q for k in joints]
        settings["act_idxv"] = [model.joints[k].idx_v for k in joints]
        self.trajectory.initialize()
        self.segments = 1 if friction else 2

    def solve(self) -> tuple[tuple[np.ndarray, ...], tuple[bool, ...]] | None:
        """(N, n) positions, velocities and accelerations, and whether each segment converged; None if it failed."""
        self.trajectory.results.update({"T_F": [], "P_F": [], "V_F": [], "A_F": [], "iteration_data": []})
        results = self.trajectory.solve(stack_reps=self.segments)
        if len(results["T_F"]) < self.segments:
            return None
        states = tuple(np.vstack([np.asarray(part) for part in results[name]]) for name in ("P_F", "V_F", "A_F"))
        return states, tuple(bool(data["converged"]) for data in results["iteration_data"])


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--iterations", type=int, default=200)
    parser.add_argument("--case", default="")
    parser.add_argument("--ours", action="store_true", help="without FIGAROH")
    chosen = parser.parse_args()
    missing = [name for name in ("figaroh", "cyipopt") if importlib.util.find_spec(name) is None]
    if missing and not chosen.ours:
        print(f"skipped: {' and '.join(missing)} not installed (pip install figaroh==1.0.2 cyipopt-wheels)")
        sys.exit(0)
    warnings.simplefilter("ignore")
    logging.disable(logging.CRITICAL)
    robot = load_robot("example:ur_description/urdf/ur10_robot.urdf")
    limits = limited(robot)
    for label, friction in (("rigid", False), ("friction", True)):
        if chosen.case not in label:
            continue
        effects = columns_of(robot, friction)
        period, harmonics = (12.0, 5) if friction else (24.0, 10)
        starts = CASES[f"{label}, log det"][2]
        for seed in range(chosen.first, chosen.first + chosen.seeds):
            begin = time.process_time()
            ours = design_excitation(
                robot, base_frequency=1.0 / period, harmonics=harmonics, effects=effects, limits=limits, rate=20.0,
                starts=starts, seed=seed,
            )  # fmt: skip
            spent = time.process_time() - begin
            motion = ours.series.sample(samples=round(20.0 * period))
            value, condition = judged(robot, effects, (motion.q, motion.dq, motion.ddq))
            fine = ours.series.sample(samples=round(1000.0 * period))
            over = beyond(robot, limits, (fine.q, fine.dq, fine.ddq))
            print(
                f"{label:9s} seed {seed}: sea_ident log det {value:7.2f}, condition number {condition:7.1f}, "
                f"{spent:6.1f} s, beyond limits {over:+.1e}",
                flush=True,
            )
            if chosen.ours:
                continue
            np.random.seed(seed)  # noqa: NPY002 (what FIGAROH draws from)
            begin = time.process_time()
            with tempfile.TemporaryDirectory() as folder:
                found = Figaroh(robot, friction, chosen.iterations, Path(folder)).solve()
            spent = time.process_time() - begin
            if found is None:
                print(f"{label:9s} seed {seed}: figaroh   returned no trajectory, {spent:6.1f} s")
                continue
            value, condition = judged(robot, effects, found[0])
            over = beyond(robot, limits, found[0])
            print(
                f"{label:9s} seed {seed}: figaroh   log det {value:7.2f}, condition number {condition:7.1f}, "
                f"{spent:6.1f} s, beyond limits at its samples {over:+.1e}, converged {sum(found[1])} of "
                f"{len(found[1])} segments",
                flush=True,
            )


if __name__ == "__main__":
    main()
