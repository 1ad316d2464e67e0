"""UR10 of example-robot-data under torque limits, from 20 seeds: log det, condition number, time, limits.

|q| <= 0.8 x 2 pi, |v| and |torque| at 80 % of the URDF's limits, sampled at 20 Hz, columns not normalised, natural log.
Rigid: 36 base columns, 24 s, ten harmonics. Friction: 48 columns, 12 s, five harmonics, Coulomb friction smoothed over
0.025 rad/s (within 4 % of the sign above 0.05 rad/s).

Every trajectory is checked on a grid 50 times finer than its samples: linear limits exactly, torque with Pinocchio.

    python tests/benchmarks/bench_excitation_ur10.py [--seeds 20] [--first 0] [--jobs 2]

Wall time counts when nothing else runs; the processor time beside it is what the design itself used.
"""

import argparse
import os
import time
import warnings

import numpy as np

from sea_ident.effects import make_effect
from sea_ident.excitation import ConditionNumber, DOptimality, Excitation, design_excitation
from sea_ident.excitation.linear_limits import linear_limits
from sea_ident.regressor import inverse_dynamics
from sea_ident.robot import Limits, Robot, load_robot

# case: friction, criterion, starts, goal (log det at least, condition number below), seconds
CASES = {
    "rigid, log det": (False, DOptimality(), 6, 395.0, 4.0),
    "friction, log det": (True, DOptimality(), 8, 425.0, 3.0),
    "rigid, condition number": (False, ConditionNumber(), 2, 15.0, 5.0),
    "friction, condition number": (True, ConditionNumber(), 3, 50.0, 5.0),
}


def limited(robot: Robot) -> Limits:
    """80 % of the limits."""
    reach = np.full(robot.n, 0.8 * 2.0 * np.pi)
    limits = robot.limits
    return limits.replace(lower=-reach, upper=reach, velocity=0.8 * limits.velocity, torque=0.8 * limits.torque)


def violation(robot: Robot, limits: Limits, found: Excitation) -> tuple[float, float]:
    """Largest excess over linear limits and over torque limits, as parts of their ranges, on a fine grid."""
    count = 50 * found.samples
    motion = found.series.motion(np.arange(count) * found.period / count)
    linear = linear_limits(robot, limits)
    states = (motion.q, motion.dq, motion.ddq)
    worst = -np.inf
    for k in range(len(linear)):
        values = states[int(linear.derivative[k])] @ linear.joints[k]
        excess = max(values.max() - linear.upper[k], linear.lower[k] - values.min())
        worst = max(worst, float(excess / linear.width[k]))
    links, motors = inverse_dynamics(robot, motion[:: max(1, count // 4000)])
    torque = np.abs(links + motors).max(axis=0)
    return worst, float((torque / limits.torque - 1.0).max())


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--case", default="")
    chosen = parser.parse_args()
    warnings.simplefilter("ignore")
    robot = load_robot("example:ur_description/urdf/ur10_robot.urdf")
    limits = limited(robot)
    friction = [
        effect
        for name in robot.joint_names
        for effect in (
            make_effect("viscous_friction", name),
            make_effect("coulomb_friction", name, smoothing=0.025),
        )
    ]
    print(f"load of the machine before: {os.getloadavg()[0]:.1f}")
    for label, (with_friction, criterion, starts, goal, seconds) in CASES.items():
        if chosen.case not in label:
            continue
        effects = (make_effect("rigid_bodies"), *(friction if with_friction else ()))
        period, harmonics = (12.0, 5) if with_friction else (24.0, 10)
        values, walls, cpus, linear, torque = [], [], [], [], []
        for seed in range(chosen.first, chosen.first + chosen.seeds):
            begin, begin_cpu = time.perf_counter(), time.process_time()
            found = design_excitation(
                robot,
                base_frequency=1.0 / period,
                harmonics=harmonics,
                effects=effects,
                limits=limits,
                rate=20.0,
                starts=starts,
                seed=seed,
                criterion=criterion,
                jobs=chosen.jobs,
            )
            walls.append(time.perf_counter() - begin)
            cpus.append(time.process_time() - begin_cpu)
            values.append(found.log_det if isinstance(criterion, DOptimality) else found.raw_condition_number)
            for store, value in zip((linear, torque), violation(robot, limits, found), strict=True):
                store.append(value)
        better = np.array(values) >= goal if isinstance(criterion, DOptimality) else np.array(values) < goal
        print(
            f"{label:28s} {starts:2d} starts: {min(values):.2f} .. {np.median(values):.2f} .. {max(values):.2f}, goal "
            f"{goal:g} in {np.sum(better)} of {len(values)}; wall {np.median(walls):.1f} s (largest {max(walls):.1f}, "
            f"goal {seconds:g}), processor {np.median(cpus):.1f} s (largest "
            f"{max(cpus):.1f}); beyond limits: linear {max(linear):.1e}, torque "
            f"{max(torque):.1e}",
            flush=True,
        )


if __name__ == "__main__":
    main()
