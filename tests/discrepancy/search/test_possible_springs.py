"""A spring that no spring can be stands in for what a model lacks, and is not taken for an answer."""

import warnings
from types import SimpleNamespace

import numpy as np
import pytest

from sea_ident.discrepancy import diagnose
from sea_ident.discrepancy.bench.settle import settle
from sea_ident.discrepancy.search.possible_springs import (
    begun_with_zeros,
    impossible_springs,
    left_without_cubic,
    without_cubic,
)
from sea_ident.effects.motor_encoder_offset import MotorEncoderOffset
from sea_ident.effects.spring_stiffening import SpringStiffening
from sea_ident.estimation import identify
from sea_ident.exceptions import SeaIdentWarning
from sea_ident.simulation import SensorNoise


def zeros_apart(laboratory, offset, step, periods):
    """The ankle's encoder reads a little too much, by steps that repeat in every period."""
    sensors = SensorNoise(3e-5, 5e-6, link_resolution=step, motor_resolution=2.4e-5)
    return laboratory.record([("encoder_offset", "ankle", [], {"offset": offset})], sensors=sensors, periods=periods)


@pytest.mark.scenario
def test_a_stiffness_below_zero_beyond_doubt_is_impossible(laboratory):
    bench = laboratory.bench(zeros_apart(laboratory, 0.02, 1e-5, 8))
    fit = settle(bench, bench.effects).fit
    assert fit.parameters["ankle.spring_stiffness"] < 0.0
    assert impossible_springs(bench, fit) == {"ankle": fit.parameters["ankle.spring_stiffness"]}
    less = without_cubic(bench, ["ankle"])
    gone = set(bench.effects) - set(less.effects)
    assert gone == {SpringStiffening("ankle")}
    assert len(less.effects) == len(bench.effects) - 1
    # where there is no cubic term, none stands in for anything
    assert impossible_springs(less, settle(less, less.effects).fit) == {}


def test_springs_that_can_be_are_left_as_they_are(nothing_missing, leg):
    bench, now = nothing_missing
    assert impossible_springs(bench, now.fit) == {}
    (text,) = left_without_cubic(leg, {"ankle": -123.4})
    assert text.startswith("spring of ankle: with its cubic term its stiffness comes out as -123 N m/rad, which no")


@pytest.mark.parametrize(("stiffness", "impossible"), [(-6.0, True), (-4.0, False), (4.0, False)])
def test_a_stiffness_that_is_hardly_known_may_be_below_zero(nothing_missing, stiffness, impossible):
    bench, _ = nothing_missing
    name = "ankle.spring_stiffness"
    fit = SimpleNamespace(
        columns=(SimpleNamespace(name=name),), parameters={name: stiffness}, covariance_factor=np.array([[0.6, 0.8]])
    )
    assert impossible_springs(bench, fit) == ({"ankle": stiffness} if impossible else {})


@pytest.mark.scenario
@pytest.mark.parametrize(("offset", "step"), [(-0.03, 1.2e-3), (0.03, 1.2e-3)])
def test_another_zero_is_found_though_the_steps_of_the_encoder_let_the_spring_bend_to_it(laboratory, leg, offset, step):
    """It was told as nothing missing, or as a spring of another power, with confidence.

    At the last joint another zero of the link's encoder turns its body, which is free, and is one of the motor's then.
    """
    recording = zeros_apart(laboratory, offset, step, 10)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        found = diagnose(identify(leg, recording, period=5.0), recording)
    (missing,) = found.missing
    assert found.verdict == "ambiguous"
    assert missing.joint == "ankle"
    assert {missing.effect, missing.alternatives[0].effect} == {"encoder_offset", "motor_encoder_offset"}
    (spring,) = [spring for spring in found.model.springs if spring.joint == "ankle"]
    assert spring.stiffness == pytest.approx(leg.spring("ankle").stiffness, rel=0.1)
    sign = -1.0 if missing.effect == "motor_encoder_offset" else 1.0
    assert sign * missing.parameters[0].value == pytest.approx(offset, rel=0.02)


