"""A spring that creeps is none with dry friction in it, though both take two ways."""

from dataclasses import dataclass

import numpy as np
import pytest

from sea_ident.discrepancy import Verdict
from sea_ident.discrepancy.bench.lack import LACK_LEVEL, lack_of_fit
from sea_ident.discrepancy.bench.settle import settle, settle_again
from sea_ident.discrepancy.conclude import conclude
from sea_ident.discrepancy.measured.check import Findings
from sea_ident.discrepancy.nameless.creeping import Creep, DryFriction, creeping, no_dry_friction
from sea_ident.discrepancy.nameless.unnamed import unnamed
from sea_ident.discrepancy.search.confirm import Confirmed
from sea_ident.discrepancy.search.refit import refitted
from sea_ident.discrepancy.search.search import Selection
from sea_ident.discrepancy.trends.trend import TrendTest
from sea_ident.effects import State, make_effect
from sea_ident.exceptions import EffectError
from sea_ident.motion import Motion
from sea_ident.simulation import Settling

KNEE = 1
STEP = 2.5e-3  # of the simulator [s]


class Creeping:
    """Spring and damper in series, integrated step by step: tau z' = d - z, the torque is c (d - z)."""

    def __init__(self, index, stiffness, time_constant):
        self.index, self.stiffness, self.time_constant = index, stiffness, time_constant
        self.before = self.slow = None

    def relaxed(self, state, elapsed):
        bent = float(state.theta[self.index] - state.q[self.index])
        if self.slow is None:
            return bent, bent
        share = -np.expm1(-elapsed / self.time_constant)
        return bent, self.slow + share * (0.5 * (bent + self.before) - self.slow)

    def __call__(self, state, link, motor):
        bent, slow = self.relaxed(state, state.elapsed)
        motor[self.index] += self.stiffness * (bent - slow)
        link[self.index] -= self.stiffness * (bent - slow)

    def accept(self, state):
        self.before, self.slow = self.relaxed(state, STEP)


class BoucWen:
    """Dry friction without elements: z' = d' / w (1 - |z|^n (b sgn(d' z) + 1 - b)), the torque is c z."""

    def __init__(self, index, force, width):
        self.index, self.force, self.width = index, force, width
        self.before, self.memory = None, 0.0

    def gone(self, state):
        bent = float(state.theta[self.index] - state.q[self.index])
        step, z = 0.0 if self.before is None else (bent - self.before) / self.width, self.memory
        return bent, z + step - abs(z) ** 1.2 * (0.8 * abs(step) * np.sign(z) + 0.2 * step)

    def __call__(self, state, link, motor):
        torque = self.force * self.gone(state)[1]
        motor[self.index] += torque
        link[self.index] -= torque

    def accept(self, state):
        self.before, self.memory = self.gone(state)


@dataclass(frozen=True)
class PlantedCreep(Creep):
    """The same, acting in a simulation."""

    def torque(self, robot, values):
        return Creeping(robot.index(self.joint), float(values[0]), self.time_constant)


@dataclass(frozen=True)
class PlantedBoucWen(Creep):
    """The same in the same place."""

    width: float = 0.006

    def torque(self, robot, values):
        return BoucWen(robot.index(self.joint), float(values[0]), self.width)


def found(bench, slip=0.01, joint="knee"):
    """What a search would give that found dry friction in a spring."""
    start = settle(bench, bench.effects)
    hysteresis = make_effect("spring_hysteresis", joint, slip=slip)
    fit = refitted(bench, start.fit.effects, hysteresis, (), start.noise, start.fit.parameters)
    return Selection(start, settle_again(bench, fit), 1, (0.0,))


@pytest.mark.parametrize("thinned", [1, 3])
@pytest.mark.parametrize("time_constant", [0.02, 0.4, 30.0])
def test_it_is_the_steady_state_of_its_equation(leg, thinned, time_constant):
    """The sine d = A sin w t + d0 has z = d0 + A (sin w t - w tau cos w t) / (1 + (w tau)^2)."""
    period, samples, amplitude, harmonic = 4.0, 600, 0.03, 3
    time = (1.5 + np.arange(samples) * period / samples)[::thinned]
    w = 2.0 * np.pi * harmonic / period
    nothing = np.zeros((len(time), leg.n))
    theta = nothing.copy()
    theta[:, KNEE] = 0.1 + amplitude * np.sin(w * time)
    motion = Motion(time, nothing, nothing, nothing, theta, nothing, nothing)
    rows = Creep("knee", time_constant).evaluate(State(leg, motion))
    turn = w * time_constant
    slow = 0.1 + amplitude * (np.sin(w * time) - turn * np.cos(w * time)) / (1.0 + turn**2)
    np.testing.assert_allclose(rows.motor[:, KNEE, 0], theta[:, KNEE] - slow, atol=1e-12)
    np.testing.assert_array_equal(rows.link, -rows.motor)
    assert not np.any(rows.motor[:, [0, 2]])


