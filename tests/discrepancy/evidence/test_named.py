"""What is told of an effect that was found."""

from dataclasses import replace

import numpy as np
import pytest

from sea_ident.discrepancy.bench.settle import Settled, settle, settle_again
from sea_ident.discrepancy.conclude import conclude
from sea_ident.discrepancy.evidence import named
from sea_ident.discrepancy.evidence.named import _as_seen, _shift_by_the_mean, named_effect, named_effects
from sea_ident.discrepancy.evidence.uncertainty import uncertainties
from sea_ident.discrepancy.evidence.unseen import Beside
from sea_ident.discrepancy.measured.check import Findings
from sea_ident.discrepancy.result.findings import Alternative
from sea_ident.discrepancy.search.confirm import Confirmed
from sea_ident.discrepancy.search.powers import with_open_powers
from sea_ident.discrepancy.search.search import Selection
from sea_ident.discrepancy.trends.trend import TrendTest, compare_periods
from sea_ident.discrepancy.trends.trend_within import within_periods
from sea_ident.effects import make_effect
from sea_ident.simulation import FrictionJitter


@pytest.mark.scenario
@pytest.mark.parametrize(("share", "known"), [(0.1, True), (0.6, False)])
def test_where_dry_friction_in_a_spring_slips_shows_only_where_it_does(laboratory, nothing_missing, share, known):
    """What sticks all the time is a spring and a constant, whatever it would slip at."""
    usual, start = nothing_missing
    slip = share * float(np.ptp(usual.data.motion.deflection[:, 0]))
    bench = laboratory.bench(laboratory.record([("spring_hysteresis", "hip", [0.5, 0.5], {"slip": slip})]))
    effect = make_effect("spring_hysteresis", "hip", slip=slip)
    fit = bench.fit((*start.fit.effects, effect), start.noise, start=start.fit.parameters)
    now = Settled(fit, start.noise)
    found = named_effect(bench, fit, len(fit.effects) - 1, uncertainties(bench, now), 0.0, ())
    told = {p.name.removeprefix("hip.spring_hysteresis_"): p for p in found.parameters}
    assert set(told) == {"narrow", "wide", "slip"}
    assert told["slip"].value == pytest.approx(slip)
    unsure = {name: p.std >= abs(p.value) for name, p in told.items()}
    assert unsure["slip"] == (not known)
    assert known or all(unsure.values())


@pytest.mark.scenario
def test_the_power_that_a_search_tried_is_told_with_what_is_known_of_it(laboratory, nothing_missing):
    """A spring that stiffens by a power of 2.015, fitted with 2: as sure of its size as of its power."""
    _, start = nothing_missing
    planted = [("spring_stiffening", "knee", [4000.0], {"exponent": 2.015})]
    bench = laboratory.bench(laboratory.record(planted))
    effects = (*start.fit.effects, make_effect("spring_stiffening", "knee", exponent=2.0))
    now = Settled(bench.fit(effects, start.noise, start=start.fit.parameters), start.noise)
    open_ = with_open_powers(bench, now)
    assert with_open_powers(bench, start) is start
    told = [
        named_effect(bench, now.fit, len(effects) - 1, uncertainties(bench, each), 0.0, (), each.fit.free_shapes)
        for each in (now, open_)
    ]
    held, free = ({p.name.removeprefix("knee.spring_stiffening_"): p for p in each.parameters} for each in told)
    assert told[1].detail == effects[-1]
    assert (held["exponent"].value, held["exponent"].std) == (free["exponent"].value, 0.0) == (2.0, 0.0)
    assert held["power"].value == free["power"].value
    for name, planted_value in (("power", 4000.0), ("exponent", 2.015)):
        assert abs(free[name].value - planted_value) < 3.0 * free[name].std
    assert free["power"].std > 3.0 * held["power"].std
    (both,) = named_effects(bench, Selection(start, now, 1, (0.0,)), {}, None)
    assert both.parameters == told[1].parameters


