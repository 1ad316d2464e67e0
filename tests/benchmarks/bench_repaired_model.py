"""Is a repaired model as unsure as it says? One motion, recorded again and again with other noise of its sensors.

    python -m tests.benchmarks.bench_repaired_model [--recordings N] [--seed S]

The arm of `bench_new_user`, a constant torque of 0.5 N m hidden at one of its motors. Every recording is identified and
diagnosed; of the models before and after the repair, the scatter of springs and motors from one recording to the next
is held against the standard deviations that they tell. What the scatter does not show, an error that all have in
common, is the mean error in units of the scatter; that of the true arm itself, which is stepped by half a step too
early, is 0.1 % of the rotor inertias.
"""

import argparse
import tempfile
import warnings
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from sea_ident import Model, diagnose, identify, load_robot, read_recording
from sea_ident.exceptions import SeaIdentWarning
from tests.benchmarks import bench_new_user as bench
from tests.benchmarks.through_files import write

CASE = bench.CASES["asymmetry"]


def told(model: Model) -> Iterator[tuple[str, float, float, float]]:
    """Name, estimate, standard deviation and truth of springs and motors."""
    of_motors = {parameter.name: parameter for parameter in model.parameters}
    for k, spring in enumerate(model.springs):
        yield f"{spring.joint} K1", spring.stiffness, spring.stiffness_std, bench.STIFFNESS[k]
        yield f"{spring.joint} K3", spring.cubic_stiffness, spring.cubic_stiffness_std, bench.CUBIC[k]
        yield f"{spring.joint} D", spring.damping, spring.damping_std, bench.DAMPING[k]
        for kind, truth in (("rotor_inertia", bench.ROTOR), ("viscous_friction", bench.VISCOUS)):
            own = of_motors[f"{spring.joint}.{kind}"]
            yield own.name, own.value, own.std, truth[k]


def main() -> None:
    """Record, identify, diagnose, and print a line for every number of the model."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--recordings", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    exact = bench.simulated(CASE, np.random.default_rng(arguments.seed), bench.PERIODS, 0.7)
    seen: dict[tuple[str, str], list[tuple[float, float, float]]] = defaultdict(list)
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        urdf, file = Path(folder) / "arm.urdf", Path(folder) / "recording.csv"
        urdf.write_text(bench.URDF)
        robot = load_robot(urdf)
        for number in range(arguments.recordings):
            write(file, bench.shown(exact, np.random.default_rng((arguments.seed, number))))
            recording = read_recording(file)
            model = identify(robot, recording, period=bench.PERIOD)
            found = diagnose(model, recording)
            if found.model is None or not found.missing:
                print(f"recording {number}: {found.verdict}, no repaired model")
                continue
            for which, one in (("before", model), ("after", found.model)):
                for name, value, std, truth in told(one):
                    seen[which, name].append((value, std, truth))
    ratios: dict[str, list[float]] = defaultdict(list)
    for (which, name), values in seen.items():
        estimates, stds, truths = np.array(values).T
        scatter = float(np.std(estimates, ddof=1))
        ratios[which].append(float(np.mean(stds)) / scatter)
        error = float(np.mean(estimates - truths)) / scatter
        print(
            f"{which:7}{name:24} told {np.mean(stds):8.3g}  scatter {scatter:8.3g}  ratio {ratios[which][-1]:5.2f}  "
            f"mean error {error:+5.2f} times the scatter"
        )
    for which, own in ratios.items():
        print(f"{which:7}told over scatter {min(own):.2f} to {max(own):.2f}, median {np.median(own):.2f}")


if __name__ == "__main__":
    main()
