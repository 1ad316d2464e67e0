"""Large errors that users make, larger than the hidden-effect benchmark draws them: are they told?

    python tests/benchmarks/bench_user_errors.py [GROUP ...]
    python tests/benchmarks/bench_user_errors.py rates

Zeros of encoders and joints off by degrees, read finely and by steps that repeat; a robot that leans; delays of a
wrong clock; torque constants off by a third; a push; on the elastic leg, also where it hardly moves, and on a
prosthesis, simulated with noise, and with a second motion held out. Printed per case: whether it is right (the truth is
named, or among the alternatives, and nothing else is named), the verdict, what is named, the truth, and the seconds of
the diagnosis. At the end, how many are right in each group. `rates` prints the seconds of `identify` and `diagnose` at
several sampling rates instead.
"""

import json
import sys
import time
import warnings
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import numpy as np

from sea_ident import Diagnosis, diagnose, identify, load_robot, simulate
from sea_ident.effects import make_effect
from sea_ident.exceptions import SeaIdentError, SeaIdentWarning
from sea_ident.motion import FourierSeries
from sea_ident.robot import Robot
from sea_ident.simulation import PlantedEffect, SensorNoise

MOTIONS = Path(__file__).parents[1] / "discrepancy" / "motions.json"
PROSTHESIS = Path(__file__).parent / "hidden_effects" / "robots" / "prosthesis.urdf"
PERIOD, PERIODS, HELD_OUT = 5.0, 10, 6
COARSE = SensorNoise(3e-5, 5e-6, link_resolution=2.0 * np.pi / 2**13, motor_resolution=2.4e-5)
"""The link's encoder has 13 bits."""

RATES = (100.0, 200.0, 500.0, 1000.0, 2000.0)


@dataclass(frozen=True)
class Case:
    """One error.

    Attributes:
        group: by which cases are chosen and counted.
        effect: that is planted.
        joint: where.
        values: of its columns.
        shape: its shapes and amounts.
        robot: `leg` or `prosthesis`.
        coarse: whether the encoders of the links are.
        motion: share of the usual motion [-].
    """

    group: str
    effect: str
    joint: str | None
    values: tuple[float, ...] = ()
    shape: Mapping[str, float] = field(default_factory=dict)
    robot: str = "leg"
    coarse: bool = False
    motion: float = 1.0


