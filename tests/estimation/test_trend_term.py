"""What changes in the course of a recording, beside the model of its mean."""

import json
import warnings
from dataclasses import replace

import numpy as np
import pytest

from estimation.synthetic import leg_series
from sea_ident import export_urdf, identify, read_model, validate
from sea_ident.effects import make_effect
from sea_ident.effects.drift import warming
from sea_ident.estimation import TrendTerm
from sea_ident.estimation.trend_term import trend_torque, trend_torques
from sea_ident.exceptions import EffectError, ModelFileError, SeaIdentWarning
from sea_ident.processing import process
from sea_ident.simulation import FrictionJitter, PlantedEffect, SensorNoise, plant_from_identified, simulate

KNEE = 1
RATE, CONSTANT = -0.9, 30.0
DRIFT = make_effect("friction_drift", "knee", time_constant=CONSTANT)


@pytest.fixture(scope="module")
def recorded(leg):
    """Ten periods of a leg whose Coulomb friction falls by up to 0.45 N m at the knee, and nothing else."""
    planted = PlantedEffect(DRIFT, np.array([0.0, RATE]))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        return simulate(
            leg, leg_series(), periods=10, seed=4, effects=[planted], sensors=SensorNoise.none(),
            jitter=FrictionJitter.none(),
        ).recording  # fmt: skip


@pytest.fixture(scope="module")
def models(leg, recorded):
    """The model of its mean, and with what drifts beside it."""
    processed = process(recorded, leg)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        mean = identify(leg, processed)
    time = np.arange(processed.samples * processed.periods) * processed.interval
    level = float(np.mean(warming(time, CONSTANT)))
    term = TrendTerm(DRIFT.about(level), (0.0, RATE), (0.01, 0.02))
    return mean, replace(mean, trends=(term,)), processed, level


@pytest.mark.scenario
def test_a_model_predicts_what_drifts_beside_its_mean(models):
    mean, whole, processed, level = models
    motion = replace(processed.motion, time=processed.motion.time + 40.0)
    change = warming(motion.time, CONSTANT) - level
    sign = np.tanh(motion.dtheta[:, KNEE] / DRIFT.smoothing)
    expected = mean.predict(motion)
    expected[:, KNEE] += RATE * change * sign
    np.testing.assert_allclose(whole.predict(motion), expected, atol=1e-12)
    variance = mean.predict_std(motion) ** 2
    variance[:, KNEE] += change**2 * ((0.01 * motion.dtheta[:, KNEE]) ** 2 + (0.02 * sign) ** 2)
    np.testing.assert_allclose(whole.predict_std(motion), np.sqrt(variance), rtol=1e-9)


@pytest.mark.scenario
def test_the_friction_of_the_mean_and_what_drifts_are_that_of_the_beginning(leg, models):
    """None was known of the other: the mean from `identify`, the drift from what was planted."""
    mean, whole, _, level = models
    (coulomb,) = (p for p in mean.parameters if p.name == "knee.coulomb_friction")
    begun = leg.joints[leg.index("knee")].actuator.coulomb_friction
    assert coulomb.value - RATE * level == pytest.approx(begun, rel=0.02)
    assert abs(coulomb.value - begun) > 0.1 * begun
    told = [p for p in whole.parameters if p.effect == "friction_drift"]
    assert [(p.name, p.value, p.std, p.unit) for p in told] == [
        ("knee.friction_drift_viscous", 0.0, 0.01, "N m s/rad/min"),
        ("knee.friction_drift_coulomb", RATE, 0.02, "N m/min"),
    ]
    assert "trend friction_drift at knee: knee.friction_drift_viscous 0 +- 0.01 N m s/rad/min" in whole.summary()


@pytest.mark.scenario
def test_validation_follows_what_drifts_from_period_to_period(models):
    mean, whole, processed, _ = models
    torque, each = trend_torques(whole.robot, whole.effects, whole.trends, processed)
    alone, followed = (validate(model, processed) for model in (mean, whole))
    np.testing.assert_allclose(followed.predicted - alone.predicted, torque, atol=1e-12)
    # what differs from period to period is noise to the model of the mean
    assert followed.agreement.noise[KNEE] < 0.1 * alone.agreement.noise[KNEE]
    last = replace(processed.period_motions[-1], time=processed.period_motions[-1].time + 9.0 * processed.period)
    np.testing.assert_allclose(each[-1], trend_torque(whole.robot, whole.effects, whole.trends, last)[0], atol=1e-12)
    np.testing.assert_allclose(each.mean(axis=0), torque, atol=1e-12)


