"""The law of a spring holds on another motion, and what is wrong with it there is told."""

from dataclasses import replace

import numpy as np
import pytest

from estimation.synthetic import leg_series, record, truth_of
from sea_ident.effects import make_effect
from sea_ident.estimation import identify
from sea_ident.estimation.observations import Observations
from sea_ident.estimation.spring_agreement import SpringAgreement, _with_warning, spring_agreement
from sea_ident.estimation.spring_result import SpringTerm, Verdict
from sea_ident.processing import process
from sea_ident.robot import load_robot
from sea_ident.validation import validate

NOISE = {"torque_noise": 0.2, "encoder_noise": 1e-6}


@pytest.fixture(scope="module")
def leg():
    return load_robot("exo_leg")


@pytest.fixture(scope="module")
def model(leg):
    return identify(leg, record(leg, truth_of(leg, leg_series()), 8, **NOISE), period=10.0)


@pytest.fixture(scope="module")
def other(leg):
    return record(leg, truth_of(leg, leg_series(seed=11)), 8, seed=1, **NOISE)


def springs(model, recording, **options):
    return {s.joint: s for s in validate(model, recording, **options).springs}


def test_a_law_predicts_another_motion(leg, model, other):
    found = springs(model, other, period=10.0)
    assert list(found) == list(leg.joint_names)
    assert all(spring.nrms < 5e-3 and spring.warning == "" for spring in found.values())


def test_its_noise_is_that_of_the_encoders(leg):
    """Where they are noisy and the model is exact, the difference is all noise."""
    exact = record(leg, truth_of(leg, leg_series()), 8, torque_noise=1e-3, encoder_noise=1e-8)
    model = identify(leg, exact, period=10.0)
    noisy = record(leg, truth_of(leg, leg_series(seed=11)), 8, seed=1, torque_noise=0.2, encoder_noise=2e-4)
    for spring in springs(model, noisy, period=10.0).values():
        assert spring.rms == pytest.approx(spring.noise_std, rel=0.2)


def test_its_numbers_are_those_of_the_law_and_the_truth(leg, model, other):
    """A stiffness that is a fifth too high leaves a fifth of the torque of a linear spring, and that is told."""
    hip, *rest = model.springs
    stiffer = replace(hip, linear_stiffness=1.2 * hip.linear_stiffness, stiffness=1.2 * hip.stiffness)
    validation = validate(replace(model, springs=(stiffer, *rest)), other, period=10.0)
    found = validation.springs[0]
    assert found.nrms == pytest.approx(0.2, abs=0.01)
    truth = truth_of(leg, leg_series(seed=11))
    assert found.rms_torque == pytest.approx(np.sqrt(np.mean(truth.tau_spring[:, 0] ** 2)), rel=0.01)
    (warning,) = validation.warnings
    assert warning == found.warning
    assert f"the law of the spring of 'hip' leaves {100 * found.nrms:.3g} % of its torque" in warning
    written = validation.to_dict()["springs"]
    assert written["hip"] == {
        "rms": found.rms, "noise_std": found.noise_std, "rms_torque": found.rms_torque, "nrms": found.nrms
    }  # fmt: skip
    assert f"spring of hip [N m]: rms {found.rms:.4g} of" in validation.summary()


def test_an_encoder_with_another_zero_is_told_of_the_springs_though_the_motor_torque_does_not_show_it(model, other):
    moved = other.replace_columns({"theta_knee": other.columns["theta_knee"] + 0.02})
    before, after = (validate(model, recording, period=10.0) for recording in (other, moved))
    np.testing.assert_allclose(after.rms, before.rms, rtol=1e-6)
    assert [s.joint for s in after.springs if s.warning] == ["knee"]
    assert "another zero" in after.springs[1].warning
    weak = replace(model, springs=tuple(replace(s, verdict=Verdict.NOT_EXCITED) for s in model.springs))
    assert "load it more" in validate(weak, moved, period=10.0).springs[1].warning


@pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")
def test_a_spring_is_not_blamed_for_positions_in_another_unit(model, other):
    knee = {f"{kind}_knee": np.degrees(other.columns[f"{kind}_knee"]) for kind in ("q", "theta")}
    validation = validate(model, other.replace_columns(knee), period=10.0)
    assert any("is it in degrees?" in text for text in validation.warnings)
    assert all(spring.nrms > 0.1 and spring.warning == "" for spring in validation.springs)