def cases() -> Iterator[Case]:
    """All of them."""
    for joint in ("hip", "knee", "ankle"):
        for offset in (0.05, -0.1):
            for coarse in (False, True):
                yield Case("zero", "encoder_offset", joint, shape={"offset": offset}, coarse=coarse)
    for offset in (0.02, -0.02, 0.03, -0.03):
        yield Case("small-zero", "encoder_offset", "ankle", shape={"offset": offset}, coarse=True)
    for joint, offset in (("hip", 0.02), ("hip", -0.3), ("knee", 0.1), ("ankle", 0.5)):
        yield Case("motor-zero", "motor_encoder_offset", joint, shape={"offset": offset})
    for joint, offset in (("knee", 0.05), ("knee", -0.3), ("hip", 0.1)):
        yield Case("joint-zero", "joint_offset", joint, shape={"offset": offset})
    for angles in ((0.0, 0.1), (0.1, 0.1), (0.15, 0.0), (0.25, -0.1), (0.05, 0.02)):
        yield Case("lean", "base_tilt", None, angles)
    for compliance in (2.5e-4, 5e-4, 1e-3):
        yield Case("soft-link", "link_flexibility", "hip", shape={"compliance": compliance})
    for joint, value in (("knee", 0.3), ("ankle", -0.4)):
        yield Case("torque-constant", "torque_constant", joint, (value,))
    yield Case("other", "position_delay", "knee", shape={"delay": 0.02})
    yield Case("other", "torque_delay", "hip", shape={"delay": -0.03})
    yield Case("other", "link_friction", "hip", (0.5, 5.0))
    yield Case("other", "parallel_spring", "knee", (30.0, 10.0))
    yield Case("other", "encoder_eccentricity", "hip", shape={"sine": 0.05, "cosine": 0.02})
    yield Case("other", "stribeck_friction", "knee", (4.0,), {"speed": 0.1})
    yield Case("other", "torque_ripple", "ankle", (2.0, 1.0), {"order": 12.0})
    yield Case("other", "directional_efficiency", "knee", (0.4,))
    yield Case("other", "load_dependent_friction", "ankle", (0.3,))
    yield Case("other", "position_dependent_friction", "hip", (1.0, 0.8), {"order": 5.0})
    yield Case("other", "spring_stiffening", "ankle", (2000.0,), {"exponent": 2.0})
    yield Case("other", "asymmetric_spring", "knee", (80.0,))
    yield Case("other", "spring_offset", "hip", (8.0,))
    yield Case("other", "torque_offset", "ankle", (5.0,))
    yield Case("other", "friction_drift", "knee", (0.0, 1.5))
    yield Case("other", "stiffness_drift", "hip", (-200.0,))
    yield Case("other", "spring_hysteresis", "knee", (3.0, 0.0), {"slip": 0.005})
    yield Case("other", "external_force", "hip", (40.0, 0.0, 20.0), {"start": 1.0, "stop": 1.8, "period": PERIOD})
    for joint, offset in (("ankle", 0.03), ("knee", -0.05)):
        yield Case("prosthesis", "encoder_offset", joint, shape={"offset": offset}, robot="prosthesis")
    yield Case("prosthesis", "link_friction", "ankle", (0.3, 1.0), robot="prosthesis")
    yield Case("prosthesis", "position_delay", "knee", shape={"delay": 0.01}, robot="prosthesis")
    yield Case("prosthesis", "torque_offset", "knee", (3.0,), robot="prosthesis")
    push = {"start": 1.0, "stop": 1.7, "period": PERIOD}
    yield Case("prosthesis", "external_force", "ankle", (8.0, 3.0, -5.0), push, robot="prosthesis")
    yield Case("prosthesis", "stribeck_friction", "knee", (1.0,), {"speed": 0.08}, robot="prosthesis")
    yield Case("small-motion", "parallel_spring", "hip", (45.0, 9.0), motion=0.2)
    yield Case("small-motion", "spring_offset", "knee", (6.0,), motion=0.2)
    yield Case("small-motion", "motor_encoder_offset", "knee", shape={"offset": -0.03}, motion=0.2)
    yield Case("small-motion", "torque_ripple", "ankle", (1.0, 0.5), {"order": 12.0}, motion=0.2)
    yield Case("small-motion", "torque_ripple", "knee", (2.0, 1.0), {"order": 12.0}, motion=0.2)


@cache
def robot_and_motions(name: str) -> tuple[Robot, tuple[FourierSeries, FourierSeries]]:
    """A robot, and a motion of it for the recording and one that is held out."""
    if name == "leg":
        first, second, *_ = json.loads(MOTIONS.read_text())
        series = (
            FourierSeries(m["base_frequency"], *(np.array(m[key]) for key in ("offset", "a", "b")))
            for m in (first, second)
        )
        return load_robot("exo_leg"), tuple(series)  # type: ignore[return-value]
    robot = load_robot(PROSTHESIS)
    lower, upper = robot.limits.lower, robot.limits.upper
    swing = np.minimum(0.5 * (upper - lower), 1.0)[:, None]
    found = []
    for seed in (1, 2):
        a, b = np.random.default_rng(seed).normal(0.0, 0.22, (2, robot.n, 5)) / np.arange(1, 6) ** 0.8
        found.append(FourierSeries(1.0 / PERIOD, 0.5 * (lower + upper), a * swing, b * swing))
    return robot, (found[0], found[1])


