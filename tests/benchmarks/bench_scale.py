"""Cost of the regressor and of the base parameters over the number of joints, as ratios to the bare Pinocchio loop.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/benchmarks/bench_scale.py

`bare` is a loop of `computeJointTorqueRegressor` over the samples that throws its results away: `links` on the links
alone, `bodies` on links and rotors as one tree, which is what the regressor of an elastic robot holds. `regressor` is
`build_total`: labelled rows of links, rotors and friction in memory. Best of several runs, processor time, one thread.
"""

import time
import warnings
from collections.abc import Callable

import numpy as np
import pinocchio as pin

from sea_ident import Robot, find_base_parameters, load_robot
from sea_ident.base_parameters import random_motion
from sea_ident.effects import base_effects
from sea_ident.regressor import build_total
from sea_ident.robot import find_urdf, robot_from_text

SAMPLES, RUNS = 2000, 5
BAXTER = "example:baxter_description/urdf/baxter.urdf"
ARM = ("s0", "s1", "e0", "e1", "w0", "w1", "w2")
LEFT, RIGHT = (tuple(f"{side}_{joint}" for joint in ARM) for side in ("left", "right"))


def best(task: Callable[[], object]) -> float:
    """Seconds of processor time of the quickest run."""
    times = []
    for _ in range(RUNS):
        start = time.process_time()
        task()
        times.append(time.process_time() - start)
    return min(times)


def loop(model: pin.Model, x: np.ndarray, v: np.ndarray, a: np.ndarray) -> None:
    data, compute = model.createData(), pin.computeJointTorqueRegressor
    for k in range(len(x)):
        compute(model, data, x[k], v[k], a[k])


def elastic(source: str) -> Robot:
    """A robot with a spring and a motor put into every joint."""
    robot = load_robot(source)
    springs = "".join(
        f'<transmission name="{name}_sea" type="sea_ident/SeriesElastic"><joint name="{name}"/>'
        f'<actuator name="{name}_m">'
        f"<mechanicalReduction>100</mechanicalReduction><rotorInertia>1e-5</rotorInertia></actuator></transmission>"
        for name in robot.joint_names
    )
    return robot_from_text(find_urdf(source).read_text(), source, f"<robot>{springs}</robot>")


def row(name: str, robot: Robot) -> None:
    motion, effects = random_motion(robot, SAMPLES, seed=1), base_effects(robot)
    x, v = robot.extended_state(motion.q, motion.theta), robot.extended_rate(motion.dq, motion.dtheta)
    a = robot.extended_rate(motion.ddq, motion.ddtheta)
    take = [robot.extended_model.joints[int(k)].idx_v for k in robot.body_indices]
    links = best(lambda: loop(robot.model, *(np.ascontiguousarray(y[:, take]) for y in (x, v, a))))
    bodies = best(lambda: loop(robot.extended_model, x, v, a))
    mine = best(lambda: [build_total(robot, effects, part) for part in motion.chunks(1000)])
    start = time.process_time()
    base = find_base_parameters(robot, effects)
    grouping = time.process_time() - start
    per = 1e6 / (SAMPLES * robot.n)
    print(
        f"{name:<22}{robot.n:>4}{len(base.columns):>6}{base.rank:>6}{links * per:>9.2f}{bodies * per:>9.2f}"
        f"{mine * per:>11.2f}{mine / links:>10.2f}{mine / bodies:>11.2f}{grouping:>9.2f}"
    )


def main() -> None:
    warnings.simplefilter("ignore")
    print(f"{'':<22}{'':>4}{'':>6}{'':>6}{'us per sample and joint':>29}{'ratio to bare':>21}{'base':>9}")
    print(
        f"{'robot':<22}{'n':>4}{'p':>6}{'rank':>6}{'links':>9}{'bodies':>9}{'regressor':>11}"
        f"{'links':>10}{'bodies':>11}{'s':>9}"
    )
    row("quanser_2dof", load_robot("quanser_2dof"))
    row("exo_leg", load_robot("exo_leg"))
    row("ur5, rigid", load_robot("example:ur_description/urdf/ur5_robot.urdf"))
    row("ur5, elastic", elastic("example:ur_description/urdf/ur5_robot.urdf"))
    row("baxter, one arm", load_robot(BAXTER, "baxter_sea", LEFT))
    row("baxter, both arms", load_robot(BAXTER, "baxter_sea", LEFT + RIGHT))
    row("talos, elastic", elastic("example:talos_data/robots/talos_reduced.urdf"))
    row("talos full, elastic", elastic("example:talos_data/robots/talos_full_v2.urdf"))
    row("g1 with hands, elastic", elastic("example:g1_description/urdf/g1_29dof_with_hand_rev_1_0.urdf"))
    row("tiago dual, rigid", load_robot("example:tiago_description/robots/tiago_dual.urdf"))


if __name__ == "__main__":
    main()
