"""The report of a diagnosis: what it says is what the diagnosis says."""

import json
import re
import xml.etree.ElementTree as ElementTree
from dataclasses import replace

import numpy as np
import pytest

from sea_ident.discrepancy.bench.gap import Gap
from sea_ident.discrepancy.result.diagnosis import Diagnosis, read_diagnosis
from sea_ident.discrepancy.result.findings import (
    Alternative,
    Detectability,
    LackOfFit,
    Location,
    MissingEffect,
    MissingParameter,
    NextExperiment,
    Unseen,
    Verdict,
    Waveforms,
)
from sea_ident.effects import make_effect
from sea_ident.effects.friction_drift import FrictionDrift
from sea_ident.estimation import TrendTerm
from sea_ident.report import write_report
from sea_ident.report.bars import bars
from sea_ident.report.chart import Band, Line
from sea_ident.report.sections.missing import curve
from sea_ident.report.sections.verdict import MEANING

JOINTS = ("hip", "knee", "ankle")
EQUATIONS = tuple(f"{joint} {kind}" for joint in JOINTS for kind in ("motor", "link"))
SPEED = 0.3


def waveforms() -> Waveforms:
    """A residual that holds a Stribeck friction of the knee's motor, and noise."""
    rng = np.random.default_rng(0)
    time = np.arange(400) * 0.025
    q = np.stack([np.sin(2 * np.pi * (k + 1) * time / 10.0 + k) for k in range(3)], axis=1)
    dtheta = np.gradient(q, time, axis=0)
    torque = np.zeros((400, 6))
    torque[:, 2] = 0.6 * np.sign(dtheta[:, 1]) * np.exp(-((dtheta[:, 1] / SPEED) ** 2))
    after = 0.02 * rng.normal(size=(400, 6))
    return Waveforms(
        time,
        EQUATIONS,
        after + torque,
        after,
        np.full(6, 0.02),
        q,
        dtheta,
        0.01 * q,
        {"stribeck_friction at knee": torque},
    )


@pytest.fixture
def diagnosis() -> Diagnosis:
    return Diagnosis(
        verdict=Verdict.NAMED,
        text="The motor of the knee has more friction near standstill than the model: add Stribeck friction.",
        lack_of_fit=LackOfFit(
            1234.5, 400, 1e-12, 0.4, {j: {"motor": 3.1 if j == "knee" else 1.02, "link": 0.98} for j in JOINTS}, 0.001
        ),
        locations=(
            Location("knee", "motor", "near reversal", 0.41, 88.0),
            Location("knee", "motor", "slow", 0.3, 41.0),
            Location("hip", "link", "time 0 to 1.25 s", 0.02, 6.2),
        ),
        missing=(
            MissingEffect(
                "stribeck_friction", "knee",
                (
                    MissingParameter("knee.stribeck_friction", 0.6, 0.02, "N m"),
                    MissingParameter("knee.stribeck_friction_speed", SPEED, 0.01, "rad/s"),
                ),
                0.037, 2e-11, (Alternative("nonlinear_viscous_friction", "knee", 0.93),), 0.97,
            ),
        ),
        training=Gap({"hip": 0.02, "knee": 0.4, "ankle": 0.01}, {"hip": 0.02, "knee": 0.03, "ankle": 0.01},
                     {"hip": 0.05, "knee": 0.05, "ankle": 0.04}),
        holdout=Gap({"hip": 0.0, "knee": 0.3, "ankle": 0.0}, {"hip": 0.0, "knee": 0.06, "ankle": 0.0},
                    {"hip": 0.05, "knee": 0.05, "ankle": 0.04}),
        simulation_gap={"q": Gap(*(dict.fromkeys(JOINTS, size) for size in (0.01, 0.001, 1e-5)))},
        detectability=(
            Detectability("backlash", "hip", 0.002, "rad", 0.3, ("spring_offset at hip", "asymmetric_spring")),
            Detectability("base_tilt", None, float("inf"), "rad", 1.0, ("encoder_offset",)),
            Detectability(
                "stribeck_friction", "hip", 0.15, "N m", 0.9, (), (("speed", 0.1, "rad/s"), ("exponent", 2.0, "-"))
            ),
        ),
        next_experiment=NextExperiment(("stribeck_friction at knee", "nonlinear_viscous_friction at knee"), {}, 2.6),
        warnings=("only 12 periods",),
        waveforms=waveforms(),
        recording="rec.csv",
        holdout_source="rec2.csv",
        units=dict.fromkeys(JOINTS, "N m"),
    )  # fmt: skip


