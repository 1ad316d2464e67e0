"""Planted effects are found, named and shown to transfer; nothing is named where nothing is missing."""

import importlib
import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import sea_ident
from sea_ident import side_by_side
from sea_ident.discrepancy import searching
from sea_ident.discrepancy.trends.trend import Trend, TrendTest
from sea_ident.effects import make_effect
from sea_ident.exceptions import DiagnosisError
from sea_ident.recordings import Recording

diagnosing = importlib.import_module("sea_ident.discrepancy.diagnose")


def recorded(laboratory, planted, seed):
    return [laboratory.record(planted, periods=12, seed=seed + motion, motion=motion) for motion in (0, 1)]


@pytest.fixture(scope="module")
def intact(laboratory):
    return recorded(laboratory, (), 100)


@pytest.fixture(scope="module")
def stribeck(laboratory):
    return recorded(laboratory, [("stribeck_friction", "knee", [1.0], {"speed": 0.1})], 200)


@pytest.fixture(scope="module")
def intact_model(leg, intact):
    return sea_ident.identify(leg, intact[0], period=5.0)


@pytest.fixture(scope="module")
def stribeck_model(leg, stribeck):
    return sea_ident.identify(leg, stribeck[0], period=5.0)


@pytest.fixture(scope="module")
def closed(stribeck, stribeck_model):
    training, holdout = stribeck
    return sea_ident.close_gap(stribeck_model, training, holdout=holdout)


@pytest.fixture(scope="module")
def found(closed):
    """What `diagnose` says of the model as it was given: the first round of closing the gap is that."""
    return closed.rounds[0]


def test_nothing_is_named_where_nothing_is_missing(intact, intact_model):
    training, holdout = intact
    diagnosis = sea_ident.diagnose(intact_model, training, holdout=holdout)
    assert diagnosis.verdict == "none"
    assert not diagnosis.missing


def test_the_planted_effect_is_named_at_its_joint(found):
    assert found.verdict in ("named", "named_with_remainder")
    assert (found.missing[0].effect, found.missing[0].joint) == ("stribeck_friction", "knee")


@pytest.mark.scenario
def test_a_second_core_changes_nothing(stribeck, stribeck_model, found, monkeypatch, tmp_path):
    """Not a digit; and what is done is told once."""
    training, holdout = stribeck
    told, cores = tmp_path / "told.txt", side_by_side._cores()
    monkeypatch.setattr(side_by_side, "_cores", lambda: 1 if cores > 1 else 2)

    def tell(what, share):
        with told.open("a") as file:
            file.write(f"{share}\n")

    again = sea_ident.diagnose(stribeck_model, training, holdout=holdout, progress=tell)
    assert again.to_dict() == found.to_dict()
    shares = [float(line) for line in told.read_text().split()]
    assert sorted(set(shares)) == shares
    assert shares[-1] == 1.0


def test_its_size_is_the_planted_one(found):
    size = next(p for p in found.missing[0].parameters if p.unit == "N m")
    assert abs(size.value - 1.0) < 4.0 * size.std
    assert size.std < 0.3


def test_the_gap_shrinks_on_motion_that_was_not_used(found):
    record = found.to_dict()
    assert record["gap"]["shrink_holdout"] > 0.7
    assert record["gap"]["holdout"]["before"]["knee"] > 0.05


def test_what_is_written_is_read_back(found, tmp_path):
    found.save(tmp_path / "diagnosis.json")
    record = json.loads((tmp_path / "diagnosis.json").read_text())
    assert record["verdict"] == found.verdict
    assert record["missing"][0]["effect"] == "stribeck_friction"
    assert all(np.isfinite(p["value"]) for m in record["missing"] for p in m["parameters"])


def test_the_same_file_twice_proves_nothing(intact, intact_model):
    training, _ = intact
    with pytest.raises(DiagnosisError, match="proves nothing"):
        sea_ident.diagnose(intact_model, training, holdout=training)


def test_a_recording_of_another_robot_is_refused(intact, intact_model):
    training, holdout = intact
    renamed = {name.replace("_knee", "_elbow"): values for name, values in holdout.columns.items()}
    other = type(holdout)(holdout.time, renamed, "another robot")
    with pytest.raises(DiagnosisError, match="another robot"):
        sea_ident.diagnose(intact_model, training, holdout=other)


def test_the_gap_is_closed_and_the_history_kept(stribeck, stribeck_model, closed):
    assert closed.verdict == "none"
    assert closed.added == (("stribeck_friction", "knee"),)
    assert closed.rounds[0].verdict in ("named", "named_with_remainder")
    names = {column.name for column in closed.model.base.columns}
    assert "knee.stribeck_friction" in names
    before, after = (float(sea_ident.validate(m, stribeck[1]).rms[1]) for m in (stribeck_model, closed.model))
    assert after < 0.8 * before


@pytest.mark.scenario
@pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")
def test_a_period_that_is_none_of_the_motion_is_said_and_written(leg, intact, tmp_path):
    """Periods of four seconds of a motion of five have nothing in common: no sample is left to be compared."""
    model = sea_ident.identify(leg, intact[0], period=4.0)
    found = sea_ident.diagnose(model, intact[0], period=4.0)
    assert str(found.verdict) == "cannot_tell"
    assert any("not the period of this motion" in text for text in found.warnings)
    found.save(tmp_path / "diagnosis.json")
    written = json.loads((tmp_path / "diagnosis.json").read_text())
    assert 0.0 <= written["lack_of_fit"]["p_value"] <= 1.0


