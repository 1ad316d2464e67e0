"""Trends: seen with their value where they are, and rarely by chance."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.settle import settle
from sea_ident.discrepancy.measured import check
from sea_ident.discrepancy.trends import trend as trend_module
from sea_ident.discrepancy.trends.trend import _is_over_soon, _omnibus, compare_periods
from sea_ident.effects import effect_classes, make_effect
from sea_ident.effects.temperature_friction import TemperatureFriction
from sea_ident.recordings import Recording
from sea_ident.simulation import FrictionJitter

LEVEL = 0.05
DRAWS = 1000
KNEE = 2  # equation of the motor of the knee


def compared(bench):
    now = settle(bench, bench.effects)
    return compare_periods(bench, now.fit)


@pytest.fixture(scope="module")
def opposite(laboratory):
    """Coulomb friction that falls by 0.6 N m a minute at the hip and rises by 0.8 at the ankle."""
    planted = [("friction_drift", "hip", [0.0, -0.6], {}), ("friction_drift", "ankle", [0.0, 0.8], {})]
    return compared(laboratory.bench(laboratory.record(planted, periods=16)))


@pytest.fixture(scope="module")
def softening(laboratory):
    """Bench and settled model of a leg whose hip spring loses a third of its stiffness within a minute."""
    bench = laboratory.bench(laboratory.record([("stiffness_drift", "hip", [-150.0], {})], periods=12))
    return bench, settle(bench, bench.effects)


@pytest.mark.scenario
@pytest.mark.parametrize(("drift", "seen", "named"), [(0.14, 1e-3, []), (0.25, 1e-4, ["friction_drift"])])
def test_a_trend_that_one_recording_in_a_thousand_shows_by_chance_has_no_name(laboratory, drift, seen, named):
    found = compared(laboratory.bench(laboratory.record([("friction_drift", "knee", [0.0, drift], {})], periods=12)))
    assert 0.0 < found.p_value < seen
    assert [trend.effect.name for trend in found.trends] == named
    assert not found.unnamed


@pytest.mark.scenario
def test_two_drifts_of_opposite_sign_are_named_at_their_joints(opposite):
    assert opposite.p_value < 1e-6
    assert not opposite.unnamed
    assert {(t.effect.name, t.effect.joint) for t in opposite.trends} == {
        ("friction_drift", "hip"),
        ("friction_drift", "ankle"),
    }


@pytest.mark.scenario
def test_a_third_drift_has_a_name_too(laboratory):
    planted = [
        ("stiffness_drift", "ankle", [-20.0], {}),
        ("stiffness_drift", "hip", [-60.0], {}),
        ("torque_constant_drift", "knee", [-0.1], {}),
    ]
    found = compared(laboratory.bench(laboratory.record(planted, periods=12)))
    assert {(t.effect.name, t.effect.joint) for t in found.trends} == {(name, joint) for name, joint, *_ in planted}
    assert not found.unnamed


@pytest.mark.scenario
@pytest.mark.parametrize(("second", "joint", "named"), [(0.04, "knee", 1), (0.1, "knee", 2), (0.04, "hip", 2)])
def test_what_the_form_of_a_large_drift_leaves_at_its_joint_is_no_other_drift(laboratory, second, joint, named):
    planted = [
        ("friction_drift", "knee", [0.0, 3.0], {}),
        ("torque_constant_drift", joint, [second], {}),
    ]
    found = compared(laboratory.bench(laboratory.record(planted, periods=12)))
    assert {(t.effect.name, t.effect.joint) for t in found.trends} == {(name, at) for name, at, *_ in planted[:named]}


@pytest.mark.scenario
def test_drifts_have_their_values(opposite):
    """Whichever time constant was taken: the change within the minute that was recorded."""
    for trend in opposite.trends:
        true = {"hip": -0.6, "ankle": 0.8}[trend.effect.joint]
        # change from the first period to the last, by the time constant that was found
        span = np.diff(trend.effect.change(np.array([2.5, 57.5]), None))[0]
        change, std = trend.values[1] * span, trend.stds[1] * span
        assert abs(change - true * 55.0 / 60.0) < 4.0 * std
        assert std < 0.1
        # of the viscous friction nothing changed
        assert abs(trend.values[0]) <= 4.0 * trend.stds[0] + 1e-12


@pytest.mark.scenario
def test_a_spring_that_warms_up_has_its_first_rate_and_its_time_constant(laboratory):
    """Every deflection is another, of the first periods most: these are no start that settles."""
    planted = [("stiffness_drift", "hip", [-250.0], {"time_constant": 20.0})]
    bench = laboratory.bench(laboratory.record(planted, periods=12))
    assert bench.data.periods == 12
    now = settle(bench, bench.effects)
    (trend,) = compare_periods(bench, now.fit).trends
    assert (trend.effect.name, trend.effect.joint, trend.alternatives) == ("stiffness_drift", "hip", ())
    assert abs(trend.values[0] + 250.0) < 3.0 * trend.stds[0] < 15.0
    assert abs(trend.effect.time_constant - 20.0) < 3.0 * trend.time_constant_std < 1.5


@pytest.mark.scenario
def test_a_rate_is_that_of_the_start_whenever_in_a_period_it_shows(laboratory):
    """This spring is bent most in the first half of every period: its stiffness there is that of an earlier time."""
    planted = [("stiffness_drift", "knee", [60.0], {"time_constant": 27.0})]
    bench = laboratory.bench(laboratory.record(planted, periods=16, jitter=FrictionJitter.none()))
    (trend,) = compare_periods(bench, settle(bench, bench.effects).fit).trends
    assert (trend.effect.name, trend.effect.joint) == ("stiffness_drift", "knee")
    assert abs(trend.values[0] - 60.0) < 2.5 * trend.stds[0]
    # a rate goes with its time constant: what both come to is known better than either
    assert trend.values[0] * trend.effect.time_constant == pytest.approx(60.0 * 27.0, rel=0.006)


@pytest.mark.scenario
def test_a_torque_constant_that_drifts_much_has_its_first_rate(laboratory):
    """Half of it within two minutes: the torque that the record shows is another share of every other one."""
    bench = laboratory.bench(laboratory.record([("torque_constant_drift", "knee", [-0.25], {})], periods=16))
    now = settle(bench, bench.effects)
    (trend,) = compare_periods(bench, now.fit).trends
    assert (trend.effect.name, trend.effect.joint) == ("torque_constant_drift", "knee")
    assert abs(trend.values[0] + 0.25) < 3.0 * trend.stds[0] < 0.06


@pytest.mark.scenario
def test_friction_that_follows_a_temperature_is_named_so_with_periods_left_out(laboratory):
    recording = laboratory.record([("temperature_friction", "knee", [0.0, -0.05], {"time_constant": 24.0})], periods=12)
    whole = laboratory.data(recording)
    data = check.subset(whole, [p for p in range(whole.periods) if p not in (0, 1, 6)])
    bench = Bench(data, laboratory.effects)
    now = settle(bench, bench.effects)
    (trend,) = compare_periods(bench, now.fit, check.temperatures(recording, data)).trends
    assert (trend.effect.name, trend.effect.joint) == ("temperature_friction", "knee")
    assert np.all(np.abs(trend.values - [0.0, -0.05]) < 3.0 * trend.stds)
    # the temperature goes the way that a drift goes by itself: nothing tells the two apart
    ((other, cos2),) = trend.alternatives
    assert (other.name, other.joint) == ("friction_drift", "knee")
    assert cos2 > 0.95


@pytest.mark.scenario
def test_a_temperature_that_goes_its_own_way_is_no_drift(laboratory, monkeypatch):
    """It rises for half of the recording and falls again: no course in time does that."""

    def rise_and_fall(effect, time):
        return effect.reference + 15.0 * np.sin(np.pi * time / 60.0)

    monkeypatch.setattr(TemperatureFriction, "temperature", rise_and_fall)
    effect = make_effect("temperature_friction", "knee")
    recording = laboratory.recorded_anew([(effect, [0.0, -0.05])], periods=12)
    bench = laboratory.bench(recording)
    now = settle(bench, bench.effects)
    (trend,) = compare_periods(bench, now.fit, check.temperatures(recording, bench.data)).trends
    assert (trend.effect.name, trend.effect.joint, trend.alternatives) == ("temperature_friction", "knee", ())


@pytest.mark.scenario
def test_what_the_library_lacks_is_not_named_by_a_part_of_it(softening, monkeypatch):
    """A spring that softens, with no such effect to name: something changes, and nothing that is known does that."""
    bench, now = softening
    less = {name: kind for name, kind in effect_classes().items() if name != "stiffness_drift"}
    monkeypatch.setattr("sea_ident.discrepancy.trends.trend_directions.effect_classes", lambda: less)
    found = compare_periods(bench, now.fit)
    assert found.trends == ()
    assert found.unnamed


@pytest.mark.scenario
@pytest.mark.parametrize(("share", "unnamed"), [(0.1, False), (0.4, True)])
def test_what_a_large_drift_leaves_by_its_form_is_no_other_trend(laboratory, leg, share, unnamed):
    """Beside friction that becomes ten times as large, a torque that swings and grows with time, as no effect does."""
    recording = laboratory.record([("friction_drift", "knee", [0.0, 10.0], {})], periods=16)
    since = recording.time - recording.time[0]
    drive = leg.joints[1].actuator
    swinging = share * 10.0 * since / 60.0 * np.sin(2.0 * np.pi * 6.0 * since / 5.0)
    current = recording.columns["current_knee"] + swinging / (drive.gear_ratio * drive.torque_constant)
    columns = {**recording.columns, "current_knee": current}
    found = compared(laboratory.bench(Recording(recording.time, columns, "swinging")))
    assert [(t.effect.name, t.effect.joint) for t in found.trends] == [("friction_drift", "knee")]
    assert found.unnamed is unnamed


def test_a_leg_that_stays_as_it_is_has_no_trend(nothing_missing):
    bench, now = nothing_missing
    found = compare_periods(bench, now.fit)
    assert found.p_value > 1e-3
    assert (found.trends, found.unnamed, found.notes) == ((), False, ())


@pytest.mark.scenario
@pytest.mark.parametrize("amplitude", [3.0, 6.0])
def test_a_start_that_still_settles_is_no_trend(laboratory, monkeypatch, amplitude):
    """The first period is pulled, strongly at first and less and less: said, and not named."""
    recording = laboratory.record(periods=8)
    since = recording.time - recording.time[0]
    current = recording.columns["current_knee"] + amplitude * np.exp(-since / 1.5) * (since < 5.0)
    pulled = Recording(recording.time, {**recording.columns, "current_knee": current}, "pulled")
    bench = laboratory.bench(pulled)
    found = compared(bench)
    assert found.trends == ()
    assert not found.unnamed
    assert "the first period differs from the 7 later ones, which are alike: the motion" in found.notes[0]
    # where the others differ among themselves too, it is not said that they do not
    monkeypatch.setattr("sea_ident.discrepancy.trends.trend.LEVEL", 1.0)
    assert "the first period differs from the 7 later ones: the motion" in compared(bench).notes[0]


def test_what_is_not_known_at_the_ends_of_a_recording_is_no_start_that_settles(nothing_missing):
    """What came before the first sample is assumed, so its accelerations are off, in the first period alone."""
    bench, _ = nothing_missing
    first = bench.data.period_motions[0]
    ends = np.zeros((bench.data.samples, 1))
    ends[:5] = ends[-5:] = 1.0
    noise = np.std([m.ddtheta for m in bench.data.period_motions], axis=0)

    def differing(where, size):
        moved = replace(first, ddtheta=first.ddtheta + size * noise.mean(axis=0) * where)
        motions = (moved, *bench.data.period_motions[1:])
        return compared(Bench(replace(bench.data, period_motions=motions), bench.effects)).notes

    assert differing(ends, 40.0) == ()
    # as much in its midst is told
    assert "the first period differs" in differing(np.roll(ends, 300, axis=0), 40.0)[0]


def test_friction_that_is_another_in_the_first_period_alone_is_a_start(nothing_missing):
    """Too little of the residual to set that period apart as a whole, but the pattern of one effect."""
    bench, _ = nothing_missing
    data, knee = bench.data, bench.robot.index("knee")

    def started(size, period):
        torque = data.period_tau_motor.copy()
        torque[period, :, knee] += size * np.tanh(data.period_motions[period].dtheta[:, knee] / 0.02)
        changed = Bench(replace(data, period_tau_motor=torque, tau_motor=torque.mean(axis=0)), bench.effects)
        return bool(compared(changed).notes)

    assert started(0.2, 0)
    assert not started(0.02, 0)
    assert not started(0.2, 1)


def test_three_periods_show_no_trend(laboratory):
    assert compared(laboratory.bench(laboratory.record(periods=3))).p_value == 1.0


# -- synthetic residuals


def test_size_of_the_test_of_everything_at_once(nothing_missing):
    rng = np.random.default_rng(12)
    middle = np.arange(10.0)
    rejected = 0
    for _ in range(DRAWS):
        flat = rng.standard_normal((10, 400))
        rejected += _omnibus(flat - flat.mean(axis=0), middle, nothing_missing[1].noise) < LEVEL
    assert 0.02 < rejected / DRAWS < 0.09


@pytest.mark.scenario
@pytest.mark.parametrize(("time_constant", "named"), [(4.0, False), (7.0, True)])
def test_what_is_over_within_a_period_has_no_rate_and_no_name(laboratory, time_constant, named):
    planted = [("torque_constant_drift", "hip", [0.4], {"time_constant": time_constant})]
    bench = laboratory.bench(laboratory.record(planted, periods=10))
    now = settle(bench, bench.effects)
    found = compare_periods(bench, now.fit)
    assert found.p_value < 1e-3
    assert [(t.effect.name, t.effect.joint) for t in found.trends] == [("torque_constant_drift", "hip")] * named
    assert any("torque_constant_drift at hip" in note and "over so soon" in note for note in found.notes) is not named


@pytest.mark.scenario
@pytest.mark.parametrize(("deviations", "p_value", "named"), [(0.9, 1e-5, False), (1.1, 1e-5, True), (0.9, 1e-7, True)])
def test_a_rate_within_its_own_deviation_is_not_told(laboratory, monkeypatch, deviations, p_value, named):
    """Periods that differ as a drift makes them, p 1e-4, with a rate of -0.006 +- 0.007 1/min: nothing to name.

    Where they do beyond doubt, its rate at the start may be that unsure because it may have bent.
    """
    planted = [("torque_constant_drift", "hip", [0.1], {"time_constant": 1e4})]
    bench = laboratory.bench(laboratory.record(planted, periods=10))
    now = settle(bench, bench.effects)

    def less_sure(*given):
        told = whole(*given)
        return replace(told, stds=np.abs(told.values) / deviations, p_value=p_value)

    whole = trend_module._trend
    monkeypatch.setattr(trend_module, "_trend", less_sure)
    found = compare_periods(bench, now.fit)
    assert found.p_value < 1e-3
    assert [(t.effect.name, t.effect.joint) for t in found.trends] == [("torque_constant_drift", "hip")] * named
    notes = [note for note in found.notes if "torque_constant_drift at hip" in note and "Record more periods" in note]
    assert len(notes) == (not named)


@pytest.mark.parametrize(
    ("time_constant", "bent", "soon"), [(9.9, True, True), (10.1, True, False), (9.9, False, False)]
)
def test_a_drift_is_over_soon_where_its_time_constant_is_that_of_a_period_or_two(
    nothing_missing, time_constant, bent, soon
):
    """What goes on for longer has a name where its rate is known a little."""
    bench, _ = nothing_missing
    assert bench.data.period == pytest.approx(5.0)
    drift = make_effect("friction_drift", "hip", time_constant=time_constant)
    assert _is_over_soon(bench, SimpleNamespace(effect=drift, bent=bent)) == soon