def page_of(diagnosis: Diagnosis, folder) -> str:
    write_report(diagnosis, folder / "d.html")
    return (folder / "d.html").read_text(encoding="utf-8")


def words(page: str) -> str:
    return " ".join(re.sub(r"<[^>]*>", " ", page[page.index("<main>") : page.index("</main>")]).split())


def test_the_page_says_verdict_gap_effect_and_alternatives(diagnosis, tmp_path):
    text = words(page_of(diagnosis, tmp_path))
    assert diagnosis.text in text
    assert "only 12 periods" in text
    assert "stribeck friction at the knee" in text
    assert "knee.stribeck_friction_speed 0.3 0.01 rad/s" in text
    assert "size is 3.7 % of torque" in text
    assert "explain 97 %" in text
    assert "nonlinear_viscous_friction at knee (overlap 0.93)" in text
    # held out: 1 - 0.06 / 0.3
    assert "80 % of the gap closed on held-out data" in text
    assert "2.6 times better" in text
    assert "stribeck_friction (speed 0.1 rad/s, exponent 2) hip 0.15 N m 90" in text
    assert "backlash hip 0.002 rad 30 spring_offset at hip, asymmetric_spring" in text
    assert "0.1 % of the torque: an unmodelled remainder" in text


def test_a_straight_course_is_called_so_and_has_no_time(diagnosis, tmp_path):
    (found,) = diagnosis.missing
    rate = MissingParameter("knee.friction_drift_coulomb", 0.6, 0.02, "N m/min")
    mark = MissingParameter("knee.friction_drift_time_constant", 6e4, 0.0, "s")
    for time, told in ((mark, "none: the course is straight"), (replace(mark, value=60.0, std=9.0), "60 +- 9 s")):
        drifts = replace(diagnosis, missing=(replace(found, effect="friction_drift", parameters=(rate, time)),))
        assert f"    {mark.name} {told}" in drifts.summary().splitlines()
        assert f"{mark.name} {told.replace('+- ', '')}" in words(page_of(drifts, tmp_path))
        written = drifts.to_dict()["missing"][0]["parameters"][1]
        assert written == {"name": mark.name, "value": time.value, "std": time.std, "unit": "s"}
    assert "none: the course" not in str(replace(mark, name="knee.stribeck_friction_speed"))


def test_the_page_says_what_would_make_an_amount_known_less(diagnosis, tmp_path):
    (found,) = diagnosis.missing
    there = Unseen("encoder_offset", "knee", (replace(found.parameters[0], std=0.3),))
    diagnosis = replace(diagnosis, missing=(replace(found, unseen=there),))
    told = (
        "It is known so well only without encoder_offset at knee, which would hardly show beside it: with one, "
        "knee.stribeck_friction 0.6 +- 0.3 N m."
    )
    assert told in words(page_of(diagnosis, tmp_path))


