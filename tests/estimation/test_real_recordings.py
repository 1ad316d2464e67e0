"""Measured data, read from beside the checkout; the numbers to meet are published ones."""

from pathlib import Path

import numpy as np
import pytest

from estimation import emps as emps_facts
from sea_ident.estimation import (
    InstrumentalVariables,
    JointWLS,
    LeastSquares,
    MaximumLikelihood,
    PerSampleWLS,
    Robust,
    identify,
    identify_measured_springs,
    physical_parameters,
)
from sea_ident.exceptions import RecordingError, SeaIdentWarning
from sea_ident.processing import process
from sea_ident.processing.periods import detect_period
from sea_ident.recordings import Recording, read_recording
from sea_ident.regressor import prior_parameters
from sea_ident.robot import load_robot
from sea_ident.validation import validate

DATA = Path(__file__).parents[2] / ".." / "shared" / "data"
pytestmark = [
    pytest.mark.skipif(not DATA.is_dir(), reason="measured recordings are not beside this checkout (../shared/data)"),
    pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning"),
]

PUBLISHED = np.array(list(emps_facts.PUBLISHED.values()))


@pytest.fixture(scope="module")
def emps():
    return load_robot("emps")


@pytest.fixture(scope="module")
def emps_model():
    return emps_facts.EFFECTS


@pytest.fixture(scope="module")
def emps_data(emps):
    recording = read_recording(emps_facts.IDENTIFICATION)
    return process(recording, emps)


def test_emps_period_is_found(emps_data):
    assert emps_data.period == pytest.approx(6.24)
    assert emps_data.periods == 3


@pytest.mark.parametrize(
    "estimator",
    [LeastSquares(), JointWLS(), PerSampleWLS(), Robust(), InstrumentalVariables(), MaximumLikelihood()],
    ids=lambda e: e.name,
)
def test_emps_comes_out_near_the_published_values(emps, emps_model, emps_data, estimator):
    model = identify(emps, emps_data, effects=emps_model, estimator=estimator)
    deviation = np.abs(model.values / PUBLISHED - 1.0)
    # Huber's estimator sees the spikes at reversal as outliers, so friction moves a little
    factor = 2.0 if isinstance(estimator, Robust) else 1.0
    assert np.all(deviation < factor * np.array([0.005, 0.02, 0.02, 0.03])), deviation
    lower, upper = model.interval()
    assert np.all((lower < PUBLISHED) & (upper > PUBLISHED))


def test_emps_predicts_where_no_pulse_acts(emps, emps_model, emps_data):
    model = identify(emps, emps_data, effects=emps_model)
    found = validate(model, read_recording(DATA / "emps" / "validation_pulses.csv"))
    assert found.samples > 5000
    # as well as the data it was found from
    assert found.rms[0] < 1.25 * model.fit.rms_residual[0]
    assert found.nrms[0] < 0.06


def test_emps_mass_is_possible(emps, emps_model, emps_data):
    model = identify(emps, emps_data, effects=emps_model)
    found = physical_parameters(model)
    assert found.consistent
    assert found.named()["carriage.m"] == pytest.approx(model.values[0], rel=1e-9)


def test_quanser_says_what_it_does_not_know():
    robot = load_robot("quanser_2dof")
    model = identify(robot, read_recording(DATA / "quanser_2dof_flexible_link" / "square_wave.csv"))
    assert model.fit.period == pytest.approx(10.0)
    assert model.fit.periods == 2
    assert any("the model lacks something" in text for text in model.warnings)
    assert [s.joint for s in model.springs] == ["stage1", "stage2"]
    # two periods and a model that lacks something: wide intervals, not confident ones
    assert np.all(model.uncertainty.half_width() > 2.0 * model.std)
    # the sum of link and motor rows does not separate the inertias here, and physics shows it
    assert not physical_parameters(model).consistent


def test_quanser_repeats_after_ten_seconds_to_the_last_digit():
    recording = read_recording(DATA / "quanser_2dof_flexible_link" / "square_wave.csv")
    reference = np.stack([recording.columns[f"theta_reference_stage{k}"] for k in (1, 2)], axis=1)
    interval = np.diff(recording.time).mean()
    assert interval == pytest.approx(0.002)
    samples = round(10.0 / interval)
    assert np.array_equal(reference[samples:], reference[:-samples])
    # 10.008 s, which is also told of these data, is four samples off
    assert np.abs(reference[samples + 4 :] - reference[: -samples - 4]).max() > 0.01


