"""How many periods a changed user needs: the update of an earlier model against a new identification.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/benchmarks/bench_update.py [--seeds 20]

Exoskeleton leg. The earlier model comes from a full campaign of 20 periods of 10 s. The wearer then changes: a foot
that is 30 % heavier, or nothing. New recordings of few periods are identified alone, and with the earlier model. Error
(rms over seeds, geometric mean over the parameters) in units of the standard deviation that the full campaign has, the
standard deviation that is stated in the same unit, and how many of the sixteen parameters were called changed. What it
printed is in results/update.md.
"""

import argparse
import sys
import warnings
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
from estimation.synthetic import Truth, leg_series, record, truth_of

from sea_ident.estimation import Model, identify
from sea_ident.robot import load_robot

FULL = 20
PERIODS = (2, 3, 4, 6, 8, 10, 20)
LEG = load_robot("exo_leg")


def identified(truth: Truth, periods: int, seed: int, prior: Model | None = None) -> Model:
    recording = record(LEG, truth, periods, seed=seed, torque_noise=0.3, encoder_noise=1e-5)
    return identify(LEG, recording, period=10.0, prior=prior)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=20)
    arguments = parser.parse_args()
    warnings.simplefilter("ignore")
    before = truth_of(LEG, leg_series(), samples=500)
    heavier = LEG.inertial_parameters.copy()
    heavier[20:30] *= 1.3
    after = truth_of(LEG.with_inertial_parameters(heavier, LEG.rotor_inertias()), leg_series(), samples=500)
    campaigns = [identified(before, FULL, 1000 + seed) for seed in range(arguments.seeds)]
    unit = np.sqrt(np.mean([m.std**2 for m in campaigns], axis=0))
    print(f"{arguments.seeds} seeds.\n")
    print("| wearer | periods | seconds | alone: error | updated: error | updated: stated | called changed, of 16 |")
    print("|---|---|---|---|---|---|---|")
    for title, truth, all_periods in (("heavier foot", after, PERIODS), ("the same", before, (2, 4, 10))):
        exact = campaigns[0].base.project(truth.parameters)
        for periods in all_periods:
            alone = [identified(truth, periods, seed).values for seed in range(arguments.seeds)]
            new = [identified(truth, periods, seed, campaigns[seed]) for seed in range(arguments.seeds)]
            stated = np.sqrt(np.mean([m.std**2 for m in new], axis=0))
            changed = np.mean([len(m.update.changed) for m in new if m.update is not None])
            print(
                f"| {title} | {periods} | {10 * periods} | {size(np.array(alone) - exact, unit):.2f} | "
                f"{size(np.array([m.values for m in new]) - exact, unit):.2f} | {size(stated[None], unit):.2f} | "
                f"{changed:.1f} |",
                flush=True,
            )


def size(errors: np.ndarray, unit: np.ndarray) -> float:
    """Geometric mean over parameters of the rms over seeds."""
    return float(np.exp(np.mean(np.log(np.sqrt(np.mean(errors**2, axis=0)) / unit))))


if __name__ == "__main__":
    main()
