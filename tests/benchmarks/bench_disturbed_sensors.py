"""The arm of `bench_new_user` with worse sensors, or with a motion that does not repeat: what is named then?

    python -m tests.benchmarks.bench_disturbed_sensors [CASE ...]

Currents with hum, with slow noise, in coarse steps, with spikes, without what is small; samples that are held or taken
at other times; a motion that is held out at another rate; a machine that shakes the first link; filters that make
currents late, or all signals alike. With nothing hidden, and with cogging. Motions without periods are judged less
strictly: what is hidden is named, or nothing is. Printed per case: whether it is right, verdict, what is named with its
first parameters, the truth, and the seconds of the diagnosis.
"""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from scipy.signal import lfilter

from tests.benchmarks import bench_new_user as arm
from tests.benchmarks.bench_new_user import Array, Moment, Torques
from tests.benchmarks.through_files import in_words, run_cases, write

Table = dict[str, Array]
Disturbance = Callable[[Table, np.random.Generator], Table]

SECONDS, HELD_OUT_SECONDS, SETTLING = 75.0, 30.0, 10.0
"""Of a motion without periods."""


def _same(table: Table, rng: np.random.Generator) -> Table:
    return table


def _signals(change: Callable[[Array, np.random.Generator], Array], *kinds: str) -> Disturbance:
    """Changes all signals of some kinds."""

    def disturbed(table: Table, rng: np.random.Generator) -> Table:
        return {name: change(x, rng) if name.split("_")[0] in kinds else x for name, x in table.items()}

    return disturbed


def _hum(x: Array, rng: np.random.Generator) -> Array:
    phase = rng.uniform(0.0, 2.0 * np.pi)
    return np.asarray(x + 0.08 * np.sin(2.0 * np.pi * 50.02 / arm.RATE * np.arange(len(x)) + phase))


def _slow_noise(pole: float) -> Callable[[Array, np.random.Generator], Array]:
    def noisy(x: Array, rng: np.random.Generator) -> Array:
        noise = lfilter([1.0], [1.0, -pole], rng.standard_normal(len(x) + 2000))[2000:]
        return np.asarray(x + 0.05 * np.sqrt(1.0 - pole**2) * noise)

    return noisy


def _coarse(x: Array, rng: np.random.Generator) -> Array:
    return 0.06 * np.round(x / 0.06)


def _without_what_is_small(x: Array, rng: np.random.Generator) -> Array:
    return np.asarray(np.sign(x) * np.maximum(np.abs(x) - 0.04, 0.0))


def _spikes(x: Array, rng: np.random.Generator) -> Array:
    return np.asarray(x + np.where(rng.random(len(x)) < 0.002, rng.standard_normal(len(x)), 0.0))


def _filtered(x: Array, rng: np.random.Generator) -> Array:
    """First order, 20 Hz."""
    pole = np.exp(-2.0 * np.pi * 20.0 / arm.RATE)
    return np.asarray(lfilter([1.0 - pole], [1.0, -pole], x, zi=[pole * x[0]])[0])


def _held(table: Table, rng: np.random.Generator) -> Table:
    """One sample of a hundred is the one before."""
    count = len(table["time"])
    lost = rng.random(count) < 0.01
    last = np.maximum.accumulate(np.where(lost & (np.arange(count) > 0), 0, np.arange(count)))
    return {name: x if name == "time" else x[last] for name, x in table.items()}


def _at(table: Table, time: Array) -> Table:
    return {name: np.interp(time, table["time"], x) for name, x in table.items()}


def _jitter(table: Table, rng: np.random.Generator) -> Table:
    time = table["time"]
    return {**_at(table, time + 3e-4 * rng.standard_normal(len(time))), "time": time}


def _slower(table: Table, rng: np.random.Generator) -> Table:
    """200 Hz."""
    return _at(table, np.arange(int(table["time"][-1] * 200.0)) / 200.0)


def _shaking(now: Moment) -> Torques:
    return arm.NOTHING, arm.NOTHING, arm._at("yaw", 0.4 * np.sin(2.0 * np.pi * 7.31 * now.time))


@dataclass(frozen=True)
class Case:
    """What is wrong with a recording.

    Attributes:
        truth: in words.
        hidden: in the arm.
        names: effect and joint that are right.
        verdict: that is right whatever is named beside it, none where the names say it.
        disturbed: changes the recording.
        other: changes the one that is held out; as the first by default.
        repeats: whether the motion does.
    """

    truth: str
    hidden: arm.Case
    names: tuple[tuple[str, str | None], ...]
    verdict: str | None = None
    disturbed: Disturbance = _same
    other: Disturbance | None = None
    repeats: bool = True

    def is_right(self, verdict: str, named: tuple[tuple[str, str | None], ...]) -> bool:
        """Whether a diagnosis says what is true, or without periods nothing that is not."""
        if self.verdict is not None:
            return verdict == self.verdict
        return sorted(named, key=str) == sorted(self.names, key=str) or not (self.repeats or named)