def test_what_else_is_in_a_spring_is_in_its_law(model, other):
    """A constant of half a newton metre that is not there is what is left."""
    hip, *rest = model.springs
    more = replace(hip, terms=(SpringTerm(make_effect("spring_offset", "hip"), (0.5,), (0.01,)),))
    left = springs(replace(model, springs=(more, *rest)), other, period=10.0)["hip"]
    assert left.rms == pytest.approx(0.5, rel=0.01)


def test_a_zero_that_was_fitted_is_kept(leg, other):
    """What was found with an unknown zero is compared with that zero."""
    moved = other.replace_columns({"theta_knee": other.columns["theta_knee"] + 0.02})
    model = identify(leg, moved, period=10.0, unknown_zero=["knee"])
    assert model.springs[1].zero == pytest.approx(0.02, abs=1e-3)
    assert springs(model, moved, period=10.0)["knee"].nrms < 0.01
    assert springs(model, other, period=10.0)["knee"].warning


def test_an_error_of_an_encoder_that_the_model_knows_is_none_of_its_spring(model, other):
    moved = other.replace_columns({"q_knee": other.columns["q_knee"] + 0.02})
    knows = replace(model, effects=(*model.effects, make_effect("encoder_offset", "knee", offset=0.02)))
    assert springs(model, moved, period=10.0)["knee"].warning
    assert springs(knows, moved, period=10.0)["knee"].nrms < 5e-3


def test_samples_that_do_not_count_are_left_out(leg, model, other):
    processed = process(other, leg, period=10.0)
    observations = Observations(leg, model.effects, model.base, processed)
    half = np.arange(processed.samples) < processed.samples // 2
    parts = [spring_agreement(observations, model.values, model.springs, used) for used in (half, ~half, half | ~half)]
    torque = truth_of(leg, leg_series(seed=11)).tau_spring
    for k in range(leg.n):
        first, second, whole = (part[k] for part in parts)
        for found, used in ((first, half), (second, ~half)):
            assert found.rms_torque == pytest.approx(np.sqrt(np.mean(torque[used, k] ** 2)), rel=0.01)
        for name in ("rms", "noise_std"):
            powers = [getattr(found, name) ** 2 for found in (first, second)]
            assert getattr(whole, name) ** 2 == pytest.approx(np.mean(powers), rel=1e-9)
            assert powers[0] != powers[1]


@pytest.mark.parametrize(("noise", "warned"), [(0.1, False), (0.05, True), (None, True)])
def test_what_noise_explains_is_no_warning(noise, warned):
    found = _with_warning(SpringAgreement("hip", 0.2, noise, 1.0, "N m"), Verdict.LINEAR)
    assert bool(found.warning) == warned


@pytest.mark.parametrize(
    ("before", "verdict", "expected"),
    [
        (0.25, Verdict.LINEAR, "on the recording that it was found on it left 25 %"),
        (0.25, Verdict.NOT_EXCITED, "on the recording that it was found on it left 25 %"),
        (0.12, Verdict.LINEAR, "another zero than before"),
        (0.05, Verdict.LINEAR, "another zero than before"),
        (0.0, Verdict.NOT_EXCITED, "load it more"),
    ],
)
def test_a_law_that_never_held_is_not_blamed_on_the_new_recording(before, verdict, expected):
    found = _with_warning(SpringAgreement("hip", 0.27, 1e-3, 1.0, "N m"), verdict, before)
    assert expected in found.warning


@pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")
def test_no_encoder_is_suspected_of_another_zero_on_the_recording_that_the_law_is_from(leg):
    own = record(leg, truth_of(leg, leg_series()), 8, **NOISE)
    moved = own.replace_columns({"theta_knee": own.columns["theta_knee"] + 0.2})
    model = identify(leg, moved, period=10.0)
    knee = springs(model, moved, period=10.0)["knee"]
    assert "on the recording that it was found on it left" in knee.warning
    assert "another zero" not in knee.warning


def test_without_laws_there_is_nothing_to_compare(model, other):
    assert springs(replace(model, springs=()), other, period=10.0) == {}
