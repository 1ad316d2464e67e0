"""Every verdict can be reached, and input that proves nothing never gets a name."""

import pickle
import warnings
from dataclasses import replace

import numpy as np
import pytest

import sea_ident
from sea_ident.discrepancy import Verdict
from sea_ident.discrepancy.bench.gap import Gap
from sea_ident.discrepancy.conclude import explains, verdict_of
from sea_ident.discrepancy.measured.check import Findings
from sea_ident.discrepancy.result.findings import Alternative, MissingEffect, MissingParameter
from sea_ident.discrepancy.trends.trend import Trend, TrendTest
from sea_ident.effects import make_effect
from sea_ident.exceptions import DiagnosisError, SeaIdentError, SeaIdentWarning
from sea_ident.motion import FourierSeries
from sea_ident.recordings import Recording

PERIOD = 5.0


def scaled(series, amplitude):
    return FourierSeries(series.base_frequency, series.offset, amplitude * series.a, amplitude * series.b)


RIPPLE = ("torque_ripple", "hip", [1.0, 0.5], {"order": 4.0})


@pytest.fixture(scope="module")
def intact(laboratory):
    return laboratory.record(periods=10)


@pytest.fixture(scope="module")
def model(leg, intact):
    return sea_ident.identify(leg, intact, period=PERIOD)


def identified(leg, recording):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        return sea_ident.identify(leg, recording, period=PERIOD)


