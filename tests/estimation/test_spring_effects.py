"""What is in a spring beyond stiffness and damping is part of the model: fitted, saved, simulated, exported."""

import json
from dataclasses import replace

import numpy as np
import pytest

from estimation.synthetic import leg_series
from sea_ident.effects import base_effects, make_effect
from sea_ident.estimation import identify, identify_springs, read_model
from sea_ident.exceptions import IdentificationError, ModelFileError, SeaIdentWarning
from sea_ident.export import export_mjcf, export_urdf
from sea_ident.processing import process
from sea_ident.simulation import FrictionJitter, PlantedEffect, SensorNoise, plant_from_identified, simulate

SLIP, TORQUES, OFFSET = 0.004, (2.0, 1.0), -0.7


def planted():
    return (
        PlantedEffect(make_effect("spring_hysteresis", "knee", slip=SLIP), np.array(TORQUES)),
        PlantedEffect(make_effect("spring_offset", "ankle"), np.array([OFFSET])),
    )


@pytest.fixture(scope="module")
def recording(leg):
    return simulate(leg, leg_series(), periods=8, seed=3, effects=planted()).recording


@pytest.fixture(scope="module")
def model(leg, recording):
    effects = (*base_effects(leg), *(p.effect for p in planted()))
    return identify(leg, recording, effects=effects, period=leg_series().period)


def term(model, joint):
    return next(spring.terms[0] for spring in model.springs if spring.joint == joint)


@pytest.mark.scenario
def test_the_planted_values_are_found_within_their_uncertainty(model):
    found = term(model, "knee")
    assert found.effect.name == "spring_hysteresis"
    for value, std, truth in zip(found.values, found.stds, TORQUES, strict=True):
        assert abs(value - truth) < 5.0 * std
        assert 0.0 < std < 0.2 * truth
    offset = term(model, "ankle")
    assert abs(offset.values[0] - OFFSET) < 5.0 * offset.stds[0]


@pytest.mark.scenario
def test_the_law_beside_them_is_that_of_the_spring(leg, model, recording):
    with (
        pytest.warns(SeaIdentWarning, match="spring of ankle: its stiffness comes out negative"),
        pytest.warns(SeaIdentWarning, match="spring of ankle: its law leaves"),
        pytest.warns(SeaIdentWarning, match="spring of knee: its law leaves"),
        # an offset of the spring and a zero of its encoders are the same in one recording
        pytest.warns(SeaIdentWarning, match="spring of ankle: zeros of theta_ankle and q_ankle that differ by"),
    ):
        plain = identify(leg, recording, period=leg_series().period)  # without the offset of that spring
    with_term, without = (next(s for s in m.springs if s.joint == "knee") for m in (model, plain))
    truth = leg.spring("knee").stiffness
    assert abs(with_term.stiffness - truth) < 5.0 * with_term.stiffness_std
    assert abs(without.stiffness - truth) > 3.0 * abs(with_term.stiffness - truth)
    assert with_term.rms_residual < 0.3 * without.rms_residual


@pytest.mark.scenario
def test_covariance_is_that_of_law_and_terms_together(model):
    spring = next(s for s in model.springs if s.joint == "knee")
    full = np.array(spring.full_covariance)
    assert full.shape == (5, 5)
    np.testing.assert_allclose(full[:3, :3], spring.covariance)
    np.testing.assert_allclose(np.sqrt(np.diag(full))[3:], spring.terms[0].stds)
    assert np.linalg.eigvalsh(full)[0] > -1e-9 * np.linalg.eigvalsh(full)[-1]


@pytest.mark.scenario
def test_they_stand_among_the_parameters(model):
    found = {p.name: p for p in model.parameters}
    assert found["knee.spring_hysteresis_narrow"].value == term(model, "knee").values[0]
    assert found["ankle.spring_offset"].unit == "N m"
    assert [e.name for e in model.spring_effects] == ["spring_hysteresis", "spring_offset"]


@pytest.mark.scenario
def test_saved_and_read_back(model, tmp_path):
    model.save(tmp_path / "m.json")
    record = json.loads((tmp_path / "m.json").read_text())
    assert record["version"] == 2
    assert {"spring_hysteresis", "spring_offset"} <= {entry["effect"] for entry in record["effects"]}
    again = read_model(tmp_path / "m.json")
    assert again.springs == model.springs
    assert again.effects == model.effects
    assert again.spring_effects == model.spring_effects


@pytest.mark.scenario
def test_a_model_without_them_is_written_as_before(model, tmp_path):
    plain = replace(model, springs=tuple(replace(s, terms=(), full_covariance=()) for s in model.springs))
    plain.save(tmp_path / "m.json")
    record = json.loads((tmp_path / "m.json").read_text())
    assert record["version"] == 1
    assert not any("terms" in spring for spring in record["springs"])