def test_dry_friction_relaxes_with_the_way():
    """Where a sine of amplitude A turns, z = 1 - (1 + z) exp(-2 A / w) = tanh(A / w)."""
    amplitude = 0.02
    theta = amplitude * np.sin(2.0 * np.pi * np.arange(800) / 800.0)
    rival = DryFriction("knee", 2.0 * amplitude)
    z = rival.local_columns(0.0 * theta, 0.0 * theta, theta, 0.0 * theta)
    narrow = rival.widths < amplitude
    np.testing.assert_allclose(z[200, narrow], np.tanh(amplitude / rival.widths[narrow]), rtol=1e-2)
    np.testing.assert_allclose(z[600], -z[200], atol=0.2)


def test_where_it_can_be(nothing_missing):
    bench = nothing_missing[0]
    assert creeping(bench, make_effect("spring_hysteresis", "knee")) == (Creep("knee"),)
    push = make_effect("external_force", "knee", start=1.0, stop=2.0, period=5.0)
    assert creeping(bench, push) == (Creep("hip"), Creep("knee"), Creep("ankle"))
    assert creeping(bench, make_effect("torque_ripple", "knee")) == ()
    assert creeping(bench, make_effect("base_tilt")) == ()
    with pytest.raises(EffectError, match="creep"):
        Creep("knee").torque(bench.robot, np.ones(1))


@pytest.mark.scenario
def test_creep_is_no_hysteresis(laboratory, leg):
    stiffness = 0.3 * leg.spring("knee").stiffness
    bench = laboratory.bench(laboratory.record([(PlantedCreep("knee", 0.25), [stiffness])], periods=10, step=STEP))
    selection = found(bench)
    assert lack_of_fit(bench, selection.final)[2] < LACK_LEVEL
    (one,) = unnamed(bench, selection, None)
    assert (one.effect, one.joint) == ("spring_hysteresis", "knee")
    assert one.share < 0.05
    fit = bench.again(one.solution, selection.final.noise)
    assert fit.effects[-1].time_constant == pytest.approx(0.25, rel=0.05)
    assert fit.parameters["knee.creep"] == pytest.approx(stiffness, rel=0.05)
    assert "in the spring of knee, as one that creeps with a time constant of 0.2" in one.sentence
    confirmed = Confirmed(selection, bench, selection.start, selection.final)
    said = conclude(bench, confirmed, TrendTest(1.0, (), False), {}, None, None, Findings(), (one,))
    assert said.verdict is Verdict.NOT_IN_LIBRARY
    assert one.sentence in said.text


@pytest.mark.scenario
@pytest.mark.parametrize(
    "beside",
    [
        pytest.param(("spring_hysteresis", "knee", [1.0, 0.6], {"slip": 0.012}), marks=pytest.mark.slow),
        ("torque_ripple", "hip", [1.5, 1.0], {"order": 4.0}),
    ],
)
def test_hysteresis_is_no_creep_whatever_else_is_missing(laboratory, beside):
    """More elements of dry friction than the library has, or another effect that has not been found."""
    own = ("spring_hysteresis", "knee", [1.0, 0.6], {"slip": 0.002})
    bench = laboratory.bench(laboratory.record([own, beside], periods=5))
    selection = found(bench, 0.003)
    assert lack_of_fit(bench, selection.final)[2] < LACK_LEVEL
    assert unnamed(bench, selection, None) == ()


@pytest.mark.scenario
def test_dry_friction_that_hardly_slips_is_no_creep(laboratory):
    """It is less like the form of the library than like creep, and most like dry friction that is wider."""
    planted = [(PlantedBoucWen("ankle"), [1.0])]
    bench = laboratory.bench(laboratory.record(planted, periods=6, settling=Settling()))
    selection = found(bench, 0.002, "ankle")
    now, noise = selection.final.fit, selection.final.noise
    creep = refitted(bench, now.effects[:-1], Creep("ankle", 4.0), (), noise, now.parameters)
    assert creep.statistic < now.statistic - 2000.0
    assert not no_dry_friction(bench, creep, -1, noise)
    assert unnamed(bench, selection, None) == ()