def test_what_drifts_has_a_gap_from_period_to_period_and_none_in_the_mean(diagnosis, leg_model, tmp_path):
    drift = FrictionDrift("knee", reference=40.0)
    found = replace(diagnosis.missing[0], effect=drift.name, joint="knee", detail=drift, alternatives=())
    gaps = {
        "training": Gap({"hip": 0.0, "knee": 0.5}, {"hip": 0.0, "knee": 0.05}, {"hip": 0.02, "knee": 0.03}),
        "holdout": Gap({"hip": 0.0, "knee": 0.4}, {"hip": 0.0, "knee": 0.1}, {"hip": 0.02, "knee": 0.03}),
    }
    term = TrendTerm(drift, (0.0, -0.2), (0.1, 0.01))
    model = replace(leg_model, trends=(term,))
    same = {"hip": 0.0, "knee": 0.4}
    unlike = Gap(same, same, {"hip": 0.1, "knee": 0.1})
    drifts = replace(diagnosis, missing=(found,), trend_gap=gaps, model=model, holdout=unlike)
    assert not drifts.adds_to_held_out
    text = words(page_of(drifts, tmp_path))
    assert "What is named changes in the course of the recording, and the mean of its periods hides it." in text
    assert "90 % of what changes from period to period explained" in text
    assert "From period to period, on data that were held out" in text
    assert "As if it began at the same time: 75 % of the gap is closed." in text
    assert term.summary(model.robot) in text
    assert "% of the gap closed on the recording" not in text
    told = (
        "from period to period, held out: hip within the noise (noise 0.02), knee 0.4 -> 0.1 (noise 0.03); shrink 0.75"
    )
    assert told in drifts.summary()
    drifts.save(tmp_path / "found.json")
    assert read_diagnosis(tmp_path / "found.json").trend_gap["holdout"].shrink == pytest.approx(0.75)
    # in the mean of a motion that was held out it is another
    assert "of the gap closed on held-out data" not in text
    elsewhere = replace(drifts, holdout=gaps["holdout"])
    assert elsewhere.adds_to_held_out
    there = words(page_of(elsewhere, tmp_path))
    assert "75 % of the gap closed on held-out data" in there
    assert "% of the gap closed on the recording" not in there
    # beside what is in the mean both are told
    both = replace(drifts, missing=(found, diagnosis.missing[0]))
    assert both.adds_to_mean
    assert "% of the gap closed on the recording" in words(page_of(both, tmp_path))


def test_what_was_held_has_no_standard_deviation(diagnosis, tmp_path):
    (found,) = diagnosis.missing
    size, speed = found.parameters
    found = replace(found, parameters=(size, replace(speed, std=0.0)))
    diagnosis = replace(diagnosis, missing=(found,))
    assert "knee.stribeck_friction_speed 0.3 held rad/s" in words(page_of(diagnosis, tmp_path))
    lines = [line.strip() for line in diagnosis.summary().splitlines()]
    assert "knee.stribeck_friction 0.6 +- 0.02 N m" in lines
    assert "knee.stribeck_friction_speed 0.3 rad/s, held" in lines


def test_a_diagnosis_read_from_its_file_gives_the_same_page(diagnosis, tmp_path):
    diagnosis.save(tmp_path / "d.json")
    again = read_diagnosis(tmp_path / "d.json")
    assert words(page_of(again, tmp_path)) == words(page_of(diagnosis, tmp_path))


def test_with_the_repaired_model_its_sections_follow(diagnosis, leg_model, tmp_path):
    page = page_of(replace(diagnosis, model=leg_model), tmp_path)
    order = re.findall(r'<section id="(\w+)"', page)
    assert order[:5] == ["verdict", "gap", "missing", "locations", "detectability"]
    assert {"parameters", "robot_motion", "torque"} <= set(order)
    assert "exo_leg: what the model lacks" in page


@pytest.mark.parametrize(("p_value", "complete"), [(1e-4, False), (0.01, True)])
def test_the_page_calls_nothing_complete_beside_a_lack_of_fit(p_value, complete, tmp_path):
    none = Diagnosis(Verdict.NONE, "A sentence.", LackOfFit(0.0, 1, p_value, 1.0, {}))
    page = page_of(none, tmp_path)
    assert ("othing is missing" in page) is complete
    assert ("othing is named" in page) is not complete


