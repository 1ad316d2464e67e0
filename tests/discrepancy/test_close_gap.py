"""From a model that lacks two effects, one of them in a spring, to one that lacks nothing."""

from dataclasses import replace

import numpy as np
import pytest

import sea_ident
from sea_ident.discrepancy import close
from sea_ident.discrepancy.measured.data import wide_processing
from sea_ident.discrepancy.result.diagnosis import Diagnosis
from sea_ident.discrepancy.result.findings import Alternative, LackOfFit, MissingEffect, Verdict
from sea_ident.discrepancy.simulated import forward
from sea_ident.discrepancy.simulated.forward import simulation_gap
from sea_ident.effects import base_effects, make_effect
from sea_ident.estimation import identify, read_model
from sea_ident.exceptions import DivergenceError, SeaIdentWarning
from sea_ident.simulation import PlantedEffect

PERIOD = 5.0
NOTHING_LACKS = LackOfFit(0.0, 1, 1.0, 1.0, {})
# a model that lacks the ripple says that it lacks something, and so do its springs
pytestmark = [
    pytest.mark.filterwarnings("ignore:the residual of the mean:sea_ident.exceptions.SeaIdentWarning"),
    pytest.mark.filterwarnings("ignore:spring of .* its law leaves:sea_ident.exceptions.SeaIdentWarning"),
]


def planted():
    return (
        PlantedEffect(make_effect("spring_offset", "knee"), np.array([1.0])),
        PlantedEffect(make_effect("torque_ripple", "hip", order=4.0), np.array([1.0, 0.5])),
    )


@pytest.fixture(scope="module")
def recordings(laboratory):
    pairs = [(p.effect, p.values) for p in planted()]
    return [laboratory.record(pairs, periods=10, seed=seed, motion=motion) for motion, seed in ((0, 3), (1, 9))]


@pytest.fixture(scope="module")
def closed(leg, recordings):
    training, holdout = recordings
    with (
        pytest.warns(SeaIdentWarning, match=r"\(hip .* the model lacks something"),
        pytest.warns(SeaIdentWarning, match="spring of hip: its law leaves"),
        pytest.warns(SeaIdentWarning, match="spring of knee: its law leaves"),
    ):
        model = sea_ident.identify(leg, training, period=PERIOD)
    return sea_ident.close_gap(model, training, holdout=holdout)


def without_reference(recording):
    columns = {name: values for name, values in recording.columns.items() if "reference" not in name}
    return type(recording)(recording.time, columns, recording.source)


@pytest.mark.scenario
def test_both_are_added_and_nothing_is_left(closed):
    assert closed.verdict == "none"
    assert set(closed.added) == {("spring_offset", "knee"), ("torque_ripple", "hip")}


@pytest.mark.scenario
def test_the_history_shows_the_gap_shrink_in_torque_and_in_simulation(closed):
    first, last = closed.history[0], closed.history[-1]
    assert first.torque_held_out[1] < 0.15 * first.torque_held_out[0]
    assert first.simulation["q"][1] < 0.2 * first.simulation["q"][0]
    assert not last.named
    assert last.simulation == {}
    assert "simulated q" in closed.summary()


@pytest.mark.scenario
def test_what_cancels_in_the_motor_torque_is_kept(closed):
    spring = next(s for s in closed.model.springs if s.joint == "knee")
    value, std = spring.terms[0].values[0], spring.terms[0].stds[0]
    assert spring.terms[0].effect.name == "spring_offset"
    assert abs(value - 1.0) < 5.0 * std


@pytest.mark.scenario
def test_saved_read_back_and_diagnosed_again_nothing_is_missing(closed, recordings, tmp_path):
    closed.model.save(tmp_path / "m.json")
    again = read_model(tmp_path / "m.json")
    diagnosis = sea_ident.diagnose(again, recordings[0])
    assert diagnosis.verdict == "none"
    assert not diagnosis.missing


@pytest.fixture(scope="module")
def models(leg, recordings):
    effects = base_effects(leg)
    whole = (*effects, *(p.effect for p in planted()))
    return [identify(leg, recordings[0], effects=chosen, period=PERIOD) for chosen in (effects, whole)]


@pytest.mark.scenario
def test_without_a_reference_the_measured_motion_stands_in_and_it_is_said(leg, models, recordings):
    bare = without_reference(recordings[1])
    found = simulation_gap(*models, bare, wide_processing(bare, leg, PERIOD))
    assert "the recording has no reference" in found.notes[0]
    assert found.gaps["q"].shrink > 0.8
    assert set(found.gaps) == {"q", "theta", "tau"}


@pytest.mark.scenario
def test_a_model_that_cannot_be_simulated_gives_no_gap_but_the_reason(leg, models, recordings):
    springs = tuple(replace(s, stiffness=-1.0, linear_stiffness=-1.0) for s in models[0].springs)
    broken = replace(models[0], springs=springs)
    found = simulation_gap(broken, models[1], recordings[1], wide_processing(recordings[1], leg, PERIOD))
    assert found.gaps == {}
    assert "no forward simulation of the model before the repair" in found.notes[-1]


