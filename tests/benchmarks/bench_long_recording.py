"""Memory and time of a long recording: both arms of Baxter, 14 joints, a million samples by default.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/benchmarks/bench_long_recording.py [--samples 1000000]

The recording is made piece by piece and never held, as one that is read from a file in pieces. Printed: largest
resident memory, processor time per sample of the reduction against a bare loop of `computeJointTorqueRegressor` over
the same samples that throws its results away, on links and rotors as one tree, and the error of the parameters.
"""

import argparse
import resource
import time
import warnings
from collections.abc import Iterator

import numpy as np
import pinocchio as pin

from sea_ident.base_parameters import find_base_parameters
from sea_ident.effects import base_effects
from sea_ident.estimation import identify_stream
from sea_ident.estimation.observations import base_rows
from sea_ident.estimation.reduction import reduce_recording
from sea_ident.motion import FourierSeries, Motion
from sea_ident.regressor import prior_parameters
from sea_ident.robot import Robot, load_robot

ARM = ("s0", "s1", "e0", "e1", "w0", "w1", "w2")
JOINTS = [f"{side}_{joint}" for side in ("left", "right") for joint in ARM]
PIECE = 5000


def pieces(robot: Robot, samples: int) -> Iterator[Motion]:
    """A motion of many incommensurable harmonics, motors a little apart from the links."""
    rng = np.random.default_rng(0)
    links, springs = (
        FourierSeries(0.0137, np.zeros(robot.n), *(scale * rng.normal(size=(2, robot.n, 40))))
        for scale in (0.15, 0.004)
    )
    for start in range(0, samples, PIECE):
        at = np.arange(start, min(start + PIECE, samples)) * 0.005
        q, dq, ddq = (links.evaluate(at, k) for k in range(3))
        d, dd, ddd = (springs.evaluate(at, k) for k in range(3))
        yield Motion(at, q, dq, ddq, q + d, dq + dd, ddq + ddd)


def bare(robot: Robot, motion: Motion) -> float:
    """Seconds of processor time per sample of the bare loop."""
    model = robot.extended_model
    data = model.createData()
    x, v, a = (
        np.ascontiguousarray(table)
        for table in (
            robot.extended_state(motion.q, motion.theta),
            robot.extended_rate(motion.dq, motion.dtheta),
            robot.extended_rate(motion.ddq, motion.ddtheta),
        )
    )
    begin = time.process_time()
    for k in range(len(motion)):
        pin.computeJointTorqueRegressor(model, data, x[k], v[k], a[k])
    return (time.process_time() - begin) / len(motion)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--samples", type=int, default=1_000_000)
    samples = parser.parse_args().samples
    warnings.simplefilter("ignore")
    robot = load_robot("example:baxter_description/urdf/baxter.urdf", "baxter_sea", JOINTS)
    effects = base_effects(robot)
    base = find_base_parameters(robot, effects)
    exact = base.project(np.nan_to_num(prior_parameters(robot, effects)))

    few = [(motion, np.zeros_like(motion.q)) for motion in pieces(robot, 4 * PIECE)]
    plain = min(bare(robot, motion) for motion, _ in few)
    times = []
    for _ in range(3):
        begin = time.process_time()
        reduce_recording(robot, effects, base, few)
        times.append((time.process_time() - begin) / (4 * PIECE))
    print(f"{robot.n} joints, {base.rank} base parameters")
    print(
        f"bare loop {1e6 * plain:.1f} us a sample, reduction {1e6 * min(times):.1f} us: {min(times) / plain:.2f} times"
    )

    rng = np.random.default_rng(1)

    def recording() -> Iterator[tuple[Motion, np.ndarray]]:
        for motion in pieces(robot, samples):
            torque = base_rows(robot, effects, base, motion) @ exact
            yield motion, torque + 0.5 * rng.standard_normal(torque.shape)

    begin = time.perf_counter()
    model = identify_stream(robot, recording(), effects=effects, base=base)
    seconds = time.perf_counter() - begin
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    z = (model.values - exact) / model.std
    print(f"{samples} samples: {memory:.2f} GB resident at most, {seconds:.0f} s with making them")
    print(f"error in standard deviations: rms {np.sqrt(np.mean(z**2)):.2f}, largest {abs(z).max():.1f}")


if __name__ == "__main__":
    main()
