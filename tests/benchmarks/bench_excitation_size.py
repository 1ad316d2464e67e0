"""Cost of an excitation against joints, harmonics and samples; 7 and 14 joints to the end.

    python tests/benchmarks/bench_excitation_size.py [--starts 2]

Goals: a 7-joint arm (147 coefficients) in under 10 s, 14 joints in under 2 minutes. The table gives the processor time
of one evaluation of the information matrix, its gradient, its curvature and one whole step.
"""

import argparse
import os
import time
import warnings

import numpy as np

from sea_ident.excitation import DOptimality, design_excitation, reduced_effects
from sea_ident.excitation.barrier import place_inside, quadratic_model, raise_inside
from sea_ident.excitation.defaults import default_limits
from sea_ident.excitation.design_model import design_model
from sea_ident.excitation.feasibility import random_start
from sea_ident.excitation.problem import Problem
from sea_ident.excitation.states import Sampling
from sea_ident.robot import Robot, load_robot

BAXTER = "example:baxter_description/urdf/baxter.urdf"
ARM = ("s0", "s1", "e0", "e1", "w0", "w1", "w2")


def arms(sides: tuple[str, ...], joints: int = 7) -> Robot:
    """One or both arms of Baxter."""
    return load_robot(BAXTER, joints=[f"{side}_{name}" for side in sides for name in ARM[:joints]])


def seconds(function, repeats: int = 3) -> float:
    """Least processor time of a call."""
    found = []
    for _ in range(repeats):
        begin = time.process_time()
        function()
        found.append(time.process_time() - begin)
    return min(found)


def cost(robot: Robot, harmonics: int, samples: int) -> str:
    """A row of the table."""
    model, criterion = design_model(robot, reduced_effects(robot), DOptimality(), None)
    limits = default_limits(robot, robot.limits, [])
    sampling = Sampling(0.1, harmonics, samples)
    problem = Problem.of(robot, model, criterion, limits, sampling, noise=None, collected=None, seed=0, notes=[])
    information = problem.coarse(samples, np.full(robot.n, 0.3))
    start = random_start(problem.limits, 0.1, problem.centre, np.random.default_rng(0))
    # inside the torque limits too, or no step would be taken
    factor = 0.9
    middle = [wall.values(problem.centre) for wall in problem.walls]
    while (
        place_inside(problem.walls, middle, problem.centre, problem.centre + factor * (start - problem.centre)) is None
    ):
        factor *= 0.8
    point = problem.centre + factor * (start - problem.centre)
    local = information.model(point)
    derivative = criterion.local(local.matrix).derivative
    matrix = seconds(lambda: information.matrix(point))
    gradient = seconds(lambda: local.gradient(derivative))
    both = seconds(lambda: quadratic_model(local, criterion))
    begin = time.process_time()
    steps: list[float] = []
    raise_inside(
        information, criterion, problem.walls, problem.centre, point, iterations=5,
        report=lambda value, _: bool(steps.append(value)),
    )  # fmt: skip
    if not steps:
        raise RuntimeError(f"no step was taken with {robot.n} joints, {harmonics} harmonics, {samples} samples")
    step = (time.process_time() - begin) / len(steps)
    cells = (matrix, gradient, both - gradient, step)
    return f"{robot.n:6d} {harmonics:9d} {samples:7d} {len(model.names):7d} {point.size:12d}  " + " ".join(
        f"{1e3 * cell:9.1f}" for cell in cells
    )


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--starts", type=int, default=2)
    parser.add_argument("--jobs", type=int, default=2)
    chosen = parser.parse_args()
    warnings.simplefilter("ignore")
    print(f"load of the machine before: {os.getloadavg()[0]:.1f}")
    print("joints harmonics samples columns coefficients  matrix ms  gradient curvature      step")
    for joints in (1, 3, 5, 7):
        print(cost(arms(("left",), joints), 10, 200), flush=True)
    print(cost(arms(("left", "right")), 10, 200), flush=True)
    for harmonics in (5, 20):
        print(cost(arms(("left",)), harmonics, 20 * harmonics), flush=True)
    for samples in (100, 400, 800):
        print(cost(arms(("left",)), 10, samples), flush=True)
    for sides, goal in ((("left",), 10.0), (("left", "right"), 120.0)):
        robot = arms(sides)
        begin, begin_cpu = time.perf_counter(), time.process_time()
        found = design_excitation(robot, starts=chosen.starts, seed=0, jobs=chosen.jobs)
        wall, cpu = time.perf_counter() - begin, time.process_time() - begin_cpu
        print(
            f"{robot.n} joints, {found.series.coefficients.size} coefficients, {len(found.parameters)} columns, "
            f"{chosen.starts} starts: log det {found.log_det:.2f}, wall {wall:.1f} s (goal {goal:g}), processor "
            f"{cpu:.1f} s, smallest margin {min(found.margins.values()):.1e}",
            flush=True,
        )


if __name__ == "__main__":
    main()