def told(case: Case) -> tuple[Diagnosis, float]:
    """What is said of a case, and in how many seconds."""
    robot, usual = robot_and_motions(case.robot)
    motions = [FourierSeries(m.base_frequency, m.offset, case.motion * m.a, case.motion * m.b) for m in usual]
    planted = [PlantedEffect(make_effect(case.effect, case.joint, **case.shape), np.array(case.values))]
    sensors = COARSE if case.coarse else None
    recording, other = (
        simulate(robot, motion, periods=periods, seed=seed, sensors=sensors, effects=planted).recording
        for motion, periods, seed in zip(motions, (PERIODS, HELD_OUT), (3, 7), strict=True)
    )
    model = identify(robot, recording, period=PERIOD)
    begin = time.perf_counter()
    found = diagnose(model, recording, holdout=other)
    return found, time.perf_counter() - begin


def is_right(case: Case, found: Diagnosis) -> bool:
    """Whether the truth is named, or among the alternatives, and nothing else is named.

    The first joint of the leg turns gravity and nothing else.
    """
    tilts = case.effect == "joint_offset" and case.joint == "hip"
    truth = ("base_tilt", None) if tilts else (case.effect, case.joint)
    declared = [{(m.effect, m.joint), *((a.effect, a.joint) for a in m.alternatives)} for m in found.missing]
    return len(declared) == 1 and truth in declared[0] and found.verdict in ("named", "ambiguous")


def rates() -> None:
    """Seconds at several sampling rates: 20 periods of the leg, one effect."""
    leg, motions = robot_and_motions("leg")
    planted = [PlantedEffect(make_effect("stribeck_friction", "knee", speed=0.1), np.array([0.6]))]
    for rate in RATES:
        recording, other = (
            simulate(leg, motion, periods=periods, seed=seed, effects=planted, rate=rate).recording
            for motion, periods, seed in zip(motions, (20, 8), (3, 4), strict=True)
        )
        begin = time.perf_counter()
        model = identify(leg, recording, period=PERIOD)
        identified = time.perf_counter()
        found = diagnose(model, recording, holdout=other)
        end = time.perf_counter()
        names = ", ".join(f"{m.effect} at {m.joint}" for m in found.missing)
        print(
            f"{rate:5g} Hz: identify {identified - begin:.1f} s, diagnose {end - identified:.1f} s, "
            f"{found.verdict}: {names}",
            flush=True,
        )


def main() -> None:
    """Cases of the groups that are named, all by default, or rates."""
    warnings.simplefilter("ignore", SeaIdentWarning)
    if "rates" in sys.argv[1:]:
        rates()
        return
    right: Counter[str] = Counter()
    count: Counter[str] = Counter()
    longest = 0.0
    for case in cases():
        if sys.argv[1:] and case.group not in sys.argv[1:]:
            continue
        what = f"{case.effect} at {case.joint or case.robot} {[*case.values, *case.shape.values()]}"
        what += ", coarse" if case.coarse else ""
        what += f", {case.motion:g} of the motion" if case.motion != 1.0 else ""
        count[case.group] += 1
        try:
            found, seconds = told(case)
        except SeaIdentError as error:
            print(f"WRONG {case.group}: {what}: {error}", flush=True)
            continue
        good, longest = is_right(case, found), max(longest, seconds)
        right[case.group] += good
        said = "; ".join(
            f"{m.effect} at {m.joint} "
            + ", ".join(f"{p.value:.4g} +- {p.std:.2g}" for p in m.parameters)
            + "".join(f" or {a.effect} at {a.joint}" for a in m.alternatives)
            for m in found.missing
        )
        print(
            f"{'right' if good else 'WRONG'} {case.group}: {what} -> {found.verdict}: {said} ({seconds:.1f} s)",
            flush=True,
        )
    for group, number in count.items():
        print(f"{group}: {right[group]} of {number}")
    print(f"all: {right.total()} of {count.total()}, the longest {longest:.1f} s")


if __name__ == "__main__":
    main()
