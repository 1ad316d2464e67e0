"""Columns of trends: of every period its own, of torques those that were measured, at times of the recording."""

from dataclasses import replace

import numpy as np
import pytest

from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.settle import settle
from sea_ident.discrepancy.measured import check
from sea_ident.discrepancy.measured.data import spectrum
from sea_ident.discrepancy.trends.trend_directions import PeriodColumns, steady_rows, with_course
from sea_ident.discrepancy.trends.trend_values import Course, CourseValues, course_values
from sea_ident.effects import make_effect


@pytest.fixture(scope="module")
def recording(laboratory):
    """A leg whose hip spring loses a third of its stiffness within a minute, and whose knee gets warm to no effect."""
    warm = ("temperature_friction", "knee", [0.0, 0.0], {"time_constant": 24.0})
    return laboratory.record([("stiffness_drift", "hip", [-150.0], {}), warm])


@pytest.fixture(scope="module")
def softening(laboratory, recording):
    bench = laboratory.bench(recording)
    return bench, settle(bench, bench.effects).fit


@pytest.mark.scenario
def test_columns_of_a_period_are_those_of_its_own_deflection(softening):
    bench, fit = softening
    data, effect = bench.data, make_effect("stiffness_drift", "hip")
    changes = bench.period_column_changes(effect, fit)
    equations = [(e.joint, str(e.kind)) for e in data.equations]
    motor = equations.index(("hip", "motor"))
    first, last = (
        spectrum(data.period_motions[p].deflection[:, :1] - data.motion.deflection[:, :1], data.harmonics)[:, 0]
        for p in (0, -1)
    )
    size = np.linalg.norm(last)
    assert size > 0.05 * np.linalg.norm(spectrum(data.motion.deflection[:, :1], data.harmonics))
    np.testing.assert_allclose(changes[0, :, motor, 0], first, atol=0.02 * size)
    np.testing.assert_allclose(changes[-1, :, motor, 0], last, atol=0.02 * size)
    assert np.all(changes[:, :, equations.index(("knee", "motor"))] == 0.0)


@pytest.mark.scenario
def test_a_torque_constant_drifts_by_the_torque_that_was_measured(softening):
    """Not by what a model that may lack half of it says."""
    bench, fit = softening
    rows = steady_rows(bench, fit, make_effect("torque_constant_drift", "knee"))
    np.testing.assert_array_equal(rows.motor[:, 1, 0], bench.data.tau_motor[:, 1])
    assert np.all(rows.link == 0.0)


@pytest.mark.scenario
def test_periods_left_out_keep_their_places(laboratory, recording):
    """Of the last periods but one, at their times, with their temperatures."""
    whole = laboratory.data(recording)
    data = check.subset(whole, [1, 2, 4, 7])
    assert data.starts == pytest.approx(np.array([1, 2, 4, 7]) * 5.0 + whole.starts[0])
    own = recording.columns["temperature_knee"][-8 * whole.samples :].reshape(8, -1).mean(axis=1)
    found = check.temperatures(recording, data)
    np.testing.assert_allclose(found[:, 1], own[np.array(data.places)], rtol=1e-12)
    bench = Bench(data, laboratory.effects)
    effect = make_effect("temperature_friction", "knee")
    columns = np.ones((4, 3, 2))
    course = with_course(effect, columns, bench.data.starts + 2.5, found[:, 1])
    np.testing.assert_allclose(course.profile, found[:, 1] - found[:, 1].mean())


def test_a_rate_of_the_torque_is_told_for_the_start():
    """Torque m / (1 + a g): its change beside its own mean, as a share of that, and beside the start."""
    effect, a, mean = make_effect("torque_constant_drift", "knee"), 0.3, 0.8
    beside_mean = np.array([-a / (1.0 + a * mean)])
    np.testing.assert_allclose(effect.referred(beside_mean, mean), [-a], rtol=1e-12)
    np.testing.assert_allclose(effect.referred(np.array([-a]), -mean), beside_mean, rtol=1e-12)
    other = np.array([1.0, 2.0])
    np.testing.assert_array_equal(make_effect("friction_drift", "knee").referred(other, mean), other)


