"""A repaired model is a model like any other: saved, read, simulated, exported, diagnosed again; one of every kind."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

import sea_ident
from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.settle import settle
from sea_ident.discrepancy.measured.data import period_data, wide_processing
from sea_ident.discrepancy.result.repair import repaired_model, with_open_shapes
from sea_ident.discrepancy.result.untold import in_base
from sea_ident.effects import base_effects, make_effect, spring_effects
from sea_ident.effects.drift import warming
from sea_ident.estimation import identify, physical_parameters, read_model
from sea_ident.exceptions import SeaIdentWarning
from sea_ident.processing import process
from sea_ident.simulation import (
    FrictionJitter,
    PlantedEffect,
    SensorNoise,
    plant_from_identified,
    plant_from_robot,
    simulate,
)

PERIOD = 5.0


def planted(name, joint, values, **shape):
    return PlantedEffect(make_effect(name, joint, **shape), np.array(values, dtype=float))


KINDS = {
    "column": (planted("torque_ripple", "hip", [1.0, 0.5], order=4.0), 2e-4),
    "shape": (planted("stribeck_friction", "knee", [0.8], speed=0.15, exponent=1.5), 2e-4),
    "memory": (planted("spring_hysteresis", "knee", [0.8, 0.8], slip=0.005), 3e-4),
    "signal": (planted("encoder_offset", "knee", [], offset=0.02), 2e-4),
    "motor": (planted("motor_encoder_offset", "knee", [], offset=0.1), 2e-4),
    "joint": (planted("joint_offset", "knee", [], offset=0.1), 2e-4),
    "filter": (planted("position_delay", "knee", [], delay=0.01, lag=0.008), 2e-4),
    "spring": (planted("asymmetric_spring", "knee", [15.0], exponent=1.0), 3e-4),
    "link": (planted("link_friction", "knee", [0.1, 0.15]), 3e-4),
}
QUICK = ("signal",)


def recorded(laboratory, kind):
    """Below ten periods a diagnosis does not look beside reversals, where the friction of "shape" is."""
    effect, _ = KINDS[kind]
    return laboratory.record([(effect.effect, effect.values)], periods=12 if kind == "shape" else 8, seed=70)


def diagnosed(model, recording, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        return sea_ident.diagnose(model, recording, **options)


def identified(leg, recording, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        return identify(leg, recording, period=PERIOD, **options)


@pytest.mark.scenario
@pytest.mark.parametrize("kind", [k if k in QUICK else pytest.param(k, marks=pytest.mark.slow) for k in KINDS])
def test_a_repaired_model_is_a_model_like_any_other(laboratory, leg, series, tmp_path, kind):
    effect, close = KINDS[kind]
    recording = recorded(laboratory, kind)
    found = diagnosed(identified(leg, recording), recording)
    assert (effect.effect.name, "knee" if kind != "column" else "hip") in [(m.effect, m.joint) for m in found.missing]
    found.model.save(tmp_path / "repaired.json")
    again = read_model(tmp_path / "repaired.json")
    assert diagnosed(again, recording).verdict == "none"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        sea_ident.export_urdf(again, tmp_path / "repaired.urdf")
    annotated = sea_ident.load_robot(tmp_path / "repaired.urdf")
    assert annotated.joint_names == leg.joint_names
    built = plant_from_identified(again)
    quiet = {"sensors": SensorNoise.none(), "jitter": FrictionJitter.none(), "periods": 1}
    truth = simulate(leg, series[1], effects=[effect], **quiet)
    run = simulate(leg, series[1], plant=built.plant, friction=built.friction, effects=built.effects, **quiet)
    assert np.sqrt(np.mean((run.motion.q - truth.motion.q) ** 2, axis=0)).max() < close


@pytest.mark.slow
def test_a_repaired_model_is_as_unsure_as_the_fit_that_it_comes_from(nothing_missing, laboratory, leg):
    """Both know the torques of the motors: put together as if they were strangers, those would count twice."""
    _, now = nothing_missing
    recording = laboratory.record()
    processed = process(recording, leg, period=PERIOD)
    model = repaired_model(identified(leg, recording), processed, now.fit)
    _, factor = in_base(now.fit, model.base)
    assert np.all(model.uncertainty.std > 0.99 * np.linalg.norm(factor, axis=1))
    names = [column.name for column in now.fit.columns]
    for spring in model.springs:
        for told, name in (
            (spring.stiffness_std, "spring_stiffness"),
            (spring.cubic_stiffness_std, "spring_stiffening"),
            (spring.damping_std, "spring_damping"),
        ):
            assert told > 0.6 * now.fit.std(names.index(f"{spring.joint}.{name}")), (spring.joint, name)


DRIFTS = {
    "friction_drift": planted("friction_drift", "knee", [0.3, 3.0], time_constant=60.0),
    "torque_constant_drift": planted("torque_constant_drift", "knee", [-0.3]),
}


@pytest.fixture(
    scope="module", params=["friction_drift", pytest.param("torque_constant_drift", marks=pytest.mark.scenario)]
)
def drifted(request, leg, series):
    """A drift, two motions with it, and the diagnosis of one by way of the other."""
    recording, other = (
        simulate(leg, series[k], periods=periods, seed=80 + k, effects=[DRIFTS[request.param]]).recording
        for k, periods in ((0, 12), (1, 8))
    )
    return request.param, recording, diagnosed(identified(leg, recording), recording, holdout=other)


@pytest.mark.scenario
def test_what_drifts_is_beside_the_mean_in_the_repaired_model(leg, drifted):
    """Named, added, its gap gone here and on another motion; and true at the begin and at the end."""
    kind, _, found = drifted
    assert [(m.effect, m.joint) for m in found.missing] == [(kind, "knee")]
    assert found.trend_gap["training"].shrink > 0.9
    assert found.trend_gap["holdout"].shrink > 0.8
    assert kind not in [effect.name for effect in found.model.effects]
    (term,) = found.model.trends
    assert (term.effect.name, term.effect.joint) == (kind, "knee")
    if kind == "friction_drift":
        (mean,) = (p for p in found.model.parameters if p.name == "knee.coulomb_friction")
        true = leg.joints[leg.index("knee")].actuator.coulomb_friction
        for time in (0.0, 60.0):
            change = term.effect.change(np.array(time), None)
            std = np.hypot(mean.std, change * term.stds[1])
            assert abs(mean.value + change * term.values[1] - true - 3.0 * warming(time, 60.0)) < 3.0 * std


@pytest.mark.scenario
def test_another_motion_that_began_as_this_one_is_predicted_and_simulated_in_its_own_mean(drifted):
    """It is shorter: not all that the mean of the recording has of what drifts is there."""
    _, _, found = drifted
    assert found.holdout.shrink > 0.8
    there = found.simulation_gap["q"]
    assert there.before["knee"] > 3e-4
    assert there.after["knee"] < 0.3 * there.before["knee"]
    assert not any("did not begin" in text for text in found.warnings)


@pytest.mark.scenario
def test_a_small_drift_is_named_and_is_no_part_of_the_mean(leg, series):
    drift = planted("friction_drift", "knee", [0.3, 0.5], time_constant=60.0)
    recording = simulate(leg, series[0], periods=12, seed=70, effects=[drift]).recording
    found = diagnosed(identified(leg, recording), recording)
    assert ("friction_drift", "knee") in [(m.effect, m.joint) for m in found.missing]
    assert "friction_drift" not in [effect.name for effect in found.model.effects]
    assert "friction_drift" in [trend.effect.name for trend in found.model.trends]


@pytest.mark.scenario
def test_nothing_is_left_to_name_beside_what_drifts_in_the_model(leg, series, drifted, tmp_path):
    kind, recording, found = drifted
    found.model.save(tmp_path / "repaired.json")
    again = diagnosed(read_model(tmp_path / "repaired.json"), recording)
    assert (again.verdict, again.missing) == ("none", ())
    np.testing.assert_allclose(again.model.trends[0].values, found.model.trends[0].values, rtol=1e-3)
    cold = simulate(leg, series[0], periods=6, seed=90).recording
    steady = diagnosed(again.model, cold)
    assert steady.model.trends == ()
    assert f"{kind} at knee of the model does not show in this recording" in "; ".join(steady.warnings)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        closed = sea_ident.close_gap(identified(leg, recording), recording)
    assert (closed.verdict, closed.added) == ("none", ((kind, "knee"),))
    before, after = closed.history[0].course
    assert after < 0.1 * before
    assert "from period to period" in closed.history[0].summary()


@pytest.mark.scenario
def test_what_the_sum_of_both_equations_hides_comes_from_the_link_equations(laboratory, leg):
    effect, _ = KINDS["link"]
    recording = recorded(laboratory, "link")
    effects = (*base_effects(leg), effect.effect)
    from_sum = identified(leg, recording, effects=effects)
    bench = Bench(period_data(wide_processing(recording, leg, PERIOD), leg), (*effects, *spring_effects(leg)))
    repaired = repaired_model(from_sum, process(recording, leg, period=PERIOD), settle(bench, bench.effects).fit)
    both = {p.name: p for p in repaired.parameters}
    alone = {p.name: p for p in from_sum.parameters}
    for name, value in zip(("knee.link_friction_viscous", "knee.link_friction_coulomb"), effect.values, strict=True):
        assert abs(both[name].value - value) < 5.0 * both[name].std
        assert both[name].std < 0.05 * alone[name].std
    # what the sum alone is doubted for is told by both
    assert any("friction of motor and of link cannot be told apart" in text for text in from_sum.warnings)
    assert not any("cannot be told apart" in text for text in repaired.warnings)
    coulomb = both["knee.coulomb_friction"]
    assert coulomb.value == pytest.approx(plant_from_robot(leg).coulomb_friction[1], rel=0.05)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        physical = physical_parameters(repaired)
    assert np.abs(physical.shift_in_std).max() < 1.0
    springs = {spring.joint: spring for spring in repaired.springs}
    truth = plant_from_robot(leg)
    for i, name in enumerate(leg.joint_names):
        assert springs[name].stiffness == pytest.approx(truth.stiffness[i], rel=0.01)


@pytest.mark.slow
def test_friction_that_acts_only_beside_reversals_comes_from_the_diagnosis(leg, series):
    """`identify` leaves out what is slower than twice the smoothing of the sign, and sees only its tail beyond."""
    effect = planted("stribeck_friction", "knee", [0.8], speed=0.05, exponent=2.0)
    recording = simulate(leg, series[0], periods=12, seed=70, effects=[effect]).recording
    effects = (*base_effects(leg), effect.effect)
    from_sum = identified(leg, recording, effects=effects)
    bench = Bench(period_data(wide_processing(recording, leg, PERIOD), leg), (*effects, *spring_effects(leg)))
    fit = settle(bench, bench.effects).fit
    repaired = repaired_model(from_sum, process(recording, leg, period=PERIOD), fit)
    alone, both = ({p.name: p for p in model.parameters} for model in (from_sum, repaired))
    name = "knee.stribeck_friction"
    assert abs(alone[name].value - 0.8) > 8.0
    assert abs(both[name].value - 0.8) < min(0.4, both[name].std)
    assert both[name].std < 0.05 * alone[name].std
    # what both see of a motor counts once
    assert both["hip.coulomb_friction"].std > 0.9 * alone["hip.coulomb_friction"].std


@pytest.mark.scenario
def test_presliding_takes_away_the_sign_that_the_model_has(laboratory):
    """It says nothing of the speed at which that turns over: where this stays as it was, both stay."""
    leg = laboratory.leg
    bench = laboratory.bench(laboratory.record([("presliding_friction", "knee", [1.2], {"displacement": 0.003})]))
    start = settle(bench, bench.effects)
    fit = bench.fit((*start.fit.effects, make_effect("presliding_friction", "knee", displacement=0.003)), start.noise)
    other = tuple(
        replace(effect, smoothing=0.03) if effect.joint == "knee" and "smoothing" in effect.shape_values else effect
        for effect in fit.effects
    )
    moved = bench.fit(bench.anchored(other, fit.parameters), start.noise, start=fit.parameters)
    smoothing = [
        {
            e.name: e.smoothing
            for e in effects
            if e.joint == "knee" and e.name in ("coulomb_friction", "presliding_friction")
        }
        for effects in (moved.effects, with_open_shapes(leg, moved, bench.effects))
    ]
    assert smoothing == [
        {"coulomb_friction": 0.03, "presliding_friction": 0.03},
        {"coulomb_friction": 0.01, "presliding_friction": 0.01},
    ]
