"""Large errors of encoders: a model without them bends its springs, and the way back begins at the description."""

import re

import pytest

from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.settle import settle
from sea_ident.discrepancy.compared.decide import simplest_first
from sea_ident.discrepancy.evidence.assess import rivals
from sea_ident.discrepancy.evidence.named import named_effects
from sea_ident.discrepancy.measured.data import period_data, wide_processing
from sea_ident.discrepancy.search.described import begin_as_described, from_described_springs
from sea_ident.discrepancy.search.refit import refitted
from sea_ident.discrepancy.search.search import search
from sea_ident.effects import base_effects, make_effect, spring_effects
from sea_ident.robot import load_robot

pytestmark = pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")

LARGE = {
    "encoder_offset": {"offset": 0.08},
    "encoder_eccentricity": {"sine": 0.05, "cosine": 0.05},
    "position_delay": {"delay": 0.02},
}


@pytest.fixture(scope="module")
def softer(leg, tmp_path_factory):
    """The leg by a description that makes its springs a quarter too soft."""
    text, times = re.subn(r'(stiffness|cubicStiffness)="([^"]+)"', lambda m: f'{m[1]}="{0.75 * float(m[2])}"', leg.urdf)
    assert times == 6, times
    file = tmp_path_factory.mktemp("softer") / "softer.urdf"
    file.write_text(text)
    return load_robot(file)


def recorded_as(laboratory, robot, effect, joint, shape):
    """A recording of the leg with an error, on the bench of a robot that describes it."""
    recording = laboratory.record([(effect, joint, [], shape)], periods=6)
    data = period_data(wide_processing(recording, robot, 5.0), robot)
    return Bench(data, (*base_effects(robot), *spring_effects(robot)))


@pytest.mark.scenario
@pytest.mark.parametrize("effect", list(LARGE))
def test_amounts_begin_right_with_springs_that_are_described_wrong(laboratory, softer, effect):
    bench = recorded_as(laboratory, softer, effect, "ankle", LARGE[effect])
    begun = begin_as_described(bench, bench.effects, make_effect(effect, "ankle"), ())
    for name, value in LARGE[effect].items():
        assert getattr(begun.effect, name) == pytest.approx(value, rel=0.03)
    assert begun.parameters["ankle.spring_stiffness"] == pytest.approx(120.0, rel=0.1)


@pytest.mark.scenario
@pytest.mark.parametrize(("effect", "joint"), [("encoder_eccentricity", "ankle"), ("encoder_offset", "hip")])
def test_a_large_error_of_an_encoder_is_found(laboratory, effect, joint):
    bench = laboratory.bench(laboratory.record([(effect, joint, [], LARGE[effect])], periods=6))
    found = search(bench, bench.effects)
    assert [(e.name, e.joint) for e in found.effects] == [(effect, joint)]
    for name, value in LARGE[effect].items():
        assert getattr(found.effects[0], name) == pytest.approx(value, rel=0.01)
    assert found.final.fit.statistic < 1.2 * found.final.fit.dof


@pytest.mark.scenario
def test_what_is_far_above_what_is_of_interest_is_not_begun_again(laboratory, monkeypatch):
    bench = laboratory.bench(laboratory.record([("encoder_offset", "hip", [], LARGE["encoder_offset"])], periods=6))
    start = settle(bench, bench.effects)
    begun = bench.anchored((*start.fit.effects, make_effect("encoder_offset", "hip")), start.fit.parameters)
    wrong = bench.fit(begun, start.noise, start=start.fit.parameters)
    position, parameters = len(bench.effects), start.fit.parameters
    right = from_described_springs(bench, wrong, position, start.noise, parameters, wrong.statistic / 10.0)
    assert right.effects[-1].offset == pytest.approx(LARGE["encoder_offset"]["offset"], rel=0.05)
    monkeypatch.setattr(
        "sea_ident.discrepancy.search.described.begin_as_described", lambda *_: pytest.fail("begun again")
    )
    assert from_described_springs(bench, wrong, position, start.noise, parameters, wrong.statistic / 100.0) is wrong


ERRORS = [*LARGE.items(), ("position_delay", {"delay": 0.005})]
JOINTS = ["hip", "knee", "ankle"]
EVERYWHERE = [
    pytest.param(effect, shape, joint, (k // 2 + i + 1) % 2, id="-".join([effect, *map(str, shape.values()), joint]))
    for k, (effect, shape) in enumerate(ERRORS)
    for i, joint in enumerate(JOINTS)
]
"""Every error at every joint, each error and each joint on either motion, and none that another test searches for."""


@pytest.mark.slow
@pytest.mark.parametrize(("effect", "shape", "joint", "motion"), EVERYWHERE)
def test_large_errors_of_encoders_are_found_at_every_joint(laboratory, effect, shape, joint, motion):
    """Alone, of all that is as good the simplest, with its value: a wrong zero of the last encoder is as good as a
    spring with hysteresis that never turns back, and the same as a zero of its motor that is off the other way."""
    recording = laboratory.record([(effect, joint, [], shape)], periods=6, motion=motion)
    bench = laboratory.bench(recording)
    searched = search(bench, bench.effects)
    found, _ = simplest_first(bench, searched, rivals(bench, searched))
    (there,) = found.effects
    of_motor = (effect, joint, there.name) == ("encoder_offset", "ankle", "motor_encoder_offset")
    assert (there.name, there.joint) == ("motor_encoder_offset" if of_motor else effect, joint)
    (told,) = named_effects(bench, found, {}, None)
    values = {p.name: p for p in told.parameters}
    assert len(values) == len(shape)
    for name, size in shape.items():
        value = -size if of_motor else size
        own = values[f"{joint}.{there.name}_{name}"]
        # friction near reversals differs from pass to pass and has another mean in six of them: at the hip, which
        # carries most, values of other seeds scatter by 2.7 times what is stated (1.6 where friction repeats itself)
        assert abs(own.value - value) < max(4.0 * own.std, 0.005 * size)
        assert own.std < 0.01 * size


@pytest.mark.scenario
def test_the_wrong_side_of_zero_is_left_for_the_right_one(laboratory):
    bench = laboratory.bench(laboratory.record([("encoder_offset", "ankle", [], {"offset": 0.08})], periods=6))
    now = settle(bench, bench.effects)
    wrong = make_effect("encoder_offset", "ankle", offset=-0.07)
    new = refitted(bench, now.fit.effects, wrong, (), now.noise, now.fit.parameters)
    assert new.effects[-1].offset == pytest.approx(0.08, rel=0.01)


def test_no_beginning_without_a_spring_that_is_described(laboratory, leg, tmp_path):
    file = tmp_path / "unknown.urdf"
    file.write_text(leg.urdf.replace('stiffness="120" cubicStiffness="4000" damping="0.25"', ""))
    bench = recorded_as(laboratory, load_robot(file), "encoder_offset", "knee", {"offset": 0.03})
    assert begin_as_described(bench, bench.effects, make_effect("encoder_offset", "ankle"), ()) is None
    begun = begin_as_described(bench, bench.effects, make_effect("encoder_offset", "knee"), ())
    assert begun.effect.offset == pytest.approx(0.03, rel=0.1)