def test_one_stretch_is_said_to_give_hints_and_no_test(tmp_path):
    untested = LackOfFit(0.0, 0, 1.0, 1.0, {"hip": {}})
    bare = Diagnosis(Verdict.NAMED_WITH_REMAINDER, "A sentence.", untested)
    page = page_of(bare, tmp_path)
    assert "ere are hints at what is missing" in page
    assert "something small is left" not in page
    assert "Not tested" in page
    assert "by noise alone" not in page


@pytest.mark.parametrize("verdict", list(Verdict))
def test_every_verdict_has_a_page_even_with_nothing_else(verdict, tmp_path):
    bare = Diagnosis(verdict, "A sentence.", LackOfFit(0.0, 1, 1.0, 1.0, {}))
    page = page_of(bare, tmp_path)
    assert MEANING[verdict][1][1:] in page
    assert "A sentence." in page
    assert re.findall(r'<section id="(\w+)"', page) == ["verdict"]


def test_the_curve_of_friction_is_drawn_over_velocity(diagnosis):
    chart = curve(diagnosis.missing[0], diagnosis.waveforms, diagnosis.units)
    assert chart.x_label == "motor velocity of the knee [rad/s]"
    line = chart.marks[1]
    expected = 0.6 * np.sign(line.x) * np.exp(-((line.x / SPEED) ** 2))
    away = np.abs(line.x) > 0.05
    np.testing.assert_allclose(line.y[away], expected[away], atol=0.03)
    # the dots are what the final model leaves plus the effect
    np.testing.assert_allclose(chart.marks[0].y, diagnosis.waveforms.before[:, 2])


def test_an_effect_that_follows_no_state_is_drawn_over_time(diagnosis):
    waves = diagnosis.waveforms
    pulse = np.zeros((400, 6))
    pulse[150:180, 1] = 1.0
    pushed = replace(waves, explained={"external_force at hip": pulse})
    effect = MissingEffect("external_force", "hip", (), 0.1, 1e-9, ())
    assert curve(effect, pushed, diagnosis.units).x_label == "time [s]"


def test_what_depends_on_more_than_one_quantity_is_a_curve_over_time_with_its_band(diagnosis):
    waves = diagnosis.waveforms
    both = np.zeros((400, 6))
    both[:, 2] = 0.3 * np.sign(waves.dtheta[:, 1]) * np.abs(np.sin(7.0 * waves.time))
    band = np.full((400, 6), 0.05)
    label = "load_dependent_friction at knee"
    waves = replace(waves, explained={label: both}, bands={label: band})
    chart = curve(MissingEffect("load_dependent_friction", "knee", (), 0.1, 1e-9, ()), waves, {})
    assert chart.x_label == "time [s]"
    (line,) = (mark for mark in chart.marks if isinstance(mark, Line))
    (around,) = (mark for mark in chart.marks if isinstance(mark, Band))
    np.testing.assert_allclose(line.y, both[:, 2])
    np.testing.assert_allclose(around.upper - around.lower, 4.0 * 0.05)


def test_two_of_a_kind_at_one_joint_have_a_curve_each_under_a_heading_of_their_own(diagnosis, tmp_path):
    waves, ripples = diagnosis.waveforms, [make_effect("torque_ripple", "knee", number=number) for number in (1, 2)]
    explained = {ripple.title: np.zeros((400, 6)) for ripple in ripples}
    for size, values in zip((1.0, 3.0), explained.values(), strict=True):
        values[:, 2] = size * np.sin(4.0 * waves.q[:, 1])
    missing = tuple(MissingEffect("torque_ripple", "knee", (), 0.1, 1e-9, (), detail=ripple) for ripple in ripples)
    found = replace(diagnosis, missing=missing, waveforms=replace(waves, explained=explained))
    sizes = [np.abs(curve(each, found.waveforms, {}).marks[-1].y).max() for each in missing]
    assert sizes[1] / sizes[0] == pytest.approx(3.0)
    page = page_of(found, tmp_path)
    for heading in ("torque ripple at the knee", "torque ripple 2 at the knee"):
        assert heading in page