def quietly(*arguments, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        return sea_ident.diagnose(*arguments, **options)


@pytest.mark.scenario
def test_none(model, intact, monkeypatch):
    found = quietly(model, intact)
    assert found.verdict is Verdict.NONE
    assert "was not looked for" not in found.text
    monkeypatch.setattr("sea_ident.discrepancy.conclude.motors_too_fast", lambda state: state.robot.joint_names[1:2])
    assert "Ripple of the turns of the motor of knee is too fast for these samples" in quietly(model, intact).text


@pytest.mark.scenario
def test_named_and_held_out_periods_are_called_weaker(laboratory, leg):
    recording = laboratory.record([RIPPLE], periods=10)
    found = quietly(identified(leg, recording), recording)
    assert found.verdict is Verdict.NAMED
    assert (found.missing[0].effect, found.missing[0].joint) == ("torque_ripple", "hip")
    assert "periods" in found.holdout_source
    assert found.holdout.shrink > 0.7
    assert "weaker" in found.text
    assert any("every other period" in text for text in found.warnings)
    assert found.simulation_gap["q"].shrink > 0.5


@pytest.mark.scenario
def test_ambiguous_with_the_experiment_that_tells(laboratory, leg, series):
    small = replace(laboratory, motions=(scaled(series[0], 0.3),))
    recording = small.record([("spring_offset", "knee", [0.5], {})], periods=10)
    found = quietly(identified(leg, recording), recording)
    assert found.verdict is Verdict.AMBIGUOUS
    assert {"spring_offset", "encoder_offset"} >= {m.effect for m in found.missing}
    record = found.to_dict()["next_experiment"]
    assert record["gain"] > 1.1
    assert min(record["excitation"]["margins"].values()) >= 0.0
    assert "next experiment" in found.text
    # it goes to another process, alternatives and all
    assert any(m.alternatives for m in found.missing)
    assert pickle.loads(pickle.dumps(found)).text == found.text


@pytest.mark.scenario
def test_not_in_the_library_though_something_much_like_it_is(model, intact):
    """A ripple that grows with the load: one that does not is found, and what explains the recording better is said."""
    theta, motor = intact.columns["theta_knee"], model.robot.joints[1].actuator
    torque = 25.0 * (theta - intact.columns["q_knee"]) * np.sin(30.0 * theta)
    current = intact.columns["current_knee"] + torque / (motor.gear_ratio * motor.torque_constant)
    found = quietly(model, replace(intact, columns={**intact.columns, "current_knee": current}))
    assert [(m.effect, m.joint) for m in found.missing] == [("torque_ripple", "knee")]
    assert found.verdict is Verdict.NOT_IN_LIBRARY
    assert "The same as torque_ripple at knee, but growing with the load, leaves" in found.text


@pytest.mark.scenario
def test_only_against_the_reference(laboratory, leg, model):
    payload = make_effect("payload", "ankle")
    values = np.resize([1.5, 0.0, 0.0, 0.15, 0.05, 0.05, 0.01, 0.0, 0.0, 0.0], len(payload.columns(leg)))
    recording = laboratory.record([(payload, values)], periods=10)
    refitted = identified(leg, recording)
    found = quietly(refitted, recording, reference=model)
    assert found.verdict is Verdict.ONLY_AGAINST_REFERENCE


@pytest.mark.scenario
def test_what_is_found_is_no_change_against_the_reference_too(laboratory, model):
    offset = ("torque_offset", "hip", [1.0], {})
    found = quietly(model, laboratory.record([offset], periods=10), reference=model)
    assert [(m.effect, m.joint) for m in found.missing] == [offset[:2]]


def test_a_reference_whose_effects_the_recording_cannot_show_is_not_compared_and_that_is_said(model, intact):
    warm = replace(model, effects=(*model.effects, make_effect("temperature_friction", "hip")))
    diagnosis = quietly(model, intact, reference=warm)
    assert diagnosis.verdict is Verdict.NONE
    said = [text for text in diagnosis.warnings if "not compared with the reference" in text]
    assert len(said) == 1
    assert "temperature" in said[0]


def test_cannot_tell_from_one_pass(laboratory, model):
    negative = replace(model, springs=(replace(model.springs[0], stiffness=-1000.0), *model.springs[1:]))
    found = quietly(negative, laboratory.record(periods=1))
    assert any("spring of hip: its stiffness comes out negative" in text for text in found.warnings)
    assert found.verdict in (Verdict.CANNOT_TELL, Verdict.NONE)
    assert any("give its period (period=, on the command line --period)" in text for text in found.warnings)


@pytest.mark.scenario
def test_of_three_periods_nothing_fine_is_named(laboratory, leg):
    """What is missing shows in them, but not how they scatter along it."""
    recording = laboratory.record([RIPPLE], periods=3)
    found = quietly(identified(leg, recording), recording)
    assert found.lack_of_fit.p_value < 1e-3
    assert (found.verdict, found.missing) == (Verdict.CANNOT_TELL, ())
    assert any("nothing finer than" in text for text in found.warnings)


def test_every_verdict_follows_from_findings():
    class Data:
        periods = 20

    class Bench:
        data = Data()

    effect = MissingEffect("torque_ripple", "hip", (), 0.05, 1e-9, ())
    other = replace(effect, alternatives=(Alternative("torque_offset", "hip", 1.0),))

    nothing = np.zeros(2)
    drift = Trend(make_effect("friction_drift", "hip"), nothing, nothing, 100.0, 1e-9, torque_change=0.02)
    steady, drifts, leaves_another = TrendTest(1.0, (), False), *(TrendTest(0.0, (drift,), u) for u in (False, True))

    def verdict(missing, remainder=0.0, unexplained=0.0, fatal=False, holds=True, trends=steady):
        return verdict_of(Bench(), missing, trends, None, remainder, unexplained, Findings((), fatal), holds)

    assert verdict([]) is Verdict.NONE
    assert verdict([effect]) is Verdict.NAMED
    assert verdict([effect], remainder=0.01) is Verdict.NAMED_WITH_REMAINDER
    assert verdict([effect], remainder=0.011) is Verdict.NOT_IN_LIBRARY
    assert verdict([replace(effect, effect="coulomb_friction")], remainder=0.011) is Verdict.NAMED_WITH_REMAINDER
    # finer effects come after a friction that was not there at all, not after a constant
    offset, friction = (replace(effect, effect=name) for name in ("torque_offset", "coulomb_friction"))
    assert verdict([friction, offset], remainder=0.011) is Verdict.NAMED_WITH_REMAINDER
    assert verdict([offset], remainder=0.011) is Verdict.NOT_IN_LIBRARY
    assert verdict([friction], remainder=0.011, unexplained=0.3) is Verdict.NAMED_WITH_REMAINDER
    assert verdict([effect], remainder=0.01, unexplained=0.3) is Verdict.NOT_IN_LIBRARY
    assert verdict([effect], remainder=0.01, unexplained=0.2) is Verdict.NAMED_WITH_REMAINDER
    # what drifts is in the mean too, but not where the periods show more than what was named
    assert verdict([effect], remainder=0.01, unexplained=0.6, trends=drifts) is Verdict.NAMED_WITH_REMAINDER
    assert verdict([effect], remainder=0.01, unexplained=0.6, trends=leaves_another) is Verdict.NOT_IN_LIBRARY
    assert verdict([other]) is Verdict.AMBIGUOUS
    weak = replace(effect, transfer=0.1)
    assert verdict([weak]) is Verdict.SUSPECT
    # so much is left that the library does not have it, whether what is nearest holds on other data or not
    assert verdict([weak], remainder=0.01, unexplained=0.45) is Verdict.SUSPECT
    assert verdict([weak], remainder=0.01, unexplained=0.6) is Verdict.NOT_IN_LIBRARY
    assert verdict([weak], remainder=0.01, unexplained=0.6, trends=drifts) is Verdict.SUSPECT
    assert verdict([weak], remainder=0.01, unexplained=0.6, holds=False) is Verdict.SUSPECT
    # what else is missing may spoil one of several, but not one that is alone
    assert verdict([replace(effect, transfer=0.65)]) is Verdict.SUSPECT
    assert verdict([replace(effect, transfer=0.75)]) is Verdict.NAMED
    assert verdict([replace(effect, transfer=0.65), friction]) is Verdict.NAMED
    assert verdict([effect], holds=False) is Verdict.SUSPECT
    assert verdict([], remainder=0.01) is Verdict.NOT_IN_LIBRARY
    assert verdict([effect], fatal=True) is Verdict.CANNOT_TELL


@pytest.mark.parametrize(
    ("train", "held", "noise", "expected"),
    [
        ((1.0, 0.1), (2.0, 0.2), 0.1, True),  # goes on both
        ((1.0, 0.1), (50.0, 49.0), 0.1, False),  # stays on the other, far beyond its noise
        ((1.0, 0.1), (50.0, 80.0), 0.1, False),  # grows there
        ((1.0, 0.1), (0.2, 0.2), 0.1, True),  # hardly more than noise there: nothing can be told
        ((1.0, 0.9), (50.0, 49.0), 0.1, True),  # does not go on the recording itself either: a drift
    ],
)
def test_what_is_found_must_explain_other_data_too(train, held, noise, expected):
    gaps = [
        Gap({"hip": b, "knee": 0.0}, {"hip": a, "knee": 0.0}, {"hip": noise, "knee": 0.0}) for b, a in (train, held)
    ]
    assert explains(*gaps) is expected


def test_a_slide_of_large_forces_does_not_hide_what_a_joint_leaves():
    """Each in units of its noise: the slide is at half of it, the joint at ten times its own."""
    units, noise = {"slide": "N", "hip": "N m"}, {"slide": 10.0, "hip": 0.1}
    training = Gap({"slide": 8.0, "hip": 2.0}, {"slide": 5.0, "hip": 0.0}, noise, units)
    held = Gap({"slide": 5.0, "hip": 1.0}, {"slide": 5.0, "hip": 1.0}, noise, units)
    assert not explains(training, held)
    assert explains(training, replace(held, units={}))
    assert explains(training, replace(held, after={"slide": 5.0, "hip": 0.3}))


def test_an_error_of_an_encoder_is_said_in_its_own_unit():
    """What it does to the torque is mostly taken up by the spring, and can be many times the torque."""
    shift = MissingParameter("knee.encoder_offset_offset", -0.0026, 1e-5, "rad")
    offset = MissingEffect(
        "encoder_offset", "knee", (shift,), 4.1, 0.0, (), detail=make_effect("encoder_offset", "knee")
    )
    assert offset.extent == "-0.0026 rad"
    for share, said in ((0.041, "4.1 % of torque"), (0.46, "46 % of torque"), (43.0, "43 times the torque")):
        assert MissingEffect("torque_offset", "knee", (shift,), share, 0.0, ()).extent == said


# -- input that proves nothing


def changed(recording, **columns):
    return type(recording)(recording.time, {**recording.columns, **columns}, "changed")


def test_a_holdout_of_another_robot_is_refused(model, intact):
    columns = {name.replace("_knee", "_elbow"): values for name, values in intact.columns.items()}
    other = type(intact)(intact.time, columns, "elbow")
    with pytest.raises(DiagnosisError, match="another robot"):
        sea_ident.diagnose(model, intact, holdout=other)


def test_a_model_of_another_robot_is_refused(intact):
    time = np.arange(2000) * 0.01
    q = 0.1 * np.sin(2 * np.pi * time / 5)
    slide = type(intact)(
        time, {"q_slider": q, "tau_motor_slider": 50 * np.gradient(np.gradient(q, 0.01), 0.01)}, "slide"
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        foreign = sea_ident.identify(sea_ident.load_robot("emps"), slide, period=5.0)
    with pytest.raises(DiagnosisError, match="another robot"):
        sea_ident.diagnose(foreign, intact)


def test_the_same_samples_under_another_name_are_refused(model, intact):
    half = slice(len(intact.time) // 2, None)
    part = {name: values[half] for name, values in intact.columns.items()}
    with pytest.raises(DiagnosisError, match="proves nothing"):
        sea_ident.diagnose(model, intact, holdout=type(intact)(intact.time[half], part, "half of it"))


@pytest.mark.parametrize("column", ["q_ankle", "current_knee"])
def test_a_dead_channel_is_refused_in_either_recording(model, intact, column):
    dead = changed(intact, **{column: np.full(len(intact.time), 0.5)})
    with pytest.raises(DiagnosisError, match=f"column {column} is constant"):
        sea_ident.diagnose(model, dead)
    with pytest.raises(DiagnosisError, match=f"column {column} is constant"):
        sea_ident.diagnose(model, intact, holdout=dead)


def test_time_in_milliseconds_is_refused_in_either_recording(model, intact):
    late = Recording(1e3 * intact.time, intact.columns, "ms.csv")
    for recordings in ((late, None), (intact, late)):
        with pytest.raises(DiagnosisError, match=r"ms\.csv: no position moves faster"):
            quietly(model, recordings[0], holdout=recordings[1])


def test_the_order_of_the_columns_does_not_matter(model, intact):
    turned = type(intact)(intact.time, dict(reversed(intact.columns.items())), "turned")
    assert quietly(model, turned, period=PERIOD).verdict is Verdict.NONE


def test_spikes_are_left_out_and_said(model, intact):
    values = intact.columns["q_knee"].copy()
    values[[1300, 1301]] += 0.2
    found = quietly(model, changed(intact, q_knee=values), period=PERIOD)
    assert any("spikes in period(s)" in text for text in found.warnings)
    assert found.verdict in (Verdict.NONE, Verdict.CANNOT_TELL)


@pytest.mark.slow
def test_a_clipped_torque_gets_no_confident_name(leg, model, intact):
    name = next(c for c in intact.columns if c.endswith("_knee") and c.startswith(("tau_motor", "current")))
    limit = 0.5 * np.abs(intact.columns[name]).max()
    clipped = changed(intact, **{name: np.clip(intact.columns[name], -limit, limit)})
    found = quietly(model, clipped, period=PERIOD)
    assert found.verdict in (Verdict.CANNOT_TELL, Verdict.NONE)
    assert any("clipped" in text for text in found.warnings)


@pytest.mark.scenario
def test_a_holdout_of_one_period_is_said_to_test_nothing(laboratory, model, intact):
    once = laboratory.record(periods=1, motion=1)
    try:
        found = quietly(model, intact, holdout=once)
    except SeaIdentError:
        return
    assert any("held-out recording" in text for text in found.warnings)
