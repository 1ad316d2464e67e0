"""Small effects together: are two or three of them found, whatever their sizes are beside each other?

    python tests/benchmarks/bench_combinations.py [--cases 40] [--seed 0] [--effects 2] [--jobs 2]

Effects of the library at joints of the leg, each between half and twice a usual size, are planted in a simulation of
ten periods of five seconds; another motion is held out. What one of them does to the equations may be a hundred times
what another does, and the smallest frictions drown in friction that differs from pass to pass. Printed per case: the
statistic over degrees of freedom before, what was planted, and what is named of it; last how many were found, and how
many names are wrong. For a comparison of two states of the library, not for an absolute.
"""

import argparse
import json
import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from joblib import Parallel, delayed

import sea_ident
from sea_ident.effects import make_effect
from sea_ident.exceptions import SeaIdentWarning
from sea_ident.motion import FourierSeries
from sea_ident.simulation import PlantedEffect, Settling

PERIODS, HELD_OUT = 10, 6
JOINTS = ("hip", "knee", "ankle")


@dataclass(frozen=True)
class Usual:
    """An effect of a usual size.

    Attributes:
        name: of the effect.
        values: of its columns.
        shapes: of it.
        amount: name of its amount, where it is in the chain of signals, ...
        size: ... and that amount.
    """

    name: str
    values: tuple[float, ...] = ()
    shapes: tuple[tuple[str, float], ...] = ()
    amount: str | None = None
    size: float = 0.0

    def planted(self, joint: str, factor: float) -> PlantedEffect:
        """The effect at a joint, larger by a factor."""
        shapes = dict(self.shapes) | ({} if self.amount is None else {self.amount: factor * self.size})
        return PlantedEffect(make_effect(self.name, joint, **shapes), factor * np.array(self.values))


USUAL = (
    Usual("parallel_spring", (0.4, 0.14)),
    Usual("link_friction", (0.01, 0.05)),
    Usual("spring_offset", (0.4,)),
    Usual("torque_offset", (0.6,)),
    Usual("torque_ripple", (0.6, 0.3), (("order", 5.0),)),
    Usual("stribeck_friction", (0.8,), (("speed", 0.1), ("exponent", 2.0))),
    Usual("nonlinear_viscous_friction", (0.3,), (("exponent", 2.0),)),
    Usual("load_dependent_friction", (0.03,)),
    Usual("directional_efficiency", (0.04,)),
    Usual("position_dependent_friction", (0.5, 0.3), (("order", 3.0),)),
    Usual("spring_hysteresis", (0.6, 0.4), (("slip", 0.003),)),
    Usual("encoder_offset", amount="offset", size=0.005),
    Usual("encoder_eccentricity", amount="sine", size=0.003),
)


def case(seed: int, index: int, count: int) -> tuple[str, int, int, int]:
    """A line about one case; how many effects were planted, how many of them found, how many other names given."""
    rng = np.random.default_rng((seed, index))
    kinds = [USUAL[k] for k in rng.choice(len(USUAL), count, replace=False)]
    joints = [str(rng.choice(JOINTS)) for _ in kinds]
    planted = [
        kind.planted(joint, float(2.0 ** rng.uniform(-1.0, 1.0))) for kind, joint in zip(kinds, joints, strict=True)
    ]
    known = json.loads((Path(__file__).parents[1] / "discrepancy" / "motions.json").read_text())
    series = [FourierSeries(m["base_frequency"], *(np.array(m[key]) for key in ("offset", "a", "b"))) for m in known]
    leg, settling = sea_ident.load_robot("exo_leg"), Settling(1e-4)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        recording, held = (
            sea_ident.simulate(leg, motion, periods=periods, seed=k, effects=planted, settling=settling).recording
            for k, (motion, periods) in enumerate(zip(series, (PERIODS, HELD_OUT), strict=True), start=2 * index)
        )
        model = sea_ident.identify(leg, recording, period=series[0].period)
        found = sea_ident.diagnose(model, recording, holdout=held)
    truth = {(each.effect.name, each.effect.joint) for each in planted}
    named = {(m.effect, m.joint) for m in found.missing}
    ratio = found.lack_of_fit.statistic / found.lack_of_fit.dof
    line = f"{index:3d} {ratio:8.0f} {sorted(truth)} -> {found.verdict}: "
    line += "all" if named == truth else f"without {sorted(truth - named)}, with {sorted(named - truth)}"
    return line, len(truth), len(truth & named), len(named - truth)


def main() -> None:
    """Run cases and print the totals."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--cases", type=int, default=40)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--effects", type=int, default=2, help="planted in each case")
    parser.add_argument("--jobs", type=int, default=2)
    given = parser.parse_args()
    work = (delayed(case)(given.seed, index, given.effects) for index in range(given.cases))
    planted = found = wrong = 0
    for line, *counts in Parallel(n_jobs=given.jobs, return_as="generator")(work):
        print(line, flush=True)
        planted, found, wrong = (a + b for a, b in zip((planted, found, wrong), counts, strict=True))
    print(f"{found} of {planted} effects named, {wrong} of {found + wrong} names wrong")


if __name__ == "__main__":
    main()