@pytest.mark.scenario
def test_a_softer_spring_carries_less_load_in_what_depends_on_it(softening):
    """Friction c |load| sgn v takes its load from the model: of K d of the mean, where a period has another K."""
    bench, fit = softening
    added = make_effect("load_dependent_friction", "hip")
    (load,) = bench.anchored((*fit.effects, added), fit.parameters)[-1:]
    with_it = bench.fit((*fit.effects, load), bench.noise(fit), start=fit.parameters)
    with_it = replace(with_it, values=np.append(with_it.values[:-1], 0.2))
    rows = steady_rows(bench, with_it, make_effect("stiffness_drift", "hip"))
    motion = bench.state(with_it.effects).motion
    torque = load.spring_load(bench.robot, motion.deflection[:, 0], motion.deflection_rate[:, 0])
    friction = 0.2 * np.sign(torque) * motion.deflection[:, 0] * load.sign(motion.dtheta[:, 0])
    away = np.abs(torque) > 0.01 * np.abs(torque).max()
    np.testing.assert_allclose(rows.motor[away, 0, 0], (motion.deflection[:, 0] + friction)[away], rtol=1e-6, atol=1e-9)
    np.testing.assert_array_equal(rows.link[:, 0, 0], -motion.deflection[:, 0])


def told(columns, direction, values, middle, temperature=None):
    found = CourseValues(np.array(values), np.ones(len(values)))
    return columns.inside(direction, found, middle, temperature)


@pytest.mark.scenario
def test_what_bends_is_seen_when_its_columns_are_large(softening):
    """In a half of a period in which a spring is hardly bent, its stiffness does not show."""
    bench, fit = softening
    columns = PeriodColumns(bench, fit, bench.noise_of_cut(fit))
    cause = next(c for c in columns.causes(None) if c.name == ("stiffness_drift", "hip"))
    middle = bench.data.starts + 0.5 * bench.data.period
    straight, bent = (
        told(columns, with_course(replace(cause.effect, time_constant=c), columns.within(cause), middle), [1.0], middle)
        for c in (1e6, 20.0)
    )
    assert straight.values == pytest.approx([1.0], abs=1e-4)
    half = np.exp(0.5 * bench.data.period / 20.0)
    assert 1.0 / half < bent.values[0] < half
    assert abs(bent.values[0] - 1.0) > 0.005
    assert bent.stds == pytest.approx(bent.values)
    assert told(columns, with_course(cause.effect, columns.within(cause), middle), [0.0], middle).values == [0.0]
    # a first period that was left out has a temperature all the same
    later, warm = middle[1:], np.linspace(20.0, 30.0, len(middle))
    direction = with_course(replace(cause.effect, time_constant=20.0), columns.within(cause), middle)
    found = told(columns, direction.over(slice(1, None)), [1.0], later, warm)
    assert found.values == pytest.approx(bent.values, rel=0.02)


@pytest.mark.scenario
def test_columns_that_are_large_one_after_the_other_are_told_apart(softening):
    """Viscous friction is large where a motor is fast, and what bends has changed more or less by then."""
    bench, fit = softening
    noise = bench.noise_of_cut(fit)
    columns = PeriodColumns(bench, fit, noise)
    cause = next(c for c in columns.causes(None) if c.name == ("friction_drift", "knee"))
    middle = bench.data.starts + 0.5 * bench.data.period
    direction = with_course(replace(cause.effect, time_constant=8.0), columns.within(cause), middle)
    # what the periods differ by, sample by sample
    rows, truth = steady_rows(bench, fit, cause.effect), np.array([0.3, -0.5])
    time = bench.data.starts[:, None] + bench.data.period * (np.arange(bench.data.samples) + 0.5) / bench.data.samples
    change = direction.effect.change(time, None)[:, :, None, None]
    periods = [
        columns.flat(
            bench.spectra_of(replace(rows, link=rows.link * each, motor=rows.motor * each), fit.effects)
            * fit.scale[:, None]
        )
        @ truth
        for each in change
    ]
    flat = np.stack(periods) - np.mean(periods, axis=0)
    alike = np.broadcast_to(cause.columns, (len(flat), *cause.columns.shape))
    (seen,) = course_values(flat, [Course(direction.profile, alike)])
    found = columns.inside(direction, seen, middle, None)
    assert np.max(np.abs(seen.values - truth)) > 0.005
    assert found.values == pytest.approx(truth, abs=5e-4)
