"""Spread of local optima over many starts, and how far the best is from what any motion could reach.

    python tests/benchmarks/bench_excitation_spread.py [--starts 200] [--rounds 12] [--mixed 12]

exo_leg, the paper's problem. Every start is designed alone, so that all of them are climbed to the end. The bound is on
all periodic motions of ten harmonics inside the limits; it is not tight (it knows the mean of total derivatives of
second degree and the bandwidth, nothing else), and its largest value over states is searched, not proven.

How much of its distance is due to measures that mix several motions is told by the best mixture of motions that all
keep the limits: weights by the multiplicative algorithm, further motions designed for what the mixture does not tell.
"""

import argparse
import sys
import time
import warnings

import numpy as np

from sea_ident.excitation import DOptimality, Excitation, design_excitation, reduced_effects
from sea_ident.excitation.design_model import design_model
from sea_ident.excitation.efficiency import bound_log_det
from sea_ident.robot import Robot, load_robot


def informations(robot: Robot, designs: list[Excitation]) -> np.ndarray:
    """(K, p, p) information of each design."""
    columns = design_model(robot, reduced_effects(robot), DOptimality(), None)[0].columns
    found = []
    for design in designs:
        phi = columns.at(design.series.sample(samples=design.samples)).columns()
        found.append(np.einsum("rpn,rsn->ps", phi, phi))
    return np.array(found)


def mixed(matrices: np.ndarray) -> tuple[np.ndarray, float]:
    """(p, p) information and log det of the best mixture."""
    weights = np.full(len(matrices), 1.0 / len(matrices))
    for _ in range(3000):
        inverse = np.linalg.inv(np.tensordot(weights, matrices, 1))
        weights *= np.einsum("pq,kpq->k", inverse, matrices) / matrices.shape[1]
    best = np.tensordot(weights, matrices, 1)
    return best, float(np.linalg.slogdet(best)[1])


def mixture(robot: Robot, designs: list[Excitation], rounds: int) -> float:
    """Log det of the best mixture of designs, and of motions designed for what it does not tell."""
    designs = list(designs)
    for seed in range(rounds):
        best, _ = mixed(informations(robot, designs))
        # with much information there, a design raises the slope of log det along its own
        designs.append(design_excitation(robot, starts=2, seed=1000 + seed, jobs=1, information=20.0 * best))
    return mixed(informations(robot, designs))[1]


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--starts", type=int, default=200)
    parser.add_argument("--rounds", type=int, default=12)
    parser.add_argument("--mixed", type=int, default=12)
    chosen = parser.parse_args()
    sys.stdout.reconfigure(line_buffering=True)  # type: ignore[union-attr]
    warnings.simplefilter("ignore")
    robot = load_robot("exo_leg")
    values, designs = [], []
    begin = time.process_time()
    for seed in range(chosen.starts):
        found = design_excitation(robot, starts=1, seed=seed, jobs=1)
        values.append(found.log_det)
        designs.append(found)
    best = max(designs, key=lambda design: design.log_det)
    seconds = (time.process_time() - begin) / chosen.starts
    cuts = np.percentile(values, [0, 5, 25, 50, 75, 95, 100])
    print(f"log det over {chosen.starts} starts, {seconds:.2f} s of processor time each")
    print("  smallest, 5 %, 25 %, median, 75 %, 95 %, largest: " + "  ".join(f"{value:.3f}" for value in cuts))
    rng = np.random.default_rng(0)
    for count in (1, 2, 4, 8, 16):
        drawn = rng.choice(values, size=(4000, count)).max(axis=1)
        print(f"  best of {count:2d}: mean {drawn.mean():.3f}, 5 % {np.percentile(drawn, 5):.3f}")
    begin = time.process_time()
    bound = bound_log_det(robot, best, rounds=chosen.rounds, states=700)
    spent = time.process_time() - begin
    print(
        f"bound {bound.log_det:.2f} (still moved by {bound.slack:.2f} at the end; {spent:.0f} s): "
        f"D-efficiency of the best at least {100 * bound.efficiency(best.log_det):.0f} %, of the median at least "
        f"{100 * bound.efficiency(float(cuts[3])):.0f} %; best against median {best.log_det - cuts[3]:.2f}"
    )
    together = mixture(robot, designs, chosen.mixed)
    print(
        f"best mixture of motions inside the limits: log det {together:.2f}, {together - best.log_det:.2f} above the "
        f"best of them"
    )


if __name__ == "__main__":
    main()