@pytest.mark.scenario
@pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")
def test_nothing_is_concluded_where_joints_changed_places(intact, intact_model):
    """Neither of a recording nor on one that was held out: it is said which columns to exchange."""
    training, holdout = intact

    def exchanged(recording):
        hip, knee = recording.columns["current_hip"], recording.columns["current_knee"]
        return recording.replace_columns({"current_hip": knee, "current_knee": hip})

    found = sea_ident.diagnose(intact_model, exchanged(training), holdout=holdout)
    assert (found.verdict, found.missing) == ("cannot_tell", ())
    assert any("columns current of 'hip' and 'knee' look exchanged" in text for text in found.warnings)
    tested = sea_ident.diagnose(intact_model, training, holdout=exchanged(holdout))
    assert tested.verdict == "none"
    assert any(text.startswith("held-out data: ") and "look exchanged" in text for text in tested.warnings)
    assert any("cannot be used; nothing was tested on it" in text for text in tested.warnings)


@pytest.mark.scenario
@pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")
def test_nothing_is_looked_for_where_a_torque_has_the_wrong_sign(intact, intact_model, monkeypatch):
    """It is said of which joint; and what is doubtful about the springs of the model is repeated."""

    def never(*arguments, **options):
        raise AssertionError("searched")

    monkeypatch.setattr(diagnosing, "searched_with_possible_springs", never)
    training = intact[0]
    turned = training.replace_columns({"current_ankle": -training.columns["current_ankle"]})
    springs = tuple(replace(s, linear_stiffness=0.01 * s.linear_stiffness) for s in intact_model.springs)
    found = sea_ident.diagnose(replace(intact_model, springs=springs), turned)
    assert (found.verdict, found.missing) == ("cannot_tell", ())
    assert any("the inertia that joint 'ankle' moves comes out negative" in text for text in found.warnings)
    assert any("no spring has the stiffness that is described" in text for text in found.warnings)


@pytest.mark.scenario
@pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")
def test_nothing_is_concluded_of_positions_in_another_unit(leg, intact, intact_model, monkeypatch):
    """Neither of a recording, nor of one pass of it, nor on one held out; where nothing disagrees, that holds."""
    training, holdout = intact

    def in_degrees(recording):
        return recording.replace_columns(
            {f"{k}_knee": np.degrees(recording.columns[f"{k}_knee"]) for k in ("q", "theta")}
        )

    spoiled = in_degrees(training)
    model = sea_ident.identify(leg, spoiled, period=5.0)
    one_pass = Recording(spoiled.time[:1500], {name: v[:1500] for name, v in spoiled.columns.items()}, "one pass")

    def searched(*_):
        raise AssertionError("what is searched for would be dropped")

    for recording in (spoiled, one_pass):
        with monkeypatch.context() as patched:
            patched.setattr(searching, "_searched", searched)
            found = sea_ident.diagnose(model, recording)
        assert (found.verdict, found.missing, found.model) == ("cannot_tell", (), None)
        assert "the warnings say what" in found.text
        # what follows from them is not told as well
        assert all("q_knee" in text or "no period" in text or "one period" in text for text in found.warnings)
        assert any("q_knee goes from" in text and "is it in degrees?" in text for text in found.warnings)
    tested = sea_ident.diagnose(intact_model, training, holdout=in_degrees(holdout))
    assert tested.verdict == "none"
    assert any(text.startswith("held-out data: ") and "in degrees" in text for text in tested.warnings)
    assert any("cannot be used; nothing was tested on it" in text for text in tested.warnings)
    narrow = replace(leg, limits=replace(leg.limits, lower=leg.limits.lower + 50.0, upper=leg.limits.upper + 50.0))
    doubtful = sea_ident.diagnose(replace(intact_model, robot=narrow), training, holdout=holdout)
    assert doubtful.verdict == "none"
    assert any("cannot be used; nothing was tested on it" in text for text in doubtful.warnings)


@pytest.mark.scenario
@pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")
@pytest.mark.parametrize("effect", ["torque_delay", "position_delay"])
def test_a_signal_that_is_50_ms_late_is_named_alone(leg, laboratory, effect):
    """A delay that its range does not hold leaves something beside it, and that gets a name."""
    late = 0.05 if effect == "position_delay" else -0.05
    training, holdout = (laboratory.record([(effect, "hip", [], {"delay": late})], motion=k) for k in (0, 1))
    diagnosis = sea_ident.diagnose(sea_ident.identify(leg, training, period=5.0), training, holdout=holdout)
    assert diagnosis.verdict == "named"
    (found,) = diagnosis.missing
    assert (found.effect, found.joint) == (effect, "hip")
    (delay,) = found.parameters
    assert abs(delay.value - late) < 3.0 * delay.std


def test_the_mean_of_what_drifts_is_not_ruled_out_by_another_recording():
    """It is another one there; what does not drift has to be the same."""
    effects = tuple(make_effect("torque_constant", joint) for joint in ("knee", "hip"))
    selection = SimpleNamespace(effects=effects, joints_of=lambda kind: set())
    held = SimpleNamespace(transfers=[SimpleNamespace(ruled_out=True, share=share) for share in (-1.4, -0.5)])
    one = np.array([0.06])
    drift = Trend(make_effect("torque_constant_drift", "knee"), one, 0.01 * one, 100.0, 1e-9, 0.03)
    elsewhere = diagnosing._elsewhere(selection, held, TrendTest(1e-9, (drift,), False))
    assert elsewhere == {0}
    assert diagnosing._out(held, 1, elsewhere) == [1]
