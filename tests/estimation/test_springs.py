import numpy as np
import pytest

from estimation.synthetic import leg_series, record, truth_of
from sea_ident.effects import base_effects, make_effect
from sea_ident.estimation import (
    CovarianceKind,
    identify,
    identify_measured_springs,
    identify_one_shot,
    identify_springs,
)
from sea_ident.estimation.spring_result import Verdict
from sea_ident.estimation.spring_verdict import hysteresis_column, verdict_of
from sea_ident.exceptions import IdentificationError, RecordingError, RobotError, SeaIdentWarning
from sea_ident.processing import process
from sea_ident.recordings import Recording
from sea_ident.robot import load_robot, robot_from_text

pytestmark = pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")
NOISE = {"torque_noise": 0.2, "encoder_noise": 1e-5}


def planted(leg):
    return np.array([[s.stiffness, s.cubic_stiffness, s.damping] for s in map(leg.spring, leg.joint_names)])


def found(model):
    values = np.array([[s.stiffness, s.cubic_stiffness, s.damping] for s in model.springs])
    std = np.array([[s.stiffness_std, s.cubic_stiffness_std, s.damping_std] for s in model.springs])
    return values, std


def test_verdicts_tell_stiffening_from_linear(leg, truth):
    model = identify(leg, record(leg, truth, 10, **NOISE), period=10.0)
    assert [s.verdict for s in model.springs][:2] == ["stiffening", "stiffening"]
    straight = robot_from_text(leg.urdf.replace('cubicStiffness="15000"', 'cubicStiffness="0"'), "straight hip")
    linear = identify(straight, record(straight, truth_of(straight, leg_series()), 10, **NOISE), period=10.0)
    hip = linear.springs[0]
    assert hip.verdict == "linear"
    assert hip.law[1] == 0.0
    assert abs(hip.cubic_stiffness) < 4.0 * hip.cubic_stiffness_std
    assert hip.law[0] == pytest.approx(600.0, rel=0.01)


def test_a_spring_that_is_hardly_loaded_is_not_excited(leg, truth):
    model = identify(leg, record(leg, truth, 10, torque_noise=20.0), period=10.0, link_harmonics=5, motor_harmonics=40)
    assert model.springs[2].verdict == "not_excited"


def test_standard_deviations_hold_the_uncertainty_of_the_dynamic_model(leg, coarse):
    errors, stated = [], []
    for seed in range(10):
        model = identify(leg, record(leg, coarse, 8, seed=seed, **NOISE), period=10.0)
        values, std = found(model)
        errors.append(values - planted(leg))
        stated.append(std)
    ratio = np.sqrt(np.mean(np.square(stated), axis=0)) / np.sqrt(np.mean(np.square(errors), axis=0))
    assert np.all(ratio > 0.5)
    assert np.all(ratio < 2.2)


def test_unknown_zero_between_the_encoders(leg, truth):
    recording = record(leg, truth, 8, **NOISE)
    moved = recording.replace_columns({"theta_hip": recording.columns["theta_hip"] + 0.05})
    processed = process(moved, leg, period=10.0)
    model = identify(leg, processed, unknown_zero=["hip"])
    assert model.springs[0].zero == pytest.approx(0.05, abs=1e-4)
    assert model.springs[0].stiffness == pytest.approx(600.0, rel=0.01)
    assert model.springs[1].zero == 0.0
    wrong = identify_springs(model, processed)
    assert abs(wrong[0].stiffness / 600.0 - 1.0) > 0.05
    with pytest.raises(RobotError, match="no joint 'elbow'"):
        identify_springs(model, processed, unknown_zero=["elbow"])


def test_one_shot_gives_the_same_from_exact_data(leg, truth):
    recording = record(leg, truth, 3, torque_noise=1e-9, encoder_noise=1e-12)
    model = identify_one_shot(leg, process(recording, leg, period=10.0, link_harmonics=60, motor_harmonics=60))
    np.testing.assert_allclose(model.values, model.base.project(truth.parameters), rtol=1e-5)
    np.testing.assert_allclose(found(model)[0], planted(leg), rtol=1e-4)


@pytest.mark.scenario
def test_one_shot_is_sharper_and_as_honest(leg, coarse):
    z, gain = [], []
    for seed in range(5):
        processed = process(record(leg, coarse, 10, seed=seed, **NOISE), leg, period=10.0)
        one, two = identify_one_shot(leg, processed), identify(leg, processed)
        exact = one.base.project(coarse.parameters)
        values, std = found(one)
        z.append(np.concatenate([(one.values - exact) / one.std, ((values - planted(leg)) / std).ravel()]))
        gain.append(np.concatenate([two.std / one.std, (found(two)[1] / std).ravel()]))
    assert np.sqrt(np.mean(np.square(z))) < 1.4  # 1.13 for Student's distribution with nine degrees of freedom
    assert np.median(np.mean(gain, axis=0)) > 1.5


