"""A model that was identified without knowing zeros is diagnosed without knowing them."""

import warnings

import numpy as np
import pytest

from sea_ident.discrepancy import diagnose
from sea_ident.discrepancy.bench.settle import settle
from sea_ident.discrepancy.compared.heldout import tried
from sea_ident.discrepancy.diagnose import model_effects
from sea_ident.discrepancy.measured.own_zeros import OwnZero, joints_with_own_zeros, own_zeros
from sea_ident.discrepancy.result.repair import repaired_model
from sea_ident.discrepancy.search.search import Selection
from sea_ident.effects.spring_offset import SpringOffset
from sea_ident.estimation import identify
from sea_ident.exceptions import SeaIdentWarning
from sea_ident.processing import process

JOINTS = ("hip", "knee", "ankle")


def from_where_it_was_switched_on(recording, first):
    """Encoders of motors that count from a sample on."""
    moved = {f"theta_{j}": recording.columns[f"theta_{j}"] for j in JOINTS}
    return recording.replace_columns({name: values - values[first] for name, values in moved.items()})


def diagnosed(leg, recording, holdout, unknown):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        model = identify(leg, recording, period=5.0, unknown_zero=unknown)
        return model, diagnose(model, recording, holdout=holdout)


@pytest.fixture(scope="module")
def sticky(laboratory):
    """A leg with friction that falls with the speed, on two motions."""
    planted = [("stribeck_friction", "knee", [0.8], {"speed": 0.1})]
    return [laboratory.record(planted, periods=p, seed=s, motion=m) for p, s, m in ((10, 3, 0), (6, 7, 1))]


@pytest.mark.scenario
def test_nothing_is_missing_where_only_zeros_are_unknown(laboratory, leg):
    """What is left of a zero was told as dry friction in a spring, with confidence."""
    recording, holdout = (laboratory.record(periods=p, seed=s, motion=m) for p, s, m in ((10, 3, 0), (6, 7, 1)))
    counted, elsewhere = (from_where_it_was_switched_on(r, 100) for r in (recording, holdout))
    model, found = diagnosed(leg, counted, elsewhere, JOINTS)
    assert found.verdict == "none"
    for joint in JOINTS:
        (said,) = [text for text in found.warnings if text.startswith(f"theta_{joint} was read less ")]
        assert "on the held-out data" in said
    zeros = {s.joint: s.zero for s in found.model.springs}
    known = {s.joint: s.zero for s in model.springs}
    assert zeros == pytest.approx(known, abs=3e-4)
    # and a model that was refitted is diagnosed again as it was
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        assert diagnose(found.model, counted, holdout=elsewhere).verdict == "none"


@pytest.mark.scenario
def test_what_is_missing_beside_unknown_zeros_is_named_as_beside_known_ones(leg, sticky):
    known = diagnosed(leg, *sticky, ())[1]
    counted = [from_where_it_was_switched_on(r, 100) for r in sticky]
    unknown = diagnosed(leg, *counted, JOINTS)[1]
    for found in (known, unknown):
        assert found.verdict == "named"
        assert [(m.effect, m.joint) for m in found.missing] == [("stribeck_friction", "knee")]
    sizes = [found.missing[0].parameters[0] for found in (known, unknown)]
    assert sizes[1].value == pytest.approx(sizes[0].value, abs=2.0 * sizes[0].std)
    for kind in ("q", "theta", "tau"):
        shrinks = [found.simulation_gap[kind].shrink for found in (known, unknown)]
        assert shrinks[1] == pytest.approx(shrinks[0], abs=0.1)


@pytest.mark.scenario
def test_zeros_that_are_far_off_everywhere_are_said_and_nothing_is_named(leg, sticky):
    """They were a constant of thirty times the torque beside springs of other powers."""
    counted = [from_where_it_was_switched_on(r, 100) for r in sticky]
    model, found = diagnosed(leg, *counted, ())
    assert found.verdict == "cannot_tell"
    assert found.missing == ()
    for joint in JOINTS:
        assert any(f"zeros of theta_{joint} and q_{joint} that differ by" in text for text in found.warnings)
    assert [s.zero for s in model.springs] == [0.0, 0.0, 0.0]


def test_a_constant_that_the_model_has_is_no_zero(laboratory, leg):
    recording = from_where_it_was_switched_on(laboratory.record(), 100)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        model = identify(leg, recording, period=5.0, unknown_zero=["knee"])
    assert own_zeros(model) == (OwnZero("knee"),)
    effects = model_effects(model)
    assert joints_with_own_zeros(effects) == {"knee"}
    assert joints_with_own_zeros([SpringOffset("knee")]) == set()
    assert np.count_nonzero([isinstance(e, SpringOffset) for e in effects]) == 1


@pytest.mark.scenario
@pytest.mark.parametrize(("kind", "own"), [(OwnZero, True), (SpringOffset, False)])
def test_the_constant_of_a_zero_of_its_own_is_not_foretold(laboratory, kind, own):
    """That of a spring is: it is there on every motion."""
    recording, later = laboratory.record(periods=8), laboratory.record(periods=8, seed=11)
    shown = recording.replace_columns({"theta_knee": recording.columns["theta_knee"] + 0.002})
    effects = (*laboratory.effects, kind("knee"))
    first, other = (laboratory.bench(r, effects) for r in (shown, later))
    start = settle(first, first.effects)
    before = tried(other, Selection(start, start, 0, ()), "later").before
    knee = [e for e, equation in enumerate(other.data.equations) if equation.joint == "knee"]
    constant = float(np.max(np.abs(before.residual[0, knee])))
    # 200 N m/rad times the difference of the zeros
    assert (constant < 0.05) is own
    assert own or constant == pytest.approx(0.4, rel=0.3)


def test_a_repaired_model_does_not_know_the_zero_either(laboratory, leg):
    """What is left of it in the recording that was read less a first guess is fitted with its spring."""
    left = 0.001
    recording = laboratory.record(periods=8)
    shown = recording.replace_columns({"theta_knee": recording.columns["theta_knee"] + left})
    bench = laboratory.bench(shown, (*laboratory.effects, OwnZero("knee")))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        model = identify(leg, recording, period=5.0)
        repaired = repaired_model(model, process(shown, leg, period=5.0), settle(bench, bench.effects).fit)
    zeros = {spring.joint: spring.zero for spring in repaired.springs}
    assert zeros == {"hip": 0.0, "knee": pytest.approx(left, abs=2e-4), "ankle": 0.0}
    assert not any(isinstance(effect, SpringOffset) for effect in repaired.spring_effects)
