"""Two wrong zeros of a joint that are one are told as one."""

import warnings

import numpy as np
import pytest

from sea_ident.discrepancy import diagnose
from sea_ident.discrepancy.bench.settle import Settled, settle, settle_again
from sea_ident.discrepancy.search.one_for_two import one_for_two
from sea_ident.discrepancy.search.one_zero import one_zero
from sea_ident.effects import make_effect
from sea_ident.estimation import identify
from sea_ident.exceptions import SeaIdentWarning

ZERO = 0.05


def shown(recording, joint, **zeros):
    """A recording of a joint whose q and theta are off by so much."""
    return recording.replace_columns({f"{k}_{joint}": recording.columns[f"{k}_{joint}"] + z for k, z in zeros.items()})


def fitted(laboratory, recording, *added):
    """Bench, and the leg with some wrong zeros fitted."""
    bench = laboratory.bench(recording)
    start = settle(bench, bench.effects)
    effects = (*start.fit.effects, *added)
    now = settle_again(bench, bench.refine(effects, start.noise, start=start.fit.parameters, only=len(bench.effects)))
    return bench, settle_again(bench, now.fit)


def zero(name, joint="knee", offset=ZERO):
    return make_effect(name, joint, offset=offset)


@pytest.mark.scenario
@pytest.mark.parametrize(
    ("truth", "joint", "pair", "single", "size"),
    [
        ({"q": ZERO}, "knee", ("motor_encoder_offset", "joint_offset"), "encoder_offset", ZERO),
        ({"theta": ZERO}, "knee", ("encoder_offset", "joint_offset"), "motor_encoder_offset", ZERO),
        ({"q": ZERO, "theta": ZERO}, "knee", ("encoder_offset", "motor_encoder_offset"), "joint_offset", ZERO),
        ({"q": ZERO}, "hip", ("motor_encoder_offset", "base_tilt"), "encoder_offset", ZERO),
        ({"theta": ZERO}, "hip", ("encoder_offset", "base_tilt"), "motor_encoder_offset", ZERO),
    ],
)
def test_two_that_are_one(laboratory, truth, joint, pair, single, size):
    sizes = {"encoder_offset": -size, "motor_encoder_offset": -size, "joint_offset": size}
    if truth.keys() == {"q", "theta"}:
        sizes = dict.fromkeys(sizes, size)
    recording = shown(laboratory.record(), joint, **truth)
    added = [make_effect(name) if name == "base_tilt" else zero(name, joint, sizes[name]) for name in pair]
    bench, now = fitted(laboratory, recording, *added)
    assert now.fit.statistic < 1.5 * now.fit.dof
    after, left = one_for_two(bench, now, 2)
    assert left == [0]
    (found,) = after.fit.effects[len(bench.effects) :]
    assert (found.name, found.joint) == (single, joint)
    assert found.offset == pytest.approx(size, abs=1e-3)
    assert after.fit.statistic < now.fit.statistic + 20.0 * now.fit.unit


@pytest.mark.scenario
def test_two_that_are_two_stay(laboratory):
    recording = shown(laboratory.record(), "knee", q=0.05, theta=-0.02)
    bench, now = fitted(laboratory, recording, zero("encoder_offset"), zero("motor_encoder_offset", offset=-0.02))
    after, left = one_for_two(bench, now, 2)
    assert after is now
    assert left == [0, 1]
    names = [effect.offset for effect in after.fit.effects[len(bench.effects) :]]
    assert names == pytest.approx([0.05, -0.02], abs=1e-3)


@pytest.mark.parametrize(
    "pair",
    [
        (("encoder_offset", "hip"), ("joint_offset", "knee")),
        (("motor_encoder_offset", "knee"), ("base_tilt", None)),
        (("joint_offset", "knee"), ("base_tilt", None)),
        (("torque_offset", "knee"), ("base_tilt", None)),
        (("torque_offset", "knee"), ("encoder_offset", "knee")),
    ],
)
def test_what_is_not_of_one_joint_is_left(nothing_missing, pair):
    """Gravity turns with the first joint only."""
    bench, start = nothing_missing
    effects = tuple(make_effect(name, joint) for name, joint in pair)
    assert one_zero(bench, *effects, start.fit.parameters) is None
    fit = bench.predicted((*start.fit.effects, *effects), start.fit.parameters)
    now = Settled(fit, start.noise)
    after, left = one_for_two(bench, now, 2)
    assert after is now
    assert left == [0, 1]


@pytest.mark.scenario
@pytest.mark.parametrize(("offset", "shrink"), [(0.05, 0.4), (-0.3, 0.8)])
def test_a_joint_that_is_off_with_both_encoders_is_named(laboratory, leg, offset, shrink):
    """It was not in the library, or a force, with what was left."""
    both = {kind: offset for kind in ("q", "theta")}
    recording, holdout = (
        shown(laboratory.record(periods=p, seed=s, motion=m), "knee", **both) for p, s, m in ((10, 3, 0), (6, 7, 1))
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        found = diagnose(identify(leg, recording, period=5.0), recording, holdout=holdout)
    assert found.verdict == "named"
    (missing,) = found.missing
    assert (missing.effect, missing.joint) == ("joint_offset", "knee")
    assert missing.parameters[0].value == pytest.approx(offset, abs=3.0 * missing.parameters[0].std)
    assert found.holdout.shrink > shrink
    assert found.simulation_gap["q"].shrink > 0.5


def test_the_first_and_the_last_joint_have_no_zero_of_their_own(leg):
    """The one is a tilt of the base, the other one turns a body that is free."""
    assert [e.joint for e in type(make_effect("joint_offset", "knee")).instances(leg)] == ["knee"]
    assert np.isclose(make_effect("joint_offset", "knee", offset=0.2).offset, 0.2)
