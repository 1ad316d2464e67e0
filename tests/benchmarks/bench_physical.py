"""Physically consistent parameters: time, and what consistency costs on motion that was not used.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/benchmarks/bench_physical.py [--seeds 5]

Baxter's left arm (7 joints, series elastic), little and noisy data, so that the unconstrained fit is often impossible.
Printed: seconds of CPU time, how often the unconstrained fit is possible, and the torque error of both fits on another
motion. What it printed is in results/physical.md.
"""

import argparse
import time
import warnings

import numpy as np

from sea_ident.effects import base_effects
from sea_ident.estimation import JointWLS, Pull, identify, physical_parameters
from sea_ident.motion import FourierSeries, Motion
from sea_ident.processing import from_states
from sea_ident.regressor import build_total, prior_parameters
from sea_ident.robot import load_robot

ARM = ["left_s0", "left_s1", "left_e0", "left_e1", "left_w0", "left_w1", "left_w2"]


def motion(seed: int, samples: int) -> Motion:
    rng = np.random.default_rng(seed)
    links, springs = (FourierSeries(0.1, np.zeros(7), *(scale * rng.normal(size=(2, 7, 5)))) for scale in (0.3, 0.01))
    at = np.arange(samples) * (10.0 / samples)
    q, dq, ddq = (links.evaluate(at, k) for k in range(3))
    d, dd, ddd = (springs.evaluate(at, k) for k in range(3))
    return Motion(at, q, dq, ddq, q + d, dq + dd, ddq + ddd)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=5)
    count = parser.parse_args().seeds
    warnings.simplefilter("ignore")
    robot = load_robot("example:baxter_description/urdf/baxter.urdf", "baxter_sea", ARM)
    effects = base_effects(robot)
    truth = np.nan_to_num(prior_parameters(robot, effects))
    other = motion(99, 500)
    exact = build_total(robot, effects, other) @ truth
    print("| noise [N m] | pull | seconds | at most | fit possible | error of the fit [N m] | of the possible [N m] |")
    print("|---|---|---|---|---|---|---|")
    for noise in (0.2, 2.0):
        for pull in Pull:
            seconds, possible, errors = [], 0, []
            for seed in range(count):
                states = motion(seed, 1000)
                torque = build_total(robot, effects, states) @ truth
                torque = torque + noise * np.random.default_rng(seed).standard_normal(torque.shape)
                model = identify(robot, from_states(robot, states, torque), effects=effects, estimator=JointWLS())
                begin = time.process_time()
                found = physical_parameters(model, pull=pull)
                seconds.append(time.process_time() - begin)
                possible += found.consistent
                both = (model.predict(other), found.model.predict(other))
                errors.append([np.sqrt(np.mean((table - exact) ** 2)) for table in both])
            free, real = np.mean(errors, axis=0)
            print(
                f"| {noise} | {pull} | {np.mean(seconds):.2f} | {np.max(seconds):.2f} | {possible} of {count} | "
                f"{free:.4f} | {real:.4f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
