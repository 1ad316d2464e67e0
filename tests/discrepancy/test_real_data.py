"""Diagnosis on measured machines whose faults are known, and on recordings without periods.

The recordings are not part of the project; without them their tests are skipped.
"""

import warnings
from pathlib import Path

import numpy as np
import pytest

import sea_ident
from sea_ident.discrepancy.measured.circular import circular_springs
from sea_ident.discrepancy.measured.pushes import find_pushes
from sea_ident.discrepancy.search.base_model import missing_friction
from sea_ident.effects import make_effect
from sea_ident.exceptions import SeaIdentWarning
from sea_ident.recordings import Recording

DATA = Path(__file__).parents[2] / ".." / "shared" / "data"
IDENTIFICATION = DATA / "emps" / "identification.csv"
PULSES = DATA / "emps" / "validation_pulses.csv"
SQUARE_WAVE = DATA / "quanser_2dof_flexible_link" / "square_wave.csv"
MODULE_LOG = DATA / "hebi_x5" / "example_log.csv"
PUBLISHED = {
    "carriage.m": 95.1089,
    "slider.viscous_friction": 203.5034,
    "slider.coulomb_friction": 20.3935,
    "slider.torque_offset": -3.1648,
}
START = (make_effect("rigid_bodies"), make_effect("viscous_friction", "slider"))
FULL = (
    *START,
    make_effect("coulomb_friction", "slider", smoothing=1e-3),
    make_effect("torque_offset", "slider"),
)

pytestmark = pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")


def recording(path: Path) -> Recording:
    if not path.is_file():
        pytest.skip(f"{path.parent.name}/{path.name} is not on this machine; it is no part of the project")
    return sea_ident.read_recording(path)


@pytest.fixture(scope="module")
def axis():
    return sea_ident.load_robot("emps")


@pytest.fixture(scope="module")
def emps():
    return recording(IDENTIFICATION)


@pytest.fixture(scope="module")
def pulses():
    return recording(PULSES)


@pytest.fixture(scope="module")
def full(axis, emps):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        return sea_ident.identify(axis, emps, effects=FULL)


@pytest.fixture(scope="module")
def closed(axis, emps):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        return sea_ident.close_gap(sea_ident.identify(axis, emps, effects=START), emps)


@pytest.fixture(scope="module")
def pushed(full, pulses):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        return sea_ident.diagnose(full, pulses)


def starts(diagnosis) -> np.ndarray:
    found = [x.regime for x in diagnosis.locations if x.regime.startswith("push")]
    return np.array([float(text.split()[2]) for text in found])


def test_coulomb_friction_and_offset_are_named_in_the_first_round(closed):
    first = closed.rounds[0]
    assert first.verdict == "named_with_remainder"
    assert {(m.effect, m.joint) for m in first.missing} == {("coulomb_friction", "slider"), ("torque_offset", "slider")}
    assert any("base_tilt" in text for text in first.warnings)


def test_the_repaired_axis_is_the_published_one(closed, full):
    values = dict(zip(closed.model.names, closed.model.values, strict=True))
    for name, value in PUBLISHED.items():
        assert values[name] == pytest.approx(value, rel=0.03)
    assert closed.model.fit.rms_residual == pytest.approx(full.fit.rms_residual, rel=0.01)


def test_what_is_left_of_the_axis_gets_no_confident_name(closed):
    last = closed.rounds[-1]
    assert last.verdict in ("not_in_library", "ambiguous", "cannot_tell")
    assert closed.added == (("coulomb_friction", "slider"), ("torque_offset", "slider"))


def test_every_pulse_is_found_as_a_push_when_it_begins(pushed, pulses):
    force = pulses.columns["external_force_slider"]
    truth = pulses.time[1:][np.diff(force) != 0.0]
    found = starts(pushed)
    assert [m.effect for m in pushed.missing] == ["external_force"]
    assert all(np.min(np.abs(found - time)) < 0.01 for time in truth)
    assert all(np.min(np.abs(truth - time)) < 0.01 for time in found)


