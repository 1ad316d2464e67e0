"""A leg, a short motion of it and what its sensors see: shared by the tests of the parts of a diagnosis."""

import json
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pytest

import sea_ident
from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.settle import Settled, settle
from sea_ident.discrepancy.measured.data import period_data, wide_processing
from sea_ident.discrepancy.search.search import search
from sea_ident.effects import base_effects, make_effect, spring_effects
from sea_ident.motion import FourierSeries
from sea_ident.recordings import Recording
from sea_ident.robot import Robot
from sea_ident.simulation import FrictionJitter, PlantedEffect, Settling, simulate

PERIOD = 5.0
PROSTHESIS = Path(__file__).parents[1] / "benchmarks" / "hidden_effects" / "robots" / "prosthesis.urdf"


@dataclass(frozen=True)
class Laboratory:
    """Records short experiments with the leg, each once, and puts them on the bench.

    A recording follows from what it is asked with, to the last bit, and is read-only: tests share it. Each takes about
    a megabyte.
    """

    leg: Robot
    motions: tuple[object, ...]
    _recordings: dict[object, Recording] = field(default_factory=dict, init=False, repr=False, compare=False)

    @property
    def effects(self):
        """The usual model."""
        return (*base_effects(self.leg), *spring_effects(self.leg))

    def record(self, planted=(), *, periods=8, seed=3, motion=0, **options):
        """A recording with some effects in the leg, each `(name, joint, values, shape)` or an effect with values."""
        planted = tuple(
            (item[0], item[1]) if not isinstance(item[0], str) else (make_effect(item[0], item[1], **item[3]), item[2])
            for item in planted
        )
        if "plant" in options:  # its arrays have no key
            return self.recorded_anew(planted, periods=periods, seed=seed, motion=motion, **options)
        # effects are equal where their kinds, joints and shapes are
        amounts = tuple((effect, tuple(map(float, values))) for effect, values in planted)
        key = (amounts, periods, seed, motion, tuple(sorted(options.items())))
        if key not in self._recordings:
            self._recordings[key] = self.recorded_anew(planted, periods=periods, seed=seed, motion=motion, **options)
        return self._recordings[key]

    def recorded_anew(self, planted, *, periods, seed=3, motion=0, **options):
        """The same, whatever was recorded before: for a plant of its own, or where a test changes what acts."""
        found = [PlantedEffect(effect, np.asarray(values, dtype=float)) for effect, values in planted]
        # two periods of 5 s: the third changes by 1e-8 rad
        options = {"settling": Settling(1e-4), **options}
        return simulate(self.leg, self.motions[motion], periods=periods, seed=seed, effects=found, **options).recording

    def data(self, recording):
        """Its periods."""
        return period_data(wide_processing(recording, self.leg, PERIOD), self.leg)

    def bench(self, recording, effects=None):
        """The recording on the bench, with the usual model unless another is given."""
        return Bench(self.data(recording), self.effects if effects is None else effects)


@pytest.fixture(scope="session")
def leg():
    """The elastic leg."""
    return sea_ident.load_robot("exo_leg")


@pytest.fixture(scope="session")
def series():
    """Two short motions of it, as they were once designed: what a motion shows must not hang on the solver."""
    known = json.loads((Path(__file__).parent / "motions.json").read_text())
    return [FourierSeries(m["base_frequency"], *(np.array(m[key]) for key in ("offset", "a", "b"))) for m in known]


@pytest.fixture(scope="session")
def laboratory(leg, series):
    return Laboratory(leg, tuple(series))


@pytest.fixture(scope="session")
def small_motions(laboratory, series):
    """The leg on a fifth of its motions, in which little is seen and the ankle stands for half of the time."""
    small = tuple(FourierSeries(m.base_frequency, m.offset, 0.2 * m.a, 0.2 * m.b) for m in series)
    return replace(laboratory, motions=small)


@pytest.fixture(scope="session")
def prosthesis(laboratory):
    """A robot whose ankle carries a light foot, and whose springs hardly deflect, with two motions of its own."""
    robot = sea_ident.load_robot(PROSTHESIS)
    middle, swing = 0.5 * (robot.limits.lower + robot.limits.upper), 0.5 * (robot.limits.upper - robot.limits.lower)
    motions = []
    for seed in (1, 2):
        a, b = np.random.default_rng(seed).normal(0.0, 0.22, (2, robot.n, 5)) / np.arange(1, 6) ** 0.8
        motions.append(FourierSeries(1.0 / PERIOD, middle, a * swing[:, None], b * swing[:, None]))
    return replace(laboratory, leg=robot, motions=tuple(motions))


@pytest.fixture(scope="session")
def nothing_missing(laboratory):
    """Bench and settled model of a leg that has what the model has."""
    bench = laboratory.bench(laboratory.record())
    return bench, settle(bench, bench.effects)


@pytest.fixture(scope="session")
def jittery(laboratory):
    """Twelve periods of a leg whose friction differs from pass to pass where it is slow."""
    return laboratory.data(laboratory.record(periods=12, jitter=FrictionJitter(0.1, 0.05)))


@pytest.fixture(scope="session")
def rippled(laboratory):
    """Bench, settled model without and with it: a leg whose hip motor cogs by 1 N m four times per radian."""
    bench = laboratory.bench(laboratory.record([("torque_ripple", "hip", [1.0, 0.5], {"order": 4.0})]))
    start = settle(bench, bench.effects)
    ripple = make_effect("torque_ripple", "hip", order=4.0)
    with_it = bench.fit((*start.fit.effects, ripple), start.noise, start=start.fit.parameters)
    again = Settled(with_it, bench.noise(with_it))
    return bench, start, Settled(bench.fit(with_it.effects, again.noise, start=with_it.parameters), again.noise)


@pytest.fixture(scope="session")
def unequal(laboratory):
    """A large offset at the knee, and at the hip a Stribeck effect that is small beside it."""
    planted = [
        ("torque_offset", "knee", [-2.0], {}),
        ("stribeck_friction", "hip", [2.0], {"speed": 0.1, "exponent": 2.0}),
    ]
    bench = laboratory.bench(laboratory.record(planted, periods=8))
    return bench, search(bench, bench.effects)