@pytest.mark.scenario
def test_where_a_simulation_diverges_the_advice_is_one_that_a_diagnosis_can_follow(
    leg, models, recordings, monkeypatch
):
    """It has no argument for the step."""

    def diverging(*_):
        raise DivergenceError("the simulation diverged at 0.1 s", "take a shorter step than 0.001 s")

    monkeypatch.setattr(forward, "simulated", diverging)
    found = simulation_gap(*models, recordings[1], wide_processing(recordings[1], leg, PERIOD))
    assert "before the repair: the simulation diverged at 0.1 s; in Python, give `diagnose`" in found.notes[-1]
    assert "step" not in found.notes[-1]


@pytest.mark.scenario
def test_a_second_one_of_a_kind_at_a_joint_is_added_too(models, recordings, monkeypatch):
    """As any effect: what the first diagnosis leaves of another order, the second one names."""
    ripples = [make_effect("torque_ripple", "hip", order=order, number=k) for k, order in ((1, 4.0), (2, 12.0))]
    rounds = iter([*ripples, None])

    def diagnosed(model, recording, **options):
        ripple = next(rounds)
        if ripple is None:
            return Diagnosis(Verdict.NONE, "", NOTHING_LACKS, model=model)
        missing = (MissingEffect("torque_ripple", "hip", (), 0.1, 1e-9, (), detail=ripple),)
        repaired = replace(model, effects=(*model.effects, ripple))
        return Diagnosis(Verdict.NAMED, "", NOTHING_LACKS, missing=missing, model=repaired)

    monkeypatch.setattr(close, "diagnose", diagnosed)
    closed = sea_ident.close_gap(models[0], recordings[0])
    assert closed.verdict == "none"
    assert [e.title for e in closed.model.effects][-2:] == ["torque_ripple at hip", "torque_ripple 2 at hip"]
    assert not closed.warnings


@pytest.mark.scenario
def test_what_is_named_and_cannot_be_added_is_said(models, recordings, monkeypatch):
    missing = (MissingEffect("link_friction", "knee", (), 0.1, 1e-9, ()),)
    found = Diagnosis(Verdict.NAMED, "", NOTHING_LACKS, missing=missing, warnings=("there is no repaired model: why",))
    monkeypatch.setattr(close, "diagnose", lambda *_, **__: found)
    closed = sea_ident.close_gap(models[0], recordings[0])
    assert closed.model is models[0]
    assert closed.added == ()
    assert closed.warnings == (
        "there is no repaired model: why",
        "link_friction at knee: named, but not added, for there is no repaired model",
    )


@pytest.mark.scenario
def test_what_is_ambiguous_is_not_added_and_it_is_said_which_model_has_it(models, recordings, monkeypatch):
    others = (Alternative("encoder_offset", "knee", 1.0),)
    missing = (
        MissingEffect("torque_ripple", "hip", (), 0.1, 1e-9, ()),
        MissingEffect("spring_offset", "knee", (), 0.1, 1e-9, others),
    )
    found = Diagnosis(Verdict.AMBIGUOUS, "", NOTHING_LACKS, missing=missing, model=models[1])
    monkeypatch.setattr(close, "diagnose", lambda *_, **__: found)
    closed = sea_ident.close_gap(models[0], recordings[0])
    assert closed.model is models[0]
    assert closed.added == ()
    assert len(closed.warnings) == 1
    assert closed.warnings[0].startswith("nothing more was added")
    assert "explain the data as well as spring_offset at knee; the model of the last diagnosis" in closed.warnings[0]


@pytest.mark.scenario
def test_what_speaks_against_a_repaired_model_is_said_where_nothing_is_missing_then(models, recordings, monkeypatch):
    missing = (MissingEffect("torque_ripple", "hip", (), 0.1, 1e-9, ()),)
    poor = Diagnosis(
        Verdict.NAMED, "", NOTHING_LACKS, missing=missing, model=models[1], warnings=("the gap of q grows",)
    )
    rounds = iter([poor, Diagnosis(Verdict.NONE, "", NOTHING_LACKS, model=models[1])])
    monkeypatch.setattr(close, "diagnose", lambda *_, **__: next(rounds))
    closed = sea_ident.close_gap(models[0], recordings[0])
    assert closed.verdict == "none"
    assert "warning: the gap of q grows" in closed.summary()


@pytest.mark.scenario
@pytest.mark.parametrize("named", [("payload", "ankle"), ("friction_drift", "knee")], ids=lambda pair: pair[0])
def test_what_no_model_holds_was_not_added(models, recordings, monkeypatch, named):
    """What differs from a reference, what drifts and is not in the model: named beside what is added."""
    missing = (MissingEffect(*named, (), 0.2, 1e-9, ()), MissingEffect("torque_ripple", "hip", (), 0.1, 1e-9, ()))
    first = Diagnosis(Verdict.NAMED, "", NOTHING_LACKS, missing=missing, model=models[1])
    rounds = iter([first, Diagnosis(Verdict.NONE, "", NOTHING_LACKS, model=models[1])])
    monkeypatch.setattr(close, "diagnose", lambda *_, **__: next(rounds))
    closed = sea_ident.close_gap(models[0], recordings[0])
    assert closed.added == (("torque_ripple", "hip"),)
    assert closed.history[0].named == (named, ("torque_ripple", "hip"))
