"""The paper's excitation problem by `design_excitation` and by scipy's SLSQP.

exo_leg, 63 coefficients, 2000 samples, 15 parameters. SLSQP gets the same columns, the same random starts inside the
limits, and limits at 120 times a period;
what it returns is shrunk until it keeps the limits for all t, as everything here must. It runs once with our gradient
and, for fewer starts, with finite differences.

    python tests/benchmarks/bench_excitation_slsqp.py [--starts 16] [--difference-starts 2]

Times are processor times, so that other work on the machine does not count.
"""

import argparse
import time
import warnings

import numpy as np
from scipy.optimize import minimize

from sea_ident.excitation import DOptimality, design_excitation, reduced_effects
from sea_ident.excitation.design_model import design_model
from sea_ident.excitation.feasibility import at_rest, inner_position, random_start, shrink
from sea_ident.excitation.information import Information
from sea_ident.excitation.linear_limits import linear_limits
from sea_ident.excitation.states import Sampling
from sea_ident.motion import FourierSeries
from sea_ident.robot import load_robot

FREQUENCY, HARMONICS, SAMPLES, TIMES = 0.1, 10, 2000, 120


class Slsqp:
    """The problem as SLSQP takes it."""

    def __init__(self) -> None:
        robot = load_robot("exo_leg")
        model, self.criterion = design_model(robot, reduced_effects(robot), DOptimality(), None)
        sampling = Sampling(FREQUENCY, HARMONICS, SAMPLES)
        self.information = Information(model.columns, sampling, 1.0, np.ones(3), np.zeros((15, 15)))
        self.limits = linear_limits(robot, robot.limits)
        self.centre = at_rest(inner_position(self.limits), HARMONICS)
        count = len(self.limits)
        which = np.repeat(np.arange(count), TIMES)
        at = np.tile(np.arange(TIMES) / (TIMES * FREQUENCY), count)
        rows = self.limits.rows((FREQUENCY, HARMONICS), which, at)
        low, high = self.limits.lower[which], self.limits.upper[which]
        below, above = np.isfinite(low), np.isfinite(high)
        self.matrix = np.vstack([rows[below], -rows[above]])
        self.bound = np.concatenate([low[below], -high[above]])
        self.evaluations = 0

    def start(self, seed: int) -> np.ndarray:
        return random_start(self.limits, FREQUENCY, self.centre, np.random.default_rng([0, seed]))

    def value(self, x: np.ndarray) -> float:
        self.evaluations += 1
        return -self.criterion.value(self.information.matrix(x.reshape(3, -1)))

    def gradient(self, x: np.ndarray) -> np.ndarray:
        local = self.information.model(x.reshape(3, -1))
        return -local.gradient(self.criterion.local(local.matrix).derivative)

    def solve(self, seed: int, *, exact: bool, iterations: int) -> tuple[float, float, int]:
        """Log det inside the limits for all t, processor seconds, iterations."""
        begin = time.process_time()
        found = minimize(
            self.value,
            self.start(seed).ravel(),
            jac=self.gradient if exact else None,
            method="SLSQP",
            constraints={
                "type": "ineq",
                "fun": lambda x: self.matrix @ x - self.bound,
                "jac": lambda x: self.matrix,
            },
            options={"maxiter": iterations, "ftol": 1e-5},
        )
        point = found.x.reshape(3, -1)
        factor = shrink(self.limits, FourierSeries.from_coefficients(point, FREQUENCY), self.centre[:, -1])
        inside = self.centre + factor * (1.0 - 1e-12) * (point - self.centre)
        return -self.value(inside.ravel()), time.process_time() - begin, int(found.nit)


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--starts", type=int, default=16)
    parser.add_argument("--difference-starts", type=int, default=1)
    parser.add_argument("--iterations", type=int, default=300)
    chosen = parser.parse_args()
    warnings.simplefilter("ignore")

    begin = time.process_time()
    ours = design_excitation(load_robot("exo_leg"), starts=8, seed=0, jobs=1)
    ours_seconds = time.process_time() - begin
    print(f"design_excitation, 8 starts: log det {ours.log_det:.3f} in {ours_seconds:.1f} s")
    print(f"  smallest margin {min(ours.margins.values()):.2e}; starts {np.round(sorted(ours.start_values), 2)}")

    slsqp = Slsqp()
    for exact, starts in ((True, chosen.starts), (False, chosen.difference_starts)):
        label = "our gradient" if exact else "finite differences"
        values, seconds, steps = [], [], []
        for seed in range(starts):
            value, spent, count = slsqp.solve(seed, exact=exact, iterations=chosen.iterations)
            values.append(value)
            seconds.append(spent)
            steps.append(count)
            print(f"  SLSQP, {label}, start {seed}: log det {value:.3f}, {count} iterations, {spent:.1f} s", flush=True)
        if values:
            total = float(np.mean(seconds)) * chosen.starts
            print(
                f"SLSQP, {label}: best log det {max(values):.3f} (mean {np.mean(values):.3f}) of {starts} starts; "
                f"{chosen.starts} starts take {total:.0f} s, {total / ours_seconds:.0f} times ours"
            )


if __name__ == "__main__":
    main()
