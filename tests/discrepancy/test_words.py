"""The words of a diagnosis."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from sea_ident.discrepancy.bench.gap import Gap, gap_of
from sea_ident.discrepancy.compared.heldout import Kind
from sea_ident.discrepancy.compared.reference import ParameterChange
from sea_ident.discrepancy.evidence.foretold import Left
from sea_ident.discrepancy.measured.standing import Standing
from sea_ident.discrepancy.result.diagnosis import _gap
from sea_ident.discrepancy.result.findings import Alternative, MissingEffect, MissingParameter, Verdict, chance
from sea_ident.discrepancy.trends.trend import Trend, TrendTest
from sea_ident.discrepancy.words import Facts, _gap_sentence, paragraph, reservations
from sea_ident.effects import make_effect


def test_the_gap_of_a_slide_is_a_force():
    units = {"lift": "N", "turn": "N m"}
    gap = Gap({"lift": 2.0, "turn": 0.5}, {"lift": 0.0, "turn": 0.1}, {"lift": 0.3, "turn": 0.2}, units)
    assert "(0.3 N) at lift" in _gap_sentence(gap, units)
    turned = Gap({"lift": 0.1, "turn": 0.5}, {"lift": 0.0, "turn": 0.1}, gap.noise, units)
    assert "to 0.1 N m at turn" in _gap_sentence(turned, units)


def test_the_gap_is_told_where_what_is_named_acts():
    """Not where something else is left, at which the named effect does nothing."""
    units = dict.fromkeys(("yaw", "roll", "lift"), "N m")
    sizes = {"yaw": 0.0174, "roll": 0.0039, "lift": 0.001}, {"yaw": 0.0157, "roll": 0.0003, "lift": 0.001}
    gap = Gap(*sizes, dict.fromkeys(units, 0.01), units)
    assert _gap_sentence(gap, units, ["roll"]).endswith("goes from 0.0039 to 0.0003 N m at roll.")
    assert _gap_sentence(gap, units, ["lift", "roll"]).endswith("at roll.")
    # a tilt acts at no joint, and what shows at others only is told there
    for named in ([], ["other"], ["yaw", "roll"]):
        assert _gap_sentence(gap, units, named).endswith("to 0.0157 N m at yaw, where it was largest.")


def test_forces_and_torques_are_compared_beside_their_noise():
    sizes = {"lift": 2.0, "turn": 0.5}, {"lift": 0.0, "turn": 0.1}, {"lift": 0.4, "turn": 0.02}
    mixed, alike = {"lift": "N", "turn": "N m"}, {"lift": "N m", "turn": "N m"}
    gap = Gap(*sizes, mixed)
    assert "at turn, where it was largest beside its noise." in _gap_sentence(gap, mixed)
    assert gap.shrink == pytest.approx(1.0 - 5.0 / np.hypot(5.0, 25.0))
    # without noise each counts by the share that is left of it
    assert Gap(*sizes[:2], {"lift": 0.0, "turn": 0.0}, mixed).shrink == pytest.approx(1.0 - 0.2 / np.sqrt(2.0))
    nothing = {"lift": 0.0, "turn": 0.0}
    assert Gap(nothing, nothing, nothing, mixed).shrink == 0.0
    gap = Gap(*sizes, alike)
    assert "at lift, where it was largest." in _gap_sentence(gap, alike)
    assert gap.shrink == pytest.approx(1.0 - 0.1 / np.hypot(2.0, 0.5)) == Gap(*sizes).shrink


def test_a_gap_knows_its_units(nothing_missing):
    bench, now = nothing_missing
    assert gap_of(bench, now.fit, now.fit, now.noise).units == dict.fromkeys(bench.robot.joint_names, "N m")
    read = {
        "before": {"lift": 1.0, "turn": 1.0},
        "after": {"lift": 0.0, "turn": 0.0},
        "noise": {"lift": 1.0, "turn": 1.0},
    }
    assert _gap(read, {"lift": "N", "turn": "N m"}).mixed


def facts(verdict, periods=12, remainder=0.0, p_value=0.0, sound=True, trends=()):
    gap = Gap({"hip": 0.5}, {"hip": 0.0}, {"hip": 0.1})
    missing = (MissingEffect("torque_offset", "hip", (), 0.05, 1e-9, ()),)
    trend = TrendTest(1.0, trends, False)
    return Facts(verdict, missing, gap, None, remainder, periods, p_value, trend, None, {"hip": "N m"}, sound=sound)


def test_what_acts_on_the_whole_robot_has_no_joint_in_words():
    tilt, offset = Alternative("base_tilt", None, 0.99), Alternative("spring_offset", "hip", 0.98)
    for others, told in (((tilt,), "torque_offset at hip from base_tilt."),
                         ((tilt, offset), "torque_offset at hip, base_tilt from spring_offset at hip.")):  # fmt: skip
        missing = (MissingEffect("torque_offset", "hip", (), 0.05, 1e-9, others),)
        assert f"does not tell {told}" in paragraph(replace(facts(Verdict.AMBIGUOUS), missing=missing))


def test_motors_that_turn_too_fast_are_told_where_something_may_have_escaped():
    told = "Ripple of the turns of the motor of hip, knee is too fast for these samples and was not looked for"
    for verdict in (Verdict.NONE, Verdict.NOT_IN_LIBRARY):
        found = facts(verdict)
        assert told not in paragraph(found)
        assert told in paragraph(replace(found, motors_too_fast=("hip", "knee")))
    assert told not in paragraph(replace(facts(Verdict.NAMED), motors_too_fast=("hip", "knee")))


@pytest.mark.parametrize(("after", "said"), [(0.1, True), (0.5, False), (0.7, False)])
def test_of_what_drifts_it_is_said_where_another_motion_shows_it(after, said):
    """Where that did not begin as the recording did, nothing of it is predicted there."""
    nothing = np.zeros(1)
    drift = Trend(make_effect("friction_drift", "hip"), nothing, nothing, 100.0, 1e-9, torque_change=0.02)
    missing = (MissingEffect("friction_drift", "hip", (), 0.02, 1e-9, ()),)
    held = Gap({"hip": 0.5}, {"hip": after}, {"hip": 0.1})
    found = replace(facts(Verdict.NAMED, trends=(drift,)), missing=missing, held=held, kind=Kind.OTHER_MOTION)
    told = paragraph(found)
    assert "the mean over all of them hides it." in told
    assert ("On the motion that was held out the gap shrinks by 80 %." in told) is said


@pytest.mark.parametrize("verdict", [Verdict.NAMED, Verdict.NAMED_WITH_REMAINDER])
def test_few_periods_are_said_before_the_name(verdict):
    assert paragraph(facts(verdict)).startswith("The model lacks torque_offset at hip")
    few = paragraph(facts(verdict, periods=3))
    assert few.startswith("As far as 3 periods can show, the model lacks torque_offset at hip")
    assert "10 periods to be sure" in few


@pytest.mark.parametrize(("periods", "said"), [(3, "nothing finer than"), (4, "small effects"), (9, "small effects")])
def test_what_few_periods_leave_open_is_said(periods, said):
    (warning,) = reservations(replace(facts(Verdict.NONE, periods=periods), missing=()))
    assert warning.startswith(f"{periods} periods only")
    assert said in warning
    assert reservations(replace(facts(Verdict.NONE, periods=10), missing=())) == []


def test_a_temperature_that_cannot_be_told_from_time_is_said():
    warm = MissingEffect("temperature_friction", "hip", (), 0.05, 1e-9, (Alternative("friction_drift", "hip", 1.0),))
    for missing, said in (((warm,), True), ((replace(warm, alternatives=()),), False)):
        found = reservations(replace(facts(Verdict.AMBIGUOUS), missing=missing))
        assert any("cooling down" in text for text in found) is said


def test_a_recording_with_a_fault_is_to_blame_not_the_number_of_its_periods():
    assert "wrong with this recording" in paragraph(facts(Verdict.CANNOT_TELL, sound=False))
    assert "12 periods of this recording do not tell" in paragraph(facts(Verdict.CANNOT_TELL))


def test_no_probability_is_zero_and_no_percentage_a_power_of_ten():
    assert chance(0.0) == "< 1e-300"
    assert chance(0.03) == "= 0.03"
    assert "p < 1e-300" in paragraph(facts(Verdict.CANNOT_TELL))
    assert "A remainder of 940 % of" in paragraph(facts(Verdict.NAMED_WITH_REMAINDER, remainder=9.4))
    assert "A remainder of 0.42 % of" in paragraph(facts(Verdict.NAMED_WITH_REMAINDER, remainder=0.0042))


def test_where_nothing_that_matters_is_missing_a_disagreement_is_said():
    nothing = replace(facts(Verdict.NONE, p_value=0.3), missing=())
    assert paragraph(nothing).startswith("Nothing is missing that 12 periods could show (lack of fit p = 0.3).")
    # the equations of a joint may disagree together and not one by one
    rejected = paragraph(replace(nothing, p_value=1e-56))
    assert rejected.startswith("Nothing is named: model and data disagree beyond the noise (p = 1e-56)")
    assert "Nothing is missing" not in rejected
    told = paragraph(replace(nothing, p_value=0.0, remainder=0.0028))
    assert told.startswith("Nothing is named: model and data disagree beyond the noise (p < 1e-300)")
    assert "by 0.28 % of the torque" in told
    assert "is missing" not in told
    assert "remainder" not in told


def test_nothing_is_called_complete_beside_a_lack_of_fit():
    """What hides below the noise of the torque may stand out of it harmonic by harmonic."""
    nothing = replace(facts(Verdict.NONE, p_value=1e-4), missing=())
    told = paragraph(nothing)
    assert told.startswith("Nothing is named: model and data disagree beyond the noise (p = 0.0001), but by less than")
    assert "missing" not in told
    assert paragraph(replace(nothing, p_value=2e-3)).startswith("Nothing is missing")


def test_of_what_drifts_no_gap_of_the_mean_is_told():
    drift = SimpleNamespace(effect=make_effect("torque_offset", "hip"))
    text = paragraph(facts(Verdict.NAMED, trends=(drift,)))
    assert "shows in the comparison of the periods" in text
    assert "gap" not in text
    assert "the gap on this recording goes from 0.5" in paragraph(facts(Verdict.NAMED))


@pytest.mark.parametrize(
    ("kind", "where", "reservation"),
    [
        (Kind.OTHER_MOTION, "On the motion that was held out the gap shrinks by 80 %", None),
        (
            Kind.SAME_MOTION,
            "On the recording that was held out (the same motion again, which is a weaker test) the gap shrinks",
            "repeats the motion of this one, which is weaker",
        ),
        (
            Kind.OTHER_PERIODS,
            "On periods that were held out (the same motion again, which is a weaker test) the gap shrinks",
            "every other period of this one was held out",
        ),
        (None, "", "was not tested on another motion"),
    ],
)
def test_what_was_held_out_is_said_and_how_far_it_can_be_trusted(kind, where, reservation):
    gap = Gap({"hip": 0.5}, {"hip": 0.1}, {"hip": 0.1})
    told = replace(facts(Verdict.NAMED), held=None if kind is None else gap, kind=kind)
    assert where in paragraph(told)
    assert ("held out" in paragraph(told)) is (kind is not None)
    found = reservations(told)
    assert found == [] if reservation is None else len(found) == 1 and reservation in found[0]


@pytest.mark.parametrize(("unit", "speed"), [("N m", "0.003 rad/s"), ("N", "0.003 m/s")])
def test_what_is_not_compared_is_said_where_nothing_is_missing_and_warned_of_where_it_is_much(unit, speed):
    nothing = replace(facts(Verdict.NONE, p_value=0.5), missing=(), units={"hip": unit})
    little, much = (replace(nothing, standing=Standing("hip", share, 0.003)) for share in (0.021, 0.21))
    assert f"2.1% of the samples of hip are not compared (up to {speed};" in paragraph(little)
    assert "stiction or presliding, cannot be excluded." in paragraph(little)
    assert reservations(little) == []
    assert [text[:23] for text in reservations(much)] == ["Beside reversals 21.0% "]
    assert "not compared" not in paragraph(replace(much, verdict=Verdict.NAMED))
    assert "not compared" not in paragraph(replace(nothing, standing=Standing("hip", 0.0, 0.0)))


def test_motors_that_stand_are_told_of_with_every_verdict_in_the_place_of_what_is_not_compared():
    stood = "The motors of hip, knee stood in every sample, or nearly: nothing is told of friction, inertia and effects"
    standing = Standing("hip", 1.0, 1e-5)
    for verdict in (Verdict.NONE, Verdict.NAMED, Verdict.SUSPECT):
        text = paragraph(replace(facts(verdict), standing=standing, still=("hip", "knee")))
        assert f"{stood} there." in text
        assert "Beside reversals" not in text
    gap = Gap({"hip": 0.0}, {"hip": 0.0}, {"hip": 0.1})
    alone = replace(facts(Verdict.NONE), missing=(), standing=standing, still=("hip",), held=gap)
    assert "The motor of hip stood" in paragraph(alone)
    assert "there, nor tested on data that were held out." in paragraph(alone)
    (warning,) = reservations(alone)
    assert warning.endswith("Move every joint, or leave those out (joints, on the command line --joints)")


@pytest.mark.parametrize(
    ("std", "why"),
    [
        (0.1, "that motion shows what this one does not, or something was changed between the two"),
        (3.0, "which is no more than its parameters are unsure by on that motion (most of all torque_ripple at hip)"),
    ],
)
@pytest.mark.parametrize("verdict", [Verdict.NONE, Verdict.NAMED])
def test_what_is_left_of_another_recording_is_said_with_its_share_and_why(verdict, std, why):
    known = facts(verdict)
    left = replace(known, missing=() if verdict is Verdict.NONE else known.missing,
                   left_there={"hip": Left(3.21, 0.12, std, "torque_ripple at hip")})  # fmt: skip
    told = "On the recording that was held out the model leaves 3.21 N m at hip (12 % of the torque)"
    assert told in paragraph(left)
    assert why in paragraph(left)
    (warning,) = (text for text in reservations(left) if text.startswith(told))
    assert why in warning
    assert warning.endswith("Diagnose that one as well")


def test_what_is_left_of_two_joints_for_two_reasons_is_said_of_each():
    left = {"hip": Left(3.21, 0.12, 0.1, "rotor_inertia at hip"), "knee": Left(1.5, 0.3, 1.0, "torque_ripple at hip")}
    units = {"hip": "N m", "knee": "N m"}
    known = replace(facts(Verdict.NONE), missing=(), left_there=left, units=units)
    wrong, unsure = (text for text in reservations(known) if text.startswith("On the recording"))
    assert "3.21 N m at hip" in wrong
    assert "knee" not in wrong
    assert "1.5 N m at knee (30 % of the torque), which is no more" in unsure
    assert "rotor_inertia" not in unsure


@pytest.mark.parametrize(
    ("transfer", "said"),
    [(0.1, "does not hold"), (0.63, "as it was found, and as unsure as that is, it explains 63 %")],
)
def test_a_suspect_says_how_far_it_holds(transfer, said):
    found = facts(Verdict.SUSPECT)
    text = paragraph(replace(found, missing=(replace(found.missing[0], transfer=transfer),)))
    assert said in text
    assert ("as well: do not use it" in text) == (transfer > 0.5)


def test_what_changed_against_a_reference_is_told_by_what_tells_most_and_is_not_lacking():
    parameters = (MissingParameter("hip.payload_mx", -1e-4, 4e-4, "kg m"),
                  MissingParameter("hip.payload_mz", -0.2, 5e-4, "kg m"))  # fmt: skip
    payload = MissingEffect("payload", "hip", parameters, 0.31, 1e-24, ())
    told = "payload at hip, hip.payload_mz -0.2 +- 0.0005 kg m (31 % of torque)"
    base = replace(facts(Verdict.ONLY_AGAINST_REFERENCE), change=ParameterChange(1e-24, 0.31, (payload,)))
    assert paragraph(replace(base, missing=(payload,))).endswith(f"What changed: {told}.")
    both = paragraph(replace(base, verdict=Verdict.NAMED, missing=(payload, *base.missing)))
    assert both.startswith("The model lacks torque_offset at hip (5 % of torque). ")
    assert both.endswith(f" Against the reference, other parameters changed too: {told}.")


@pytest.mark.parametrize(("std", "told"), [(0.001, "x.scale 0.06 +- 0.001"), (0.0, "x.scale 0.06, held")])
def test_a_number_without_a_unit_has_none_behind_it(std, told):
    assert str(MissingParameter("x.scale", 0.06, std, "-")) == told
    missing = MissingEffect(
        "encoder_offset", "x", (MissingParameter("x.scale", 0.06, std, "-"),), 0.1, 1e-9, (),
        detail=make_effect("encoder_offset", "x"),
    )  # fmt: skip
    assert missing.extent == "0.06"