@pytest.mark.scenario
def test_without_the_column_that_tells_the_pulses_they_are_found_as_well(full, pulses, pushed):
    kept = {name: values for name, values in pulses.columns.items() if not name.startswith("external_force")}
    blind = sea_ident.diagnose(full, Recording(pulses.time, kept, source="blind"))
    assert np.array_equal(starts(blind), starts(pushed))


def test_the_recording_without_pulses_has_none(closed):
    assert not any(x.regime.startswith("push") for d in closed.rounds for x in d.locations)


def test_one_pass_is_told_in_weaker_words(axis, emps):
    model = sea_ident.identify(axis, emps, effects=START)
    diagnosis = sea_ident.diagnose(model, emps.crop(0.0, 11.0))
    assert diagnosis.verdict == "named_with_remainder"
    assert {m.effect for m in diagnosis.missing} == {"coulomb_friction", "torque_offset"}
    assert "hints and not names" in diagnosis.text
    assert any("weaker than periods" in text for text in diagnosis.warnings)


@pytest.mark.scenario
def test_the_flexible_link_gets_no_confident_name():
    link = sea_ident.load_robot("quanser_2dof")
    measured = recording(SQUARE_WAVE)
    diagnosis = sea_ident.diagnose(sea_ident.identify(link, measured), measured)
    assert diagnosis.verdict in ("cannot_tell", "ambiguous", "not_in_library")
    assert {x.joint for x in diagnosis.locations} == {"stage1", "stage2"}
    assert any("2 periods only" in text for text in diagnosis.warnings)


def test_a_torque_channel_that_is_computed_is_called_circular():
    module = sea_ident.load_robot("hebi_x5")
    log = recording(MODULE_LOG)
    (doubt,) = circular_springs(module, log)
    assert "neither show nor exclude" in doubt
    rebuilt = log.columns["theta_output"] + log.columns["tau_spring_output"] / 40.0
    (proof,) = circular_springs(module, log.replace_columns({"q_output": rebuilt}))
    assert "circular" in proof
    assert "-40 times" in proof


def noisy_axis(rng, periods):
    time = np.arange(0.0, 6.0 * periods, 0.005)
    speed = np.stack([np.sin(2.0 * np.pi * time / 6.0)], axis=1)
    misfit = 3.0 * np.exp(-((np.mod(time, 3.0) - 1.5) ** 2) / 0.01)
    return time, speed, (misfit + rng.normal(0.0, 0.3, len(time)))[:, None]


def test_pushes_are_told_from_misfit_that_comes_in_every_pass():
    time, speed, residual = noisy_axis(np.random.default_rng(3), 4)
    assert find_pushes(time, residual, speed, 1200) == ()
    residual[(time >= 7.3) & (time < 7.35)] += 8.0
    (push,) = find_pushes(time, residual, speed, 1200)
    assert push.start == pytest.approx(7.3, abs=0.011)
    assert push.stop == pytest.approx(7.35, abs=0.011)
    assert push.impulse == pytest.approx(8.0 * 0.05, rel=0.3)


def test_a_poor_model_is_no_push():
    rng = np.random.default_rng(4)
    time, speed, _ = noisy_axis(rng, 4)
    poor = np.where(rng.random(len(time)) < 0.5, 50.0, 0.0)[:, None]
    assert find_pushes(time, poor, speed, 1200) == ()


def test_friction_that_a_model_has_is_not_missing():
    model = (make_effect("viscous_friction", "a"), make_effect("coulomb_friction", "a"))
    assert missing_friction(model, ("a",)) == ()
    assert missing_friction(model[:1], ("a", "b")) == (
        ("coulomb_friction", "a"),
        ("coulomb_friction", "b"),
        ("viscous_friction", "b"),
    )
