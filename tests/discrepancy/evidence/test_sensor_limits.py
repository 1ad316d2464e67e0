"""What sensors cannot show is no missing effect."""

from dataclasses import replace

import numpy as np
import pytest

from sea_ident import identify
from sea_ident.discrepancy import Verdict, diagnose, searching
from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.lack import LACK_LEVEL, lack_of_fit
from sea_ident.discrepancy.bench.settle import CONSISTENT, settle
from sea_ident.discrepancy.evidence.sensor_limits import (
    HARDLY,
    MOST,
    WORTH_A_WORD,
    hardly_deflected,
    limits,
    steps_cover,
    torque_steps,
)
from sea_ident.discrepancy.measured.closing import SIGNALS
from sea_ident.discrepancy.measured.data import EquationKind, around_reversals, wide_processing
from sea_ident.discrepancy.measured.noise import REPEATED_VARIANCE, noise_from_steps, step_freedom
from sea_ident.reversals import UNCERTAIN_SIGN
from sea_ident.simulation import SensorNoise

PERIOD = 5.0


def steps_of(bits):
    """Encoders without noise, of so many bits at the link and four more at the motor."""
    return SensorNoise(
        link_position=0.0,
        motor_position=0.0,
        link_resolution=2.0 * np.pi / 2**bits,
        motor_resolution=2.0 * np.pi / 2 ** (bits + 4),
        current=0.01,
        motor_torque=0.05,
    )


@pytest.fixture(scope="module")
def coarse(laboratory):
    """Recordings whose periods are all rounded at the same places, by bits; nothing is missing."""
    return {bits: laboratory.record(periods=12, motion=1, sensors=steps_of(bits)) for bits in (12, 14)}


def test_an_error_that_no_scatter_shows_is_added_to_the_floor():
    rng = np.random.default_rng(0)
    steps = rng.standard_normal((20, 41, 2)) + 1j * rng.standard_normal((20, 41, 2))
    floor = noise_from_steps(steps, 20.0, step_freedom(21))
    error = np.zeros((3, 41, 2), dtype=complex)
    error[:, :, 1] = 2.0
    beside = floor.beside(error)
    more = np.zeros((2, 2))
    more[1, 1] = REPEATED_VARIANCE * 4.0
    # of every real part half, and the constant has one only
    np.testing.assert_allclose(beside.covariance[20] - floor.covariance[20], more / 2.0, atol=1e-12)
    assert beside.freedom == floor.freedom
    assert beside.std[1] > floor.std[1]
    assert beside.std[0] == pytest.approx(floor.std[0])


@pytest.mark.scenario
@pytest.mark.parametrize(("bits", "covered", "blind_to"), [(12, True, 5.0), (14, False, 2.0)])
def test_steps_that_repeat_are_in_the_floor_and_nothing_is_looked_for_below_it(
    laboratory, coarse, bits, covered, blind_to
):
    data = laboratory.data(coarse[bits])
    bench = Bench(data, laboratory.effects)
    settled = settle(bench, bench.effects)
    statistic, dof, p_value = lack_of_fit(bench, settled)
    assert p_value > LACK_LEVEL
    # the size is right to the factor of two that it counts with, and the floor is that of the model it is found with
    assert 0.3 < statistic / dof < 1.2
    share = bench.share_of_steps(settled.fit, settled.noise)
    assert WORTH_A_WORD < share <= CONSISTENT
    assert (share > MOST) == covered
    assert steps_cover(bench, settled) == covered
    # the same without: many times what scatters
    blind = Bench(replace(data, step_errors=None), laboratory.effects)
    without = settle(blind, blind.effects)
    assert without.fit.statistic / without.fit.dof > blind_to * statistic / dof
    assert blind.share_of_steps(without.fit, without.noise) == 0.0
    assert not steps_cover(blind, without)


@pytest.mark.scenario
def test_a_velocity_that_steps_blur_has_fewer_harmonics_and_no_sign_near_its_reversals(laboratory, coarse, monkeypatch):
    data = laboratory.data(coarse[12])
    told, blind = (
        around_reversals(data.motion, data.equations, data.period_motions, errors)
        for errors in (data.step_errors, None)
    )
    np.testing.assert_array_equal(told & blind, blind)
    assert told.sum() > blind.sum()
    for e, equation in enumerate(data.equations):
        kind = "dq" if equation.kind is EquationKind.LINK else "dtheta"
        error = np.sqrt(np.mean(data.step_errors[:, SIGNALS.index(kind), :, equation.index] ** 2))
        assert np.all(told[np.abs(getattr(data.motion, kind)[:, equation.index]) < UNCERTAIN_SIGN * error, e])
    kept = wide_processing(coarse[14], laboratory.leg, PERIOD).link_harmonics
    monkeypatch.setattr("sea_ident.discrepancy.measured.data._step_errors", lambda *given: None)
    assert kept < wide_processing(coarse[14], laboratory.leg, PERIOD).link_harmonics


@pytest.mark.scenario
def test_a_floor_and_a_fit_follow_each_other_until_the_floor_has_room_for_the_steps(laboratory):
    """The first fit, in white noise, has hardly any inertia, and steps do next to nothing in it."""
    bench = laboratory.bench(laboratory.record(periods=12, sensors=steps_of(12)))
    settled = settle(bench, bench.effects)
    assert bench.share_of_steps(settled.fit, settled.noise) <= CONSISTENT
    assert lack_of_fit(bench, settled)[2] > 0.01


