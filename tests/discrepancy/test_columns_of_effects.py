"""Columns of effects as spectra."""

import numpy as np
import pytest

from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.columns import without_digits
from sea_ident.discrepancy.bench.settle import settle, settle_again
from sea_ident.discrepancy.measured.check import subset
from sea_ident.discrepancy.measured.data import (
    away_from_reversals,
    equation_row,
    period_data,
    spectrum,
    wide_processing,
)
from sea_ident.effects import State, base_effects, corrected_motion, make_effect, spring_effects
from sea_ident.effects.rigid_bodies import RigidBodies
from sea_ident.regressor import prior_parameters
from sea_ident.robot import load_robot


def test_what_is_less_than_the_digits_of_a_description_is_nothing():
    columns = np.ones((3, 2, 4), dtype=np.complex128) * [1.0, 1e-6, 1e-8, 1e-16]
    np.testing.assert_array_equal(np.any(without_digits(columns), axis=(0, 1)), [True, True, False, False])
    np.testing.assert_array_equal(without_digits(columns)[:, :, :2], columns[:, :, :2])
    assert without_digits(columns[:, :, :0]).shape == (3, 2, 0)
    np.testing.assert_array_equal(without_digits(0.0 * columns), 0.0 * columns)


def test_parameters_that_only_digits_would_show_stay_as_described(laboratory, tmp_path):
    """The leg with axes that are level to eight digits: what acts out of its plane is not seen."""
    text = laboratory.leg.urdf
    assert text.count('<axis xyz="0 -1 0"/>') >= 3
    file = tmp_path / "nearly.urdf"
    file.write_text(text.replace('<axis xyz="0 -1 0"/>', '<axis xyz="3e-9 -1 5e-9"/>'))
    nearly = load_robot(file)
    data = period_data(wide_processing(laboratory.record(), nearly, 5.0), nearly)
    bench = Bench(data, (*base_effects(nearly), *spring_effects(nearly)))
    fit = settle(bench, bench.effects).fit
    described = np.nan_to_num(prior_parameters(nearly, fit.effects))
    inertial = [k for k, c in enumerate(fit.columns) if c.name in set(nearly.inertial_names)]
    assert len(inertial) == 10 * len(nearly.body_indices)
    assert np.max(np.abs(fit.values[inertial] - described[inertial])) < 5.0
    assert fit.statistic < 1.3 * fit.dof


@pytest.mark.parametrize("name", ["viscous_friction", "torque_ripple", "spring_stiffness", "rigid_bodies"])
def test_columns_see_every_signal_that_concerns_them(nothing_missing, name):
    """What is kept for an effect beside errors of sensors is what it is on the motion without any of them."""
    bench = nothing_missing[0]
    delays = [make_effect("position_delay", joint, delay=0.004) for joint in ("hip", "knee")]
    delays.append(make_effect("torque_delay", "hip", delay=0.003))
    library = {(e.name, e.joint): e for e in bench.effects}
    library["torque_ripple", "hip"] = make_effect("torque_ripple", "hip", order=8.0)
    effect = next(e for (kind, joint), e in library.items() if kind == name and joint in ("hip", None))
    for signals in [(), (delays[0],), (delays[1],), (delays[0], delays[1]), tuple(delays)]:
        part = effect.evaluate(State(bench.robot, corrected_motion(bench.robot, signals, bench.data.motion)))
        for signal in signals:
            part = signal.shifted(bench.robot, bench.data.motion.time, part)
        rows = np.stack([equation_row(equation, part) for equation in bench.data.equations], axis=1)
        expected = without_digits(spectrum(rows, bench.data.harmonics))
        np.testing.assert_allclose(bench.columns_behind(effect, signals), expected, atol=1e-12)
        alone = bench.variant_spectra((effect,), (*bench.effects, *signals))
        np.testing.assert_allclose(alone[1][:, :, 0], expected[:, alone[0]], atol=1e-12)


def test_what_only_delays_a_torque_changes_no_motion(laboratory):
    bench = laboratory.bench(laboratory.record())
    delays = [make_effect("torque_delay", "knee", delay=delay) for delay in (0.002, 0.003)]
    states = [bench.state((*bench.effects, delay)) for delay in delays]
    assert states[0] is states[1] is bench.state(bench.effects)
    offset = make_effect("encoder_offset", "knee", offset=0.01)
    assert bench.state((*bench.effects, offset, delays[0])) is not states[0]


def test_benches_that_compare_other_samples_of_a_recording_evaluate_once(nothing_missing, monkeypatch):
    bench, start = nothing_missing
    alone = Bench(away_from_reversals(bench.data), bench.effects)
    other = bench.comparing(away_from_reversals(bench.data))
    expected = settle_again(alone, start.fit)
    monkeypatch.setattr(RigidBodies, "evaluate", None)
    found = settle_again(other, start.fit)
    assert found.fit.statistic == expected.fit.statistic
    np.testing.assert_array_equal(found.fit.values, expected.fit.values)
    assert not np.array_equal(other.data.left_out, bench.data.left_out)


def test_another_recording_is_no_other_samples_of_it(nothing_missing, laboratory):
    bench, _ = nothing_missing
    with pytest.raises(ValueError, match="is another recording, or other periods of it"):
        bench.comparing(subset(bench.data, [0, 1, 2, 3]))