def test_a_ripple_is_drawn_over_the_position_of_its_motor_where_the_spring_bends(diagnosis):
    waves, ripple = diagnosis.waveforms, make_effect("torque_ripple", "knee")
    bent = 0.05 * np.sin(11.0 * waves.time)[:, None] * np.ones((1, 3))
    torque = np.zeros((400, 6))
    missing = MissingEffect("torque_ripple", "knee", (), 0.1, 1e-9, (), detail=ripple)
    for deflection, label in ((bent, "motor position of the knee [rad]"), (0.0 * bent, "position of the knee [rad]")):
        torque[:, 2] = np.sin(30.0 * (waves.q + deflection)[:, 1])
        seen = replace(waves, deflection=deflection, explained={ripple.title: torque})
        assert curve(missing, seen, diagnosis.units).x_label == label


def test_a_sliding_joint_has_its_own_units(diagnosis, tmp_path):
    slides = replace(diagnosis, units={"hip": "N m", "knee": "N", "ankle": "N m"})
    chart = curve(slides.missing[0], slides.waveforms, slides.units)
    assert chart.x_label == "motor velocity of the knee [m/s]"
    assert chart.y_label == "force [N], knee motor"
    summary = slides.summary()
    assert "gap, training: hip" in summary
    assert re.search(r"hip [^,]*\(noise \S+ N m\), knee [^,]*\(noise \S+ N\), ankle", summary)
    assert re.search(r"forward simulation of q: hip [^,]*\(noise \S+ rad\), knee [^,]*\(noise \S+ m\), ankle", summary)
    assert "gap [N m], training" in diagnosis.summary()
    assert "gap [rad], forward simulation of q" in diagnosis.summary()
    page = page_of(diagnosis, tmp_path)
    for text in ("N m or N", "rad or m", "rad or mm"):
        assert text not in page
    page = page_of(slides, tmp_path)
    # what is over all joints says both, what is of one its own
    assert set(re.findall(r">([^<>]*N m or N|[^<>]*rad or mm)<", page)) == {"N m or N", "mrad or mm"}
    assert re.findall(r"(hip|knee), noise: \S+ (.*?)<", page)[:2] == [("hip", "N m"), ("knee", "N")]
    assert "near reversal 0.41 N 88" in words(page)
    assert "time 0 to 1.25 s 0.02 N m 6.2" in words(page)
    diagnosis.save(tmp_path / "d.json")
    assert read_diagnosis(tmp_path / "d.json").units == diagnosis.units


def test_bars_are_as_high_as_their_values():
    svg = bars(["a", "b"], {"before": [4.0, 2.0], "after": [1.0, 0.0]}, ["before", "after"], "t", ["N m", "N m"])
    root = ElementTree.fromstring(svg)
    rectangles = [e for e in root.iter("rect")]
    heights = [float(e.attrib["height"]) for e in rectangles]
    assert heights[1] == pytest.approx(heights[0] / 4, abs=0.1)
    assert heights[2] == pytest.approx(heights[0] / 2, abs=0.1)
    assert json.dumps([e.find("title").text for e in rectangles]).count("N m") == 4


def test_where_nothing_is_missing_no_share_of_a_gap_is_told(diagnosis, tmp_path):
    """0 % closed would read as a failure where there was nothing to add."""
    nothing = replace(diagnosis, verdict=Verdict.NONE, missing=(), text="Nothing is missing.", simulation_gap={})
    path = tmp_path / "r.html"
    write_report(nothing, path)
    text = path.read_text(encoding="utf-8")
    assert "of the gap closed" not in text
    assert "% of the gap is closed" not in text
    assert "nothing was added" in text


def test_what_changed_against_a_reference_is_in_the_model_already(diagnosis, tmp_path):
    changed = replace(diagnosis, verdict=Verdict.ONLY_AGAINST_REFERENCE, simulation_gap={})
    path = tmp_path / "r.html"
    write_report(changed, path)
    text = path.read_text(encoding="utf-8")
    assert "against the reference" in text
    assert "effects missing" not in text
    assert "of the gap closed" not in text
    assert "% of the gap is closed" not in text