LATE = ("torque_delay", None)
"""What currents are that are filtered at 20 Hz."""

DISTURBED: Mapping[str, tuple[str, Disturbance]] = {
    "plain": ("good sensors", _same),
    "hum": ("0.08 A at 50.02 Hz", _signals(_hum, "current")),
    "slow": ("0.05 A of noise below 0.8 Hz", _signals(_slow_noise(0.98), "current")),
    "slower": ("0.05 A of noise below 0.04 Hz", _signals(_slow_noise(0.999), "current")),
    "coarse": ("currents in steps of 0.06 A", _signals(_coarse, "current")),
    "spikes": ("spikes of 1 A in 0.2 % of samples", _signals(_spikes, "current")),
    "held": ("1 % of samples held", _held),
    "jitter": ("samples 0.3 ms early or late", _jitter),
    "filtered": ("all signals filtered at 20 Hz", _signals(_filtered, "current", "q", "theta")),
    "late": ("currents filtered at 20 Hz", _signals(_filtered, "current")),
    "dead": ("currents without their first 0.04 A", _signals(_without_what_is_small, "current")),
}


def _cases() -> dict[str, Case]:
    cases = {}
    for hidden in ("nothing", "cogging"):
        there = arm.CASES[hidden]
        for name, (words, change) in DISTURBED.items():
            names = (*there.names, LATE) if name == "late" else there.names
            verdict = "not_in_library" if name == "dead" else None
            cases[f"{hidden}-{name}"] = Case(f"{there.truth}, {words}", there, names, verdict, change)
    nothing = arm.CASES["nothing"]
    cases["nothing-rate"] = Case("nothing, held out at 200 Hz", nothing, (), other=_slower)
    cases["nothing-shaken"] = Case("nothing, shaken at 7.31 Hz", arm.Case("", (), _shaking), ())
    for hidden in ("nothing", "cogging", "play", "asymmetry", "drag", "load", "balance", "warming", "tilt"):
        there = arm.CASES[hidden]
        cases[f"once-{hidden}"] = Case(f"{there.truth}, no periods", there, there.names, repeats=False)
    return cases


def _wandering(rng: np.random.Generator, amplitude: float, seconds: float) -> tuple[Array, Array]:
    """(K, 3) positions and velocities: nine sines of any frequency to 1 Hz per joint."""
    time = arm.STEP * np.arange(round(seconds / arm.STEP))
    position, velocity = np.zeros((2, len(time), 3))
    for j in range(3):
        speed = 2.0 * np.pi * rng.uniform(0.1, 1.0, 9)
        weights = rng.standard_normal((9, 2)) / speed[:, None]
        weights *= amplitude / np.sqrt(np.sum(weights**2))
        for w, (sine, cosine) in zip(speed, weights, strict=True):
            position[:, j] += sine * np.sin(w * time) + cosine * np.cos(w * time)
            velocity[:, j] += w * (sine * np.cos(w * time) - cosine * np.sin(w * time))
        position[:, j] += rng.uniform(-0.2, 0.2)
    return position, velocity


@cache
def _exact(hidden: arm.Case, repeats: bool, seed: int, periods: int, seconds: float, amplitude: float) -> Array:
    rng = np.random.default_rng(seed)
    if repeats:
        return arm.simulated(hidden, rng, periods, amplitude)
    settling = round(SETTLING / arm.STEP)
    position, velocity = _wandering(rng, amplitude, seconds + SETTLING)
    return arm.stepped(hidden, position, velocity, settling, len(position) - settling)


def diagnose(name: str, case: Case, folder: Path) -> bool:
    """Record, identify and diagnose one case; whether what is named is right."""
    urdf, train, holdout, model, out = (
        folder / f for f in ("arm.urdf", "train.csv", "holdout.csv", "model.json", "diagnosis.json")
    )
    urdf.write_text(arm.URDF)
    other = case.disturbed if case.other is None else case.other
    for file, change, seed, periods, seconds, amplitude in (
        (train, case.disturbed, 1, arm.PERIODS, SECONDS, 0.7),
        (holdout, other, 1001, arm.HELD_OUT, HELD_OUT_SECONDS, 0.6),
    ):
        rng = np.random.default_rng(seed + 5)
        exact = _exact(case.hidden, case.repeats, seed, periods, seconds, amplitude)
        write(file, change(arm.shown(exact, rng), rng))
    period = ("--period", str(arm.PERIOD)) if case.repeats else ()
    arm.command("identify", urdf, train, *period, "--out", model)
    seconds = arm.command("diagnose", model, train, "--holdout", holdout, "--out", out)
    found = json.loads(out.read_text())
    named = tuple((m["effect"], m["joint"]) for m in found["missing"])
    right = case.is_right(found["verdict"], named)
    print(f"{'right' if right else 'WRONG':6}{name:17} {seconds:5.1f} s  {found['verdict']:24} truth: {case.truth}")
    for missing in found["missing"]:
        print(f"{'':33}{in_words(missing)}", flush=True)
    return right


if __name__ == "__main__":
    run_cases(_cases(), diagnose)
