"""Excite, record, diagnose: pairs of effects that a first, small motion does not tell apart.

    python tests/benchmarks/bench_next_experiment.py

An effect is hidden in the leg, and a small motion is recorded. Where the diagnosis is ambiguous, the motion that it
proposes is recorded and diagnosed in turn, at most twice. Printed per pair: verdict and alternatives after every
experiment, the gain that was promised, and whether the effect that was hidden is the one that is named in the end.
"""

import time
import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

import sea_ident
from sea_ident.discrepancy import Diagnosis, Verdict
from sea_ident.effects import make_effect
from sea_ident.exceptions import SeaIdentWarning
from sea_ident.motion import FourierSeries
from sea_ident.robot import Robot
from sea_ident.simulation import PlantedEffect, simulate

PERIOD = 5.0
PERIODS = 16
EXPERIMENTS = 2


@dataclass(frozen=True)
class Hidden:
    """A case.

    Attributes:
        effect: name.
        joint: joint.
        values: of its columns.
        amplitude: of the first motion, as a share of a good one.
        shape: of the effect.
    """

    effect: str
    joint: str
    values: tuple[float, ...]
    amplitude: float
    shape: tuple[tuple[str, float], ...] = ()

    @property
    def planted(self) -> PlantedEffect:
        """As the simulator takes it."""
        return PlantedEffect(make_effect(self.effect, self.joint, **dict(self.shape)), np.array(self.values))


CASES = (
    Hidden("spring_offset", "knee", (0.5,), 0.3),
    Hidden("backlash", "knee", (200.0,), 0.3, (("half_width", 0.004),)),
    Hidden("spring_offset", "hip", (1.0,), 0.3),
    Hidden("encoder_offset", "knee", (), 0.3, (("offset", 0.01),)),
    Hidden("torque_offset", "hip", (1.0,), 0.15),
    Hidden("torque_constant", "hip", (0.05,), 0.2),
)


def small(series: FourierSeries, amplitude: float) -> FourierSeries:
    """A motion around the same middle."""
    return FourierSeries(series.base_frequency, series.offset, amplitude * series.a, amplitude * series.b)


def proposed(diagnosis: Diagnosis) -> FourierSeries | None:
    """The motion that a diagnosis proposes."""
    if diagnosis.next_experiment is None:
        return None
    record = diagnosis.next_experiment.excitation
    return FourierSeries(
        record["base_frequency"], np.array(record["offset"]), np.array(record["a"]), np.array(record["b"])
    )


def loop(robot: Robot, first: FourierSeries, hidden: PlantedEffect, seed: int = 1) -> list[Diagnosis]:
    """Diagnoses, experiment after experiment, until one is not ambiguous."""
    series: FourierSeries | None = first
    found: list[Diagnosis] = []
    while series is not None and len(found) <= EXPERIMENTS:
        recording = simulate(robot, series, periods=PERIODS, seed=seed + len(found), effects=[hidden]).recording
        model = sea_ident.identify(robot, recording, period=PERIOD)
        found.append(sea_ident.diagnose(model, recording))
        series = proposed(found[-1]) if found[-1].verdict is Verdict.AMBIGUOUS else None
    return found


def main(cases: Sequence[Hidden] = CASES) -> None:
    """Run all cases and print what came out."""
    warnings.simplefilter("ignore", SeaIdentWarning)
    robot = sea_ident.load_robot("exo_leg")
    good = sea_ident.design_excitation(robot, base_frequency=1 / PERIOD, harmonics=5, starts=1, seed=0).series
    resolved = ambiguous = 0
    for case in cases:
        begin = time.process_time()
        diagnoses = loop(robot, small(good, case.amplitude), case.planted)
        print(f"{case.effect} at {case.joint} ({time.process_time() - begin:.0f} s CPU)")
        for number, diagnosis in enumerate(diagnoses):
            names = [
                (m.effect, m.joint, [f"{a.effect} at {a.joint}" for a in m.alternatives]) for m in diagnosis.missing
            ]
            plan = diagnosis.next_experiment
            gain = "" if plan is None else f", next: {' / '.join(plan.separates)}, gain {plan.gain:.3g}"
            print(f"  experiment {number}: {diagnosis.verdict} {names}{gain}", flush=True)
        right = [(m.effect, m.joint) for m in diagnoses[-1].missing] == [(case.effect, case.joint)]
        was = diagnoses[0].verdict is Verdict.AMBIGUOUS
        ambiguous += was
        resolved += was and right and diagnoses[-1].verdict is not Verdict.AMBIGUOUS
    print(f"{resolved} of {ambiguous} ambiguous pairs resolved in at most {EXPERIMENTS} experiments")


if __name__ == "__main__":
    main()
