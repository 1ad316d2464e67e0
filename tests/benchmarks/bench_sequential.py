"""What the second recording should be when the first left something unknown.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/benchmarks/bench_sequential.py [--seeds 10] [--periods 3]

Exoskeleton leg. First campaign: 20 periods of an optimised excitation in which the ankle may move by 0.02 rad only.
Second recording: the first excitation again, random Fourier series, an excitation designed without knowledge of the
first recording, and one designed with its information matrix. Joint estimate from both: relative standard deviation of
the parameters that the first recording knew worst, by eq. 13 (without chance) and as stated, the error that was really
made (rms over seeds), and log det of the joint information. What it printed is in results/sequential.md.
"""

import argparse
import sys
import time
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
from estimation.synthetic import record, truth_of

from sea_ident.effects import base_effects
from sea_ident.estimation import Model, identify, information_about
from sea_ident.excitation import design_excitation, reduced_effects
from sea_ident.motion import FourierSeries
from sea_ident.robot import load_robot

NOISE = 0.2
HOW = {"harmonics": 5, "starts": 4, "rate": 50.0, "seed": 0, "jobs": 1}
WEAK = ("ankle.viscous_friction", "ankle.coulomb_friction", "foot.Iyy", "foot.mz", "foot.mx", "shank.Iyy*")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--periods", type=int, default=3, help="of the second recording")
    arguments = parser.parse_args()
    warnings.simplefilter("ignore")
    leg = load_robot("exo_leg")
    effects, ankle = base_effects(leg), np.array([False, False, True])
    limits = leg.limits
    held = replace(limits, lower=np.where(ankle, -0.02, limits.lower), upper=np.where(ankle, 0.02, limits.upper))
    first = design_excitation(leg, limits=held, **HOW).series

    def identified(series: FourierSeries, periods: int, seed: int, prior: Model | None = None) -> Model:
        recording = record(leg, truth_of(leg, series, 1000), periods, seed=seed, torque_noise=NOISE, encoder_noise=1e-5)
        return identify(leg, recording, period=10.0, effects=effects, prior=prior)

    before = [identified(first, 20, 1000 + seed) for seed in range(arguments.seeds)]
    noise = np.full(3, NOISE / np.sqrt(arguments.periods))
    information = information_about(before[0], reduced_effects(leg))
    begin = time.process_time()
    designed = design_excitation(leg, information=information, noise=noise, **HOW).series
    seconds = time.process_time() - begin
    rng = np.random.default_rng(5)
    seconds_are = {"the first again": first}
    for k in range(3):
        series = FourierSeries(0.1, np.array([0.5, -0.3, 0.4]), *rng.normal(0.0, 0.25, (2, 3, 5)))
        seconds_are[f"random series {k + 1} (limits not kept)"] = series
    seconds_are["designed, not knowing the first"] = design_excitation(leg, **HOW).series
    seconds_are["designed, knowing the first"] = designed

    exact = dict(zip(before[0].names, before[0].base.project(truth_of(leg, first, 1000).parameters), strict=True))
    print(f"First: 20 periods, second: {arguments.periods}; {arguments.seeds} seeds; design took {seconds:.1f} s.\n")
    print("Per parameter [%]: by eq. 13 / as stated (rms) / error made (rms).\n")
    print("| second recording | log det | changed | " + " | ".join(WEAK) + " |")
    print("|---|---|---|" + "---|" * len(WEAK))
    line("none", [np.linalg.inv(m.model_covariance) for m in before], before, exact)
    for name, series in seconds_are.items():
        alone = [identified(series, arguments.periods, seed) for seed in range(arguments.seeds)]
        both = [identified(series, arguments.periods, seed, before[seed]) for seed in range(arguments.seeds)]
        total = [
            np.linalg.inv(m.model_covariance) + np.linalg.inv(b.model_covariance)
            for m, b in zip(alone, before, strict=True)
        ]
        line(name, total, both, exact)


def line(name: str, information: list[np.ndarray], models: list[Model], exact: dict[str, float]) -> None:
    """One row of the table."""
    names = models[0].names
    value = np.array([exact[k] for k in names])
    assumed = 100.0 * np.sqrt(np.mean([np.diag(np.linalg.inv(i)) for i in information], axis=0)) / abs(value)
    stated = 100.0 * np.sqrt(np.mean([m.std**2 for m in models], axis=0)) / abs(value)
    made = 100.0 * np.sqrt(np.mean([(m.values - value) ** 2 for m in models], axis=0)) / abs(value)
    cells = [f"{assumed[k]:.2g} / {stated[k]:.2g} / {made[k]:.2g}" for k in (names.index(w) for w in WEAK)]
    changed = sum(len(m.update.changed) for m in models if m.update is not None)
    determinant = np.mean([np.linalg.slogdet(i)[1] for i in information])
    print(f"| {name} | {determinant:.2f} | {changed} | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
