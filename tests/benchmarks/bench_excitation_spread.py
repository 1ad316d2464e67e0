"""Spread of local optima over many starts, and how far the best is from what any motion could reach.

    python tests/benchmarks/bench_excitation_spread.py [--starts 200] [--rounds 12]

exo_leg, the paper's problem. Every start is designed alone, so that all of them are climbed to the end. The bound is on
all periodic motions of ten harmonics inside the limits; it is not tight (it knows the mean of total derivatives of
second degree and the bandwidth, nothing else), and its largest value over states is searched, not proven.
"""

import argparse
import time
import warnings

import numpy as np

from sea_ident.excitation import design_excitation
from sea_ident.excitation.efficiency import bound_log_det
from sea_ident.robot import load_robot


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--starts", type=int, default=200)
    parser.add_argument("--rounds", type=int, default=12)
    chosen = parser.parse_args()
    warnings.simplefilter("ignore")
    robot = load_robot("exo_leg")
    values, best = [], None
    begin = time.process_time()
    for seed in range(chosen.starts):
        found = design_excitation(robot, starts=1, seed=seed, jobs=1)
        values.append(found.log_det)
        if best is None or found.log_det > best.log_det:
            best = found
    assert best is not None
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


if __name__ == "__main__":
    main()
