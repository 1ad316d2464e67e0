"""A constant in a spring with dry friction: where that rests, unless another motion finds the same one."""

from dataclasses import replace

import numpy as np
import pytest

import sea_ident
from sea_ident.discrepancy.bench.settle import settle
from sea_ident.discrepancy.compared.heldout import Kind, tried
from sea_ident.discrepancy.compared.resting import resting, with_constants_at_rest
from sea_ident.discrepancy.result.findings import Alternative
from sea_ident.discrepancy.search.search import Selection
from sea_ident.effects import make_effect
from sea_ident.exceptions import SeaIdentWarning

JOINT = "knee"
HERE, THERE = -0.5, -0.15
AMOUNTS, SLIP = [0.3, 0.6], 0.002


@pytest.fixture(scope="module")
def upright(laboratory, series):
    """The leg swings about the vertical: springs are deflected to either side, and a constant in them is seen."""
    return replace(laboratory, motions=tuple(replace(each, offset=np.zeros_like(each.offset)) for each in series))


def recorded(upright, value, motion, joint=JOINT, amounts=AMOUNTS, slip=SLIP):
    """A spring with dry friction, and a constant torque."""
    planted = [("spring_hysteresis", joint, amounts, {"slip": slip}), ("spring_offset", joint, [value], {})]
    return upright.record(planted, periods=10, motion=motion, seed=5 + motion)


@pytest.fixture(scope="module")
def here(upright):
    return recorded(upright, HERE, 0)


@pytest.fixture(scope="module")
def used(upright, here):
    return upright.bench(here)


@pytest.fixture(scope="module")
def there(upright):
    """The other motion, on which the friction rests at another constant."""
    return recorded(upright, THERE, 1)


def found(bench, name, friction=JOINT):
    """What a search would have found, a constant first."""
    start = settle(bench, bench.effects)
    more = (make_effect(name, JOINT), make_effect("spring_hysteresis", friction, slip=SLIP))
    return Selection(start, settle(bench, (*bench.effects, *more)), 2, (1e-9, 1e-9))


def on(bench, selection):
    """What it is worth on another motion."""
    return replace(tried(bench, selection, "another motion"), kind=Kind.OTHER_MOTION)


def names(selection):
    return [effect.name for effect in selection.effects]


@pytest.fixture(scope="module")
def called_an_encoder(used):
    return found(used, "encoder_offset")


@pytest.mark.scenario
def test_what_is_called_an_offset_of_an_encoder_is_where_the_friction_rests(upright, used, called_an_encoder, there):
    position, held = len(used.effects), on(upright.bench(there), called_an_encoder)
    assert not held.transfers[0].tested
    alternatives = {position: (Alternative("spring_offset", JOINT, 1.0),), position + 1: ()}
    now, left, again = with_constants_at_rest(used, called_an_encoder, alternatives, held)
    assert names(now) == ["spring_offset", "spring_hysteresis"]
    assert left == {position + 1: ()}
    assert resting(now, again) == (0,)
    # there it rests at a constant of its own, and what is left is noise
    assert again.transfers[1].remembers
    assert again.transfers[1].holds
    assert again.transfers[1].excess < 100.0 * again.transfers[1].unit
    fit, place = now.final.fit, sum(used.counts(now.final.fit.effects)[:position])
    assert abs(fit.values[place] - HERE) < 4.0 * fit.std(place)


@pytest.mark.scenario
def test_what_is_called_so_and_is_the_same_on_the_other_motion_is_an_effect(upright, used, called_an_encoder):
    position = len(used.effects)
    held = on(upright.bench(recorded(upright, HERE, 1)), called_an_encoder)
    alternatives = {position: (Alternative("spring_offset", JOINT, 1.0),), position + 1: ()}
    now, left, again = with_constants_at_rest(used, called_an_encoder, alternatives, held)
    assert names(now) == ["spring_offset", "spring_hysteresis"]
    assert [(a.effect, a.joint) for a in left[position]] == [("encoder_offset", JOINT)]
    assert resting(now, again) == ()
    # the same motion once more is no other one
    assert resting(now, replace(again, kind=Kind.OTHER_PERIODS)) == (0,)
    assert resting(now, None) == (0,)


@pytest.mark.scenario
def test_what_is_no_constant_of_that_spring_stays(upright, used, called_an_encoder, there):
    position, held = len(used.effects), on(upright.bench(there), called_an_encoder)
    for other in ("backlash", JOINT), ("spring_offset", "hip"):
        alternatives = {position: (Alternative(*other, 1.0),)}
        same = with_constants_at_rest(used, called_an_encoder, alternatives, held)
        assert same == (called_an_encoder, alternatives, held)
    assert resting(called_an_encoder, held) == ()
    assert resting(found(used, "spring_offset", friction="hip"), None) == ()


@pytest.mark.parametrize(
    ("joint", "amounts", "slip"),
    [
        pytest.param(JOINT, AMOUNTS, SLIP, marks=pytest.mark.scenario),
        pytest.param("hip", [1.0, 3.0], 0.0005, marks=pytest.mark.scenario),
        pytest.param(JOINT, AMOUNTS, 0.0005, marks=pytest.mark.slow),
        pytest.param("hip", [1.0, 3.0], SLIP, marks=pytest.mark.slow),
    ],
)
def test_a_diagnosis_names_the_friction_and_says_where_it_rests(upright, joint, amounts, slip):
    here, there = (recorded(upright, value, k, joint, amounts, slip) for k, value in enumerate((HERE, THERE)))
    with pytest.warns(SeaIdentWarning, match=f"spring of {joint}: its law leaves"):
        model = sea_ident.identify(upright.leg, here)
    with pytest.warns(SeaIdentWarning, match="may rest anywhere") as warned:
        diagnosis = sea_ident.diagnose(model, here, holdout=there)
    assert diagnosis.verdict == "named"
    (dry,) = diagnosis.missing
    assert (dry.effect, dry.joint) == ("spring_hysteresis", joint)
    for parameter, truth in zip(dry.parameters, [*amounts, slip], strict=True):
        assert abs(parameter.value - truth) < 4.0 * parameter.std
    assert {e.name for e in diagnosis.model.spring_effects} == {"spring_offset", "spring_hysteresis"}
    # it was found on the recording, not read from the motion that tests it
    assert not [w for w in warned if "third" in str(w.message)]