def test_one_shot_counts_what_is_left_and_says_that_something_lacks_only_where_it_does(leg, coarse):
    recording = record(leg, coarse, 10, **NOISE)
    ripple = 0.5 * np.sin(7.0 * recording.columns["theta_hip"])
    bent = recording.replace_columns({"tau_motor_hip": recording.columns["tau_motor_hip"] + ripple})
    for each, kind in ((recording, CovarianceKind.PERIODS), (bent, CovarianceKind.REMAINDER)):
        told = identify_one_shot(leg, each, period=10.0).uncertainty
        assert told.kind is kind
        assert np.any(told.covariance != told.repeatability)


def test_one_shot_needs_springs_and_periods(leg, truth):
    with pytest.raises(IdentificationError, match="two periods or more"):
        identify_one_shot(leg, record(leg, truth, 1, torque_noise=0.1), period=10.0)
    rigid = load_robot("emps")
    time = np.arange(400) * 0.01
    wave = np.sin(2 * np.pi * time)
    recording = Recording(time, {"q_slider": wave, "tau_motor_slider": -wave}, "wave")
    with pytest.raises(IdentificationError, match="has no spring"):
        identify_one_shot(rigid, recording, period=1.0)


def measured(deflection, torque, name="output"):
    time = np.arange(len(deflection)) * 0.005
    q = 0.3 * np.sin(2 * np.pi * 0.2 * time)
    return Recording(time, {f"q_{name}": q, f"theta_{name}": q + deflection, f"tau_spring_{name}": torque}, "made")


@pytest.fixture(scope="module")
def wobble():
    time = np.arange(4000) * 0.005
    return 0.02 * np.sin(2 * np.pi * 0.3 * time) + 0.01 * np.sin(2 * np.pi * 0.71 * time)


def test_hysteresis_is_seen_in_a_measured_spring_torque(wobble):
    robot = load_robot("hebi_x5")
    rng = np.random.default_rng(0)
    noise = 0.005 * rng.standard_normal(len(wobble))
    slip = 0.15 * hysteresis_column(wobble, 0.005)
    (plain,) = identify_measured_springs(robot, measured(wobble, 40.0 * wobble + noise))
    assert plain.verdict == "linear"
    assert plain.stiffness == pytest.approx(40.0, rel=0.01)
    (slipping,) = identify_measured_springs(robot, measured(wobble, 40.0 * wobble + slip + noise))
    assert slipping.verdict == "hysteretic"


def test_a_torque_computed_from_the_deflection_proves_nothing(wobble):
    robot = load_robot("hebi_x5")
    with pytest.warns(SeaIdentWarning, match="-40 x the deflection"):
        (spring,) = identify_measured_springs(robot, measured(wobble, -40.0 * wobble))
    assert spring.verdict == "circular"


def test_circular_motor_torque(leg, truth):
    recording = record(leg, truth, 4, **NOISE)
    c = recording.columns
    fake = recording.replace_columns({"tau_motor_ankle": 120.0 * (c["theta_ankle"] - c["q_ankle"])})
    model = identify(leg, fake, period=10.0)
    assert model.springs[2].verdict == "circular"
    assert any("proves" in text or "whatever the spring is" in text for text in model.warnings)


def test_no_torque_channel(leg, truth):
    with pytest.raises(RecordingError, match="no column tau_spring"):
        identify_measured_springs(leg, record(leg, truth, 1))


def test_a_negative_stiffness_is_warned_of(leg, truth):
    recording = record(leg, truth, 8, **NOISE)
    moved = recording.replace_columns({"theta_hip": recording.columns["theta_hip"] + 0.5})
    model = identify(leg, moved, period=10.0)
    assert model.springs[0].stiffness < 0.0
    told = [text for text in model.warnings if "negative" in text]
    assert len(told) == 1
    assert "hip" in told[0]
    assert "--unknown-zero" in told[0]


def test_a_hysteresis_wider_than_every_deflection_takes_nothing_from_the_law_of_the_spring(leg, truth):
    """Before it slips it is stiffness over again but for where it rests; that there is none is within what is said."""
    effects = (*base_effects(leg), make_effect("spring_hysteresis", "hip", slip=1e3))
    with pytest.warns(SeaIdentWarning, match="spring of hip: spring_hysteresis never slips in this motion"):
        model = identify(leg, record(leg, truth, 4, **NOISE), effects=effects, period=10.0)
    hip, exact = model.springs[0], leg.spring("hip")
    for value, true, std in (
        (hip.stiffness, exact.stiffness, hip.stiffness_std),
        (hip.cubic_stiffness, exact.cubic_stiffness, hip.cubic_stiffness_std),
        *((value, 0.0, std) for value, std in zip(hip.terms[0].values, hip.terms[0].stds, strict=True)),
    ):
        assert abs(value - true) < 3.0 * std


def test_a_cubic_term_that_predicts_better_but_may_be_zero_is_refused_with_its_reason():
    held_out = {"linear": 0.0367, "cubic": 0.0139, "hysteresis": 0.0139}
    verdict, note = verdict_of(np.array([350.0, 260.0, 1.0]), np.array([1.0, 100.0, 0.1]), 11.0, held_out, 0.02, 5.0)
    assert verdict is Verdict.LINEAR
    assert "0.0367 without and 0.0139 with" in note
    assert "2.6 standard deviations from zero, not the 4.4" in note