def test_quanser_beside_its_nominal_values():
    robot = load_robot("quanser_2dof")
    model = identify(robot, read_recording(DATA / "quanser_2dof_flexible_link" / "square_wave.csv"))
    nominal = model.base.project(np.nan_to_num(prior_parameters(robot, model.effects)))
    lower, upper = model.interval()
    inside = dict(zip(model.names, (lower <= nominal) & (nominal <= upper), strict=True))
    # the nominal model has no Coulomb friction, and more viscous friction at the second stage than these data show
    assert not inside["stage1.coulomb_friction"]
    assert not inside["stage2.viscous_friction"]
    inertias = [name for name in model.names if name.split(".")[1][0] in "mIr"]
    assert len(inertias) == 6
    assert all(inside[name] for name in inertias)
    # negative inertias are called impossible, with the body and the distance
    found = physical_parameters(model)
    assert set(found.bodies) == {"link1", "link2"}
    assert np.abs(found.shift_in_std).max() > 2.0
    assert "bodies that hold back: link" in found.summary()
    possible = dict(zip(model.names, found.base_values, strict=True))
    assert possible["link1.Izz*"] > 0.0
    assert possible["link2.Izz"] > 0.0
    for spring in model.springs:
        assert spring.verdict == "not_excited"
        assert any(f"spring of {spring.joint}" in text for text in model.warnings)


def single_periods(robot, path, model, processed):
    """Base parameters from every period of a recording alone, otherwise processed alike."""
    recording = read_recording(path)
    samples, periods = processed.samples, processed.periods
    values = []
    for p in range(periods):
        first = recording.samples - (periods - p) * samples
        part = slice(first, first + samples)
        columns = {name: column[part] for name, column in recording.columns.items()}
        one = process(
            Recording(recording.time[part], columns, f"period {p + 1}"),
            robot,
            period=processed.period,
            link_harmonics=processed.link_harmonics,
            motor_harmonics=processed.motor_harmonics,
        )
        values.append(identify(robot, one, effects=model.effects, estimator=PerSampleWLS()).values)
    return np.array(values)


@pytest.mark.parametrize("name", ["emps", "quanser_2dof"])
def test_stated_repeatability_is_the_scatter_between_real_periods(name, emps_model):
    path = {"emps": "emps/identification.csv", "quanser_2dof": "quanser_2dof_flexible_link/square_wave.csv"}[name]
    robot = load_robot(name)
    processed = process(read_recording(DATA / path), robot)
    model = identify(robot, processed, effects=emps_model if name == "emps" else None)
    values = single_periods(robot, DATA / path, model, processed)
    scatter = values.std(axis=0, ddof=1) / np.sqrt(len(values))
    stated = np.sqrt(np.diag(model.uncertainty.repeatability))
    # few periods: the scatter itself is known to a factor of about two
    assert 0.5 < np.sqrt(np.mean((scatter / stated) ** 2)) < (1.5 if name == "emps" else 2.0)
    # from period to period the axis changes by more than the scatter within a period explains
    assert any("whole periods differ" in text for text in model.warnings) == (name == "emps")
    # what the model lacks counts, too: what is stated in all is never less than the scatter
    assert np.all(model.std > scatter)


def test_hebi_repeats_after_a_second_whatever_its_beginning():
    recording = read_recording(DATA / "hebi_x5" / "example_log.csv")
    even = np.linspace(recording.time[0], recording.time[-1], recording.samples)
    q = np.interp(even, recording.time, recording.columns["q_output"])[:, None]
    found = detect_period(even, q)
    assert found == pytest.approx(1.0, abs=2e-4)  # the first second, from rest, would make it 0.998
    # evidence: a series of that period leaves of the rest no more than noise, of any other period much more
    later = recording.time > recording.time[0] + 1.5
    left = []
    for period in (found, 0.998, 1.002):
        phase = 2.0 * np.pi * np.outer(recording.time[later] / period, np.arange(1, 6))
        columns = np.column_stack([np.ones(len(phase)), np.sin(phase), np.cos(phase)])
        signal = recording.columns["q_output"][later]
        left.append(np.std(signal - columns @ np.linalg.lstsq(columns, signal, rcond=None)[0]))
    assert left[0] < 2e-3
    assert min(left[1:]) > 5.0 * left[0]


def test_hebi_names_the_missing_torque_constant():
    robot = load_robot("hebi_x5")
    recording = read_recording(DATA / "hebi_x5" / "example_log.csv")
    with pytest.raises(RecordingError, match="no <torqueConstant>"):
        identify(robot, recording)


def test_hebi_torque_is_computed_from_the_deflection():
    robot = load_robot("hebi_x5")
    recording = read_recording(DATA / "hebi_x5" / "example_log.csv")
    # the deflection that the firmware used is not among the columns; its torque is -40 N m/rad times it
    columns = recording.columns
    own = recording.replace_columns({"q_output": columns["theta_output"] + columns["tau_spring_output"] / 40.0})
    with pytest.warns(SeaIdentWarning, match="-40 x the deflection"):
        (spring,) = identify_measured_springs(robot, own)
    assert spring.verdict == "circular"
    # the encoders that are among the columns are too coarse to say anything about the spring
    (spring,) = identify_measured_springs(robot, recording, unknown_zero=["output"])
    assert spring.verdict != "circular"
    assert spring.rms_residual > 0.5 * spring.rms_torque