@pytest.mark.scenario
@pytest.mark.parametrize(("bits", "looked_for"), [(12, False), (14, True)])
@pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")
def test_coarse_encoders_are_told_and_nothing_is_named(laboratory, coarse, bits, looked_for, monkeypatch):
    searches, searched = [], searching._searched
    monkeypatch.setattr(searching, "_searched", lambda *given: searches.append(given) or searched(*given))
    model = identify(laboratory.leg, coarse[bits], period=PERIOD)
    found = diagnose(model, coarse[bits], holdout=laboratory.record(sensors=steps_of(bits)))
    assert found.verdict is Verdict.NONE
    assert found.missing == ()
    assert bool(searches) == looked_for
    told = [text for text in found.warnings if "encoder steps do not average out" in text]
    assert len(told) == 1
    assert "q_hip" in told[0]
    assert "smaller effects are not seen" in told[0]


@pytest.mark.scenario
@pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")
def test_what_is_larger_than_steps_keeps_its_name(laboratory):
    """A knee with 1.5 mrad of play, seen by encoders whose steps are 0.4 mrad."""
    planted = [("backlash", "knee", [190.0], {"half_width": 0.004, "softness": 0.01})]
    seen = [laboratory.record(planted, periods=12, motion=m, sensors=steps_of(14)) for m in (0, 1)]
    found = diagnose(identify(laboratory.leg, seen[0], period=PERIOD), seen[0], holdout=seen[1])
    assert found.verdict is Verdict.NAMED
    assert [(m.effect, m.joint) for m in found.missing] == [("backlash", "knee")]


def test_a_spring_that_hardly_moves_is_told(laboratory, nothing_missing):
    bench, start = nothing_missing
    data = bench.data
    assert hardly_deflected(data) == ()
    assert limits(bench, start, None, start) == ((), False)
    knee = bench.robot.index("knee")
    deflection = data.motion.deflection[:, knee] - data.motion.deflection[:, knee].mean()
    scatter = np.std([motion.deflection[:, knee] for motion in data.period_motions], axis=0, ddof=1)
    noise = np.sqrt(np.mean(scatter**2) / data.averaged)
    for times, told in ((0.9, True), (1.1, False)):
        share = times * HARDLY * noise / np.sqrt(np.mean(deflection**2))
        theta = data.motion.theta.copy()
        theta[:, knee] -= (1.0 - share) * deflection
        still = replace(data, motion=replace(data.motion, theta=theta))
        texts = hardly_deflected(still)
        assert len(texts) == told
        assert all("spring of knee" in text and f"{times * HARDLY:.2g} times the noise" in text for text in texts)
    assert limits(
        bench.__class__(replace(still, motion=replace(data.motion, theta=data.motion.q)), bench.effects),
        start,
        None,
        start,
    )[1]


def rounded(robot, recording, step):
    """A recording whose currents are read in steps of so much torque."""
    motors = {f"current_{joint.name}": joint.actuator for joint in robot.joints}
    steps = {name: step / (motor.gear_ratio * motor.torque_constant) for name, motor in motors.items()}
    columns = recording.columns
    return recording.replace_columns({name: own * np.round(columns[name] / own) for name, own in steps.items()})


@pytest.mark.scenario
@pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")
@pytest.mark.parametrize(("step", "repeats"), [(0.05, False), (0.5, True), (1.5, True)])
def test_steps_of_a_torque_that_repeat_are_told_and_are_no_effect(laboratory, step, repeats):
    """They were a clipped torque, or something that is not in the library."""
    quiet = SensorNoise(current=0.0, motor_torque=0.05)
    recording = rounded(laboratory.leg, laboratory.record(periods=10, sensors=quiet), step)
    found = diagnose(identify(laboratory.leg, recording, period=PERIOD), recording)
    said = [text for text in found.warnings if "is read in steps that do not average out" in text]
    assert len(said) == repeats
    # a gear that the motor drives takes its share
    told = [f"{joint.name} {step * joint.actuator.efficiency:.3g} N m (" for joint in laboratory.leg.joints]
    assert all(any(part in text for part in told) for text in said)
    assert not any("clipped" in text for text in found.warnings)
    assert found.missing == ()
    assert found.verdict in ((Verdict.NONE, Verdict.CANNOT_TELL) if repeats else (Verdict.NONE,))


@pytest.mark.scenario
@pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")
def test_an_effect_beyond_the_steps_of_a_torque_keeps_its_name(laboratory):
    planted, quiet = [("stribeck_friction", "knee", [2.0], {"speed": 0.1})], SensorNoise(current=0.0, motor_torque=0.05)
    seen = [
        rounded(laboratory.leg, laboratory.record(planted, periods=10, motion=m, sensors=quiet), 0.3) for m in (0, 1)
    ]
    found = diagnose(identify(laboratory.leg, seen[0], period=PERIOD), seen[0], holdout=seen[1])
    assert [(m.effect, m.joint) for m in found.missing] == [("stribeck_friction", "knee")]


def test_no_steps_are_told_of_a_torque_that_has_none(nothing_missing):
    bench, start = nothing_missing
    assert torque_steps(bench, start) == ((), False)