@pytest.mark.scenario
@pytest.mark.parametrize(("joint", "zero"), [("hip", 0.02), ("hip", 0.1), ("knee", -0.4), ("ankle", 0.2)])
def test_another_zero_of_a_motor_encoder_is_named_however_far_it_is(laboratory, leg, joint, zero):
    """It was play with confidence, a spring of another power beside a constant, or not in the library."""
    recording = laboratory.record(periods=10)
    shown = recording.replace_columns({f"theta_{joint}": recording.columns[f"theta_{joint}"] + zero})
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        found = diagnose(identify(leg, shown, period=5.0), shown)
    (missing,) = found.missing
    assert (missing.effect, missing.joint) == ("motor_encoder_offset", joint)
    (offset,) = missing.parameters
    assert offset.value == pytest.approx(zero, abs=3.0 * offset.std)
    assert offset.std < 0.02 * abs(zero)
    (spring,) = [spring for spring in found.model.springs if spring.joint == joint]
    assert spring.stiffness == pytest.approx(leg.spring(joint).stiffness, rel=0.05)


@pytest.mark.scenario
def test_zeros_that_the_model_was_not_identified_with_are_found(laboratory, leg):
    """Encoders that were switched on anew since: the model is right, and the recording is not its own."""
    recording, later = laboratory.record(periods=10), laboratory.record(periods=10, seed=11)
    zeros = {"hip": 0.3, "knee": -0.2}
    shown = later.replace_columns({f"theta_{j}": later.columns[f"theta_{j}"] + z for j, z in zeros.items()})
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        found = diagnose(identify(leg, recording, period=5.0), shown)
    assert {m.joint: m.effect for m in found.missing} == dict.fromkeys(zeros, "motor_encoder_offset")
    for missing in found.missing:
        assert missing.parameters[0].value == pytest.approx(zeros[missing.joint], abs=1e-3)


@pytest.mark.scenario
@pytest.mark.parametrize("offset", [3.0, -3.0])
def test_a_constant_torque_that_cancels_the_load_is_not_taken_for_a_wrong_zero(prosthesis, offset):
    """Both springs were lost in it, and an eccentric encoder was named with confidence."""
    planted = [("torque_offset", "knee", [offset], {})]
    recording = prosthesis.record(planted, periods=10)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        found = diagnose(identify(prosthesis.leg, recording, period=5.0), recording)
    (missing,) = found.missing
    declared = {(missing.effect, missing.joint), *((a.effect, a.joint) for a in missing.alternatives)}
    assert ("torque_offset", "knee") in declared
    for one, other in zip(found.model.springs, prosthesis.leg.elastic_indices, strict=True):
        described = prosthesis.leg.joints[int(other)].actuator.stiffness
        assert one.stiffness == pytest.approx(described, abs=4.0 * one.stiffness_std)
    if missing.effect == "torque_offset":
        (size,) = missing.parameters
        assert size.value == pytest.approx(offset, abs=3.0 * size.std)


@pytest.mark.scenario
@pytest.mark.parametrize(
    ("name", "values", "shape", "begun_at"),
    [("torque_offset", [3.0], {}, -0.015), ("motor_encoder_offset", [], {"offset": 0.05}, 0.04)],
)
def test_a_search_begins_with_a_zero_or_with_a_constant_that_explains_more(prosthesis, name, values, shape, begun_at):
    bench = prosthesis.bench(prosthesis.record([(name, "knee", values, shape)], periods=10))
    begun = begun_with_zeros(bench, [MotorEncoderOffset("knee", offset=begun_at)])
    (effect,) = begun.effects
    assert (effect.name, effect.joint) == (name, "knee")
    assert begun.final.fit.statistic < 1.5 * begun.final.fit.dof
