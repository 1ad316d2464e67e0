"""What a recording is compared by: how far the regressor reaches, and that a spring is not lost on the way."""

from dataclasses import replace

import numpy as np
import pytest

from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.judge import too_short
from sea_ident.discrepancy.bench.settle import settle, settle_again
from sea_ident.discrepancy.measured.data import REGRESSOR_MARGIN, WIDEST_MARGIN
from sea_ident.discrepancy.search.candidates import scan
from sea_ident.discrepancy.search.refit import refitted
from sea_ident.effects import make_effect
from sea_ident.simulation import FrictionJitter, SensorNoise


def sensors(factor):
    """The usual encoders, so many times as noisy, without steps; the torque too where they are better."""
    usual = SensorNoise()
    return SensorNoise(
        link_position=factor * usual.link_position,
        motor_position=factor * usual.motor_position,
        link_resolution=0.0,
        motor_resolution=0.0,
        current=min(factor, 1.0) * usual.current,
        motor_torque=min(factor, 1.0) * usual.motor_torque,
    )


@pytest.mark.scenario
def test_good_encoders_show_the_corner_of_friction(laboratory):
    """With a tenth of the noise the model is still right: what the regressor cannot follow would stand out by then."""
    recording = laboratory.record(periods=10, sensors=sensors(0.1), jitter=FrictionJitter(0.0, 0.05))
    bench = laboratory.bench(recording)
    assert bench.data.reach == int(WIDEST_MARGIN * bench.data.harmonics)
    now = settle(bench, bench.effects)
    assert now.fit.statistic / now.fit.dof == pytest.approx(1.0, abs=0.08)


@pytest.mark.scenario
def test_bad_encoders_do_not_blur_the_sign_of_a_velocity(laboratory):
    """The regressor reaches no further than it must; no more samples are left out than for good encoders."""
    good, bad = (
        laboratory.data(laboratory.record(periods=10, sensors=sensors(factor), jitter=FrictionJitter(0.0, 0.05)))
        for factor in (0.1, 10.0)
    )
    assert bad.reach == int(REGRESSOR_MARGIN * bad.harmonics)
    assert np.mean(bad.left_out) < np.mean(good.left_out) + 0.005


@pytest.mark.scenario
@pytest.mark.parametrize(("joint", "sine", "cosine"), [("ankle", -0.0354, -0.0294), ("knee", 0.05, 0.05)])
def test_a_large_error_of_an_encoder_does_not_cost_the_spring(laboratory, joint, sine, cosine):
    """Its tangent is wrong by a factor of two to four, and a spring without stiffness would explain as much."""
    shape = {"sine": sine, "cosine": cosine}
    bench = laboratory.bench(laboratory.record([("encoder_eccentricity", joint, [], shape)], periods=10))
    now = settle(bench, bench.effects)
    assert bench.slack_links(now.fit) == []
    tried = next(
        c.effect
        for c in scan(bench, now.fit, now.noise)
        if (c.effect.name, c.effect.joint) == ("encoder_eccentricity", joint)
    )
    found = refitted(bench, now.fit.effects, tried, (), now.noise, now.fit.parameters)
    assert bench.slack_links(found) == []
    assert (found.effects[-1].sine, found.effects[-1].cosine) == pytest.approx((sine, cosine), abs=2e-4)
    assert found.statistic < 1e-3 * now.fit.statistic


def test_a_spring_without_stiffness_is_seen(nothing_missing):
    bench, now = nothing_missing
    assert bench.slack_links(now.fit) == []
    gone = {**now.fit.parameters, "knee.spring_stiffness": 0.0, "knee.spring_stiffening": 0.0}
    slack = bench.slack_links(bench.predicted(now.fit.effects, gone))
    assert [(bench.data.equations[e].joint, str(bench.data.equations[e].kind)) for e in slack] == [("knee", "link")]
    softer = {name: 0.1 * value for name, value in now.fit.parameters.items() if name.startswith("knee.spring_")}
    fit = bench.predicted(now.fit.effects, {**now.fit.parameters, **softer})
    assert (len(bench.slack_links(fit)), len(bench.slack_links(fit, 0.15))) == (0, 1)


@pytest.mark.parametrize(
    ("stop", "expected"), [(1.005, True), (1.015, True), (1.03, False), (4.7, False), (4.8, True), (0.985, True)]
)
def test_a_push_of_a_few_samples_or_nearly_all_the_time_is_none(nothing_missing, stop, expected):
    """Compared are 20 Hz: half of a period of them is 25 ms. The motion has a period of 5 s."""
    bench: Bench = nothing_missing[0]
    push = make_effect("external_force", "knee", start=1.0, stop=stop, period=bench.data.period)
    assert too_short(bench, push) is expected
    assert not too_short(bench, make_effect("torque_offset", "knee"))


@pytest.mark.parametrize(("displacement", "periods", "expected"), [(2e-5, 8, True), (5e-5, 8, False), (2e-5, 2, False)])
def test_friction_builds_up_over_more_than_a_part_of_what_passes_differ_by(
    nothing_missing, displacement, periods, expected
):
    """Passes that differ by a tenth of a milliradian at the knee, and by ten times as much at the hip."""
    bench: Bench = nothing_missing[0]
    rng, data = np.random.default_rng(0), bench.data
    by_joint = 1e-4 * np.array([10.0, 1.0, 0.1])
    passes = tuple(
        replace(data.motion, theta=data.motion.theta + by_joint * rng.standard_normal(data.motion.theta.shape))
        for _ in range(periods)
    )
    scattered = Bench(replace(data, period_motions=passes), bench.effects)
    assert too_short(scattered, make_effect("presliding_friction", "knee", displacement=displacement)) is expected


@pytest.mark.scenario
@pytest.mark.parametrize(
    ("joint", "compliance", "within"), [("knee", 0.0005, 0.015), ("knee", 0.0025, 0.05), ("hip", 0.0008, 0.01)]
)
def test_how_far_a_link_bends(laboratory, joint, compliance, within):
    """Half of the whole compliance behind the encoder, and the spring that is found without the effect is another."""
    shape = {"compliance": compliance}
    bench = laboratory.bench(laboratory.record([("link_flexibility", joint, [], shape)], periods=10))
    now = settle(bench, bench.effects)
    tried = next(
        c.effect
        for c in scan(bench, now.fit, now.noise)
        if (c.effect.name, c.effect.joint) == ("link_flexibility", joint)
    )
    found = refitted(bench, now.fit.effects, tried, (), now.noise, now.fit.parameters)
    again = settle_again(bench, found).fit
    assert again.effects[-1].compliance == pytest.approx(compliance, rel=within)
    # in the model, the spring is what lies between motor and bodies
    spring = laboratory.leg.spring(joint)
    assert again.parameters[f"{joint}.spring_stiffness"] == pytest.approx(spring.stiffness, rel=0.02)
    assert again.parameters[f"{joint}.spring_damping"] == pytest.approx(spring.damping, rel=0.12)