def test_what_columns_have_in_common_is_told_of_none_of_them():
    """As of a force along the axis of the only joint that it could move: the least is told, and that it may be off."""
    rng, push = np.random.default_rng(3), make_effect("external_force", "hip")
    axis = np.array([0.3, -0.6, 0.2])
    across = np.linalg.svd(axis[None])[2][1:]
    spectra = (rng.standard_normal((20, 2, 2)) + 1j * rng.standard_normal((20, 2, 2))) @ across
    force = np.array([4.0, 1.0, -2.0])
    least, unseen = _as_seen(push, spectra, force)
    np.testing.assert_allclose(spectra @ least, spectra @ force, atol=1e-12)
    assert least @ axis == pytest.approx(0.0, abs=1e-9)
    np.testing.assert_allclose(unseen, np.abs(axis) / np.linalg.norm(axis) * np.linalg.norm(least), rtol=1e-9)
    # with a column that is not seen at all, and with columns that have nothing in common
    hidden, none = _as_seen(push, np.concatenate([spectra, 0.0 * spectra[:, :, :1]], axis=2), np.array([*force, 7.0]))
    np.testing.assert_allclose(hidden, [*least, 7.0], rtol=1e-9)
    assert none[3] == 0.0
    other = spectra + 1e-3 * rng.standard_normal(spectra.shape)
    same, known = _as_seen(push, other, force)
    assert (same == force).all()
    assert not known.any()
    for nothing in (spectra[:, :, :0], 0.0 * spectra):
        found, off = _as_seen(push, nothing, force[: nothing.shape[2]])
        assert (found == force[: nothing.shape[2]]).all()
        assert not off.any()


@pytest.mark.scenario
def test_a_torque_constant_may_have_been_as_described_before_it_drifted_or_in_the_mean(laboratory, monkeypatch):
    """Nothing in the model takes up what it is off by in the mean, so a loss by load does."""
    planted = [("directional_efficiency", "hip", [0.2], {}), ("torque_constant_drift", "hip", [0.06], {})]
    bench = laboratory.bench(laboratory.record(planted, periods=12, jitter=FrictionJitter.none()))
    start = settle(bench, bench.effects)
    effects = bench.anchored((*start.fit.effects, make_effect("directional_efficiency", "hip")), start.fit.parameters)
    now = settle_again(bench, bench.fit(effects, start.noise, start=start.fit.parameters))
    (trend,) = compare_periods(bench, now.fit).trends
    assert (trend.effect.name, trend.effect.joint) == ("torque_constant_drift", "hip")
    less = bench.comparing(replace(bench.data, known=within_periods(bench, now.fit, [trend])))
    now = settle_again(less, now.fit)
    plain = uncertainties(less, now)[len(now.fit.columns) - 1]
    # what else would take it up is another matter
    monkeypatch.setattr(named, "beside_others", lambda *_: ())
    (found,) = named_effects(less, Selection(start, now, 1, (0.0,)), {}, None, [trend])
    (loss,) = found.parameters
    assert abs(loss.value - 0.2) > 5.0 * plain
    assert abs(loss.value - 0.2) < 2.0 * loss.std
    # by as much as it is another one beside what the motor is off by in the mean
    mean = float(np.mean(trend.effect.change(less.data.starts + 0.5 * less.data.period, None)))
    known = less.data.known.copy()
    known[:, 0] += mean * trend.values[0] * less.data.tau_motor[:, 0]
    more = less.comparing(replace(less.data, known=known))
    there = more.fit(now.fit.effects, now.noise, start=now.fit.parameters)
    shift = _shift_by_the_mean(less, now, trend)[len(now.fit.columns) - 1]
    assert shift == pytest.approx(now.fit.values[-1] - there.values[-1], rel=0.1)
    # a diagnosis tells it so
    confirmed = Confirmed(Selection(start, now, 1, (0.0,)), less, start, now)
    whole = conclude(less, confirmed, TrendTest(0.0, (trend,), False), {}, None, None, Findings(), ())
    (told,) = next(m for m in whole.missing if m.effect == "directional_efficiency").parameters
    assert told == loss
    # of friction the model has parameters
    friction = replace(trend, effect=make_effect("friction_drift", "hip"), values=np.array([0.0, 1.0]))
    assert not np.any(_shift_by_the_mean(less, now, friction))


def test_what_an_effect_may_be_instead_is_not_beside_it(nothing_missing, monkeypatch):
    """A better model with an effect beside it adds to what a parameter may be off by; one that it may be does not."""
    bench, start = nothing_missing
    effect = make_effect("torque_offset", "hip")
    now = Settled(bench.fit((*start.fit.effects, effect), start.noise, start=start.fit.parameters), start.noise)
    count = len(now.fit.columns) + len(now.fit.free_shapes)
    other = Beside(make_effect("motor_encoder_offset", "hip"), np.zeros(count), np.full(count, 3.0), True)
    monkeypatch.setattr(named, "beside_others", lambda *_: (other,))
    position = len(start.fit.effects)

    def told(*instead):
        alternatives = {position: tuple(Alternative(*which, 1.0) for which in instead)}
        (found,) = named_effects(bench, Selection(start, now, 1, (0.0,)), alternatives, None)
        return found.parameters[0].std

    alone = told(("motor_encoder_offset", "hip"))
    assert alone < 0.1
    assert told() == pytest.approx(np.hypot(alone, 3.0))
    assert told(("motor_encoder_offset", "knee")) == told(("encoder_offset", "hip")) == told()