def at_other_joint(record):
    record["springs"][1]["terms"][0]["effect"]["joint"] = "hip"


def without_value(record):
    record["springs"][1]["terms"][0]["values"].pop()


def without_covariance(record):
    del record["springs"][1]["full_covariance"]


def friction_in_a_spring(record):
    record["springs"][1]["terms"][0]["effect"] = {"effect": "torque_offset", "joint": "knee", "shape": {}}


def not_listed(record):
    record["effects"] = [e for e in record["effects"] if e["effect"] != "spring_offset"]


@pytest.mark.scenario
@pytest.mark.parametrize(
    "damage", [at_other_joint, without_value, without_covariance, friction_in_a_spring, not_listed]
)
def test_contradictions_in_the_file_are_refused(model, tmp_path, damage):
    record = model.to_dict()
    damage(record)
    (tmp_path / "m.json").write_text(json.dumps(record))
    with pytest.raises(ModelFileError):
        read_model(tmp_path / "m.json")


@pytest.mark.scenario
def test_the_model_simulated_moves_like_the_truth(leg, model):
    quiet = {"sensors": SensorNoise.none(), "jitter": FrictionJitter.none(), "periods": 1}
    truth = simulate(leg, leg_series(), effects=planted(), **quiet)
    built = plant_from_identified(model)
    assert {p.effect.name for p in built.effects} == {"spring_hysteresis", "spring_offset"}
    own = simulate(leg, leg_series(), plant=built.plant, friction=built.friction, effects=built.effects, **quiet)
    bare = simulate(leg, leg_series(), plant=built.plant, friction=built.friction, **quiet)
    k = leg.joint_names.index("knee")
    away, without = (float(np.std(run.motion.q[:, k] - truth.motion.q[:, k])) for run in (own, bare))
    assert away < 0.1 * without


@pytest.mark.scenario
def test_export_says_what_it_leaves_out(model, tmp_path):
    with pytest.warns(SeaIdentWarning, match=r"knee\.spring_hysteresis_narrow.*ankle\.spring_offset: left out"):
        export_urdf(model, tmp_path / "leg.urdf")
    with pytest.warns(SeaIdentWarning, match=r"knee\.spring_hysteresis_narrow"):
        export_mjcf(model, tmp_path / "leg.xml")


@pytest.mark.scenario
def test_springs_identified_again_keep_them(leg, model, recording):
    processed = process(recording, leg, period=leg_series().period)
    again = identify_springs(model, processed)
    assert [t.effect for s in again for t in s.terms] == list(model.spring_effects)
    np.testing.assert_allclose(again[1].terms[0].values, term(model, "knee").values, rtol=1e-6)


@pytest.mark.scenario
@pytest.mark.parametrize("name", ["spring_stiffness", "spring_damping", "spring_stiffening", "stiffness_drift"])
def test_the_law_of_the_spring_and_its_drift_are_not_to_be_given(leg, recording, name):
    with pytest.raises(IdentificationError, match="leave it out"):
        identify(leg, recording, effects=(*base_effects(leg), make_effect(name, "knee")), period=leg_series().period)


@pytest.mark.scenario
@pytest.mark.parametrize("slip", [0.03, 0.5])
def test_dry_friction_that_never_slips_is_told_by_its_rest_alone(leg, tmp_path, slip):
    """Where it rests is from before the recording: all that the model takes it for may be stiffness."""
    element = make_effect("spring_hysteresis", "knee", slip=slip)
    truth = PlantedEffect(element, np.array([3.0, 9.0]))
    period = leg_series().period
    recording = simulate(leg, leg_series(), periods=8, seed=3, effects=(truth,)).recording
    with pytest.warns(SeaIdentWarning, match="spring of knee: spring_hysteresis never slips in this motion"):
        found = identify(leg, recording, effects=(*base_effects(leg), element), period=period)
    knee = found.springs[1]
    stiffness = leg.spring("knee").stiffness
    assert abs(knee.stiffness - stiffness) < 2.0 * knee.stiffness_std
    values, stds = knee.terms[0].values, knee.terms[0].stds
    assert all(abs(value - true) < 2.0 * std for value, true, std in zip(values, (3.0, 9.0), stds, strict=True))
    # together they are as stiff as the truth, and that is known well
    slope = np.array([1.0, 0.0, 0.0, 1.0 / slip, 1.0 / (3.0 * slip)])
    whole, std = slope @ [*knee.law, *values], float(np.sqrt(slope @ np.array(knee.full_covariance) @ slope))
    assert abs(whole - (stiffness + 3.0 / slip + 3.0 / slip)) < 4.0 * std < 0.02 * whole
    found.save(tmp_path / "m.json")
    assert read_model(tmp_path / "m.json").springs[1].terms[0].by_rest


@pytest.mark.scenario
def test_what_slips_is_not_told_by_its_rest(model):
    assert not any(t.by_rest for spring in model.springs for t in spring.terms)