@pytest.mark.scenario
def test_one_stretch_is_followed_sample_by_sample(models):
    _, whole, processed, _ = models
    later = replace(processed.motion, time=processed.motion.time + 100.0)
    stretch = replace(processed, motion=later, period=None, periods=1, period_motions=(), places=())
    torque, each = trend_torques(whole.robot, whole.effects, whole.trends, stretch)
    assert each.shape == (0, *torque.shape)
    np.testing.assert_allclose(
        torque, trend_torque(whole.robot, whole.effects, whole.trends, processed.motion)[0], atol=1e-12
    )


@pytest.mark.scenario
def test_a_simulated_model_drifts_as_the_robot_did(leg, models):
    _, whole, processed, level = models
    built = plant_from_identified(whole)
    assert [planted.effect for planted in built.effects] == [whole.trends[0].effect]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        run = simulate(
            leg, leg_series(), periods=10, seed=4, plant=built.plant, friction=built.friction, effects=built.effects,
            sensors=SensorNoise.none(), jitter=FrictionJitter.none(),
        ).recording  # fmt: skip
    again = process(run, leg)
    speed = processed.motion.dtheta[:, KNEE]
    fast = np.abs(speed) > 0.1
    for period in (0, -1):
        gone = RATE * (warming(np.array(processed.period * (0.5 if period == 0 else 9.5)), CONSTANT) - level)
        beyond = [
            np.median((part.period_tau_motor[period] - processed.tau_motor)[fast, KNEE] * np.sign(speed[fast]))
            for part in (processed, again)
        ]
        np.testing.assert_allclose(beyond, gone, rtol=0.05)


@pytest.mark.scenario
def test_it_is_in_the_file_of_a_model_and_named_where_another_file_has_no_place_for_it(models, tmp_path):
    mean, whole, _, _ = models
    whole.save(tmp_path / "model.json")
    assert read_model(tmp_path / "model.json").trends == whole.trends
    assert (whole.to_dict()["version"], mean.to_dict()["version"]) == (3, 1)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        told = export_urdf(whole, tmp_path / "model.urdf").warnings
    assert any("knee.friction_drift_coulomb" in text for text in told)
    record = json.loads((tmp_path / "model.json").read_text())
    for key, value, about in (
        ("values", [1.0], "needs 2 finite values"),
        ("stds", [1.0, float("inf")], "needs 2 finite values"),
        ("effect", make_effect("torque_offset", "knee").to_dict(), "does not change in a recording"),
    ):
        entry = {**record["trends"][0], key: value}
        (tmp_path / "other.json").write_text(json.dumps({**record, "trends": [entry]}))
        with pytest.raises(ModelFileError, match=about):
            read_model(tmp_path / "other.json")


@pytest.mark.scenario
def test_without_a_temperature_friction_is_that_of_its_reference(models):
    mean, _, processed, _ = models
    warm = TrendTerm(make_effect("temperature_friction", "knee", reference=31.0, rise=0.0), (0.0, 0.1), (0.0, 0.0))
    whole = replace(mean, trends=(warm,))
    with pytest.raises(EffectError, match="temperature_knee"):
        whole.predict(processed.motion)
    alone, found = validate(mean, processed), validate(whole, processed)
    np.testing.assert_array_equal(found.predicted, alone.predicted)
    assert any("temperature_knee" in text and "at 31 degC" in text for text in found.warnings)
    measured = replace(processed, channels={**processed.channels, "temperature": np.full_like(processed.tau_motor, 33)})
    beyond = validate(whole, measured).predicted - alone.predicted
    each = [np.tanh(motion.dtheta[:, KNEE] / warm.effect.smoothing) for motion in processed.period_motions]
    np.testing.assert_allclose(beyond[:, KNEE], 0.2 * np.mean(each, axis=0), atol=1e-12)


@pytest.mark.scenario
def test_a_spring_that_softens_is_no_torque_of_the_motor(models):
    """It cancels in the sum of link and motor, and so it does in every prediction."""
    mean, _, processed, _ = models
    softer = TrendTerm(make_effect("stiffness_drift", "knee", reference=10.0), (-20.0,), (1.0,))
    torque, variance = trend_torque(mean.robot, mean.effects, [softer], processed.motion)
    assert not np.any(torque)
    assert not np.any(variance)
    np.testing.assert_array_equal(
        replace(mean, trends=(softer,)).predict(processed.motion), mean.predict(processed.motion)
    )
