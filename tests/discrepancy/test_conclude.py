"""Verdicts from whole recordings: what does not transfer, and what no library has.

The effect that the library lacks is planted from here and never registered.
"""

import re
import warnings
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest

import sea_ident
from sea_ident.discrepancy import Verdict, searching
from sea_ident.discrepancy.bench.gap import Gap
from sea_ident.discrepancy.bench.lack import remainder_share
from sea_ident.discrepancy.changing import Changing
from sea_ident.discrepancy.compared.heldout import Kind, tried
from sea_ident.discrepancy.conclude import (
    _known_better,
    _locations,
    beyond_the_library,
    conclude,
    explains,
    goes_there,
    predicts,
    verdict_of,
    without_sizes,
)
from sea_ident.discrepancy.evidence.foretold import Left
from sea_ident.discrepancy.evidence.locate import locate
from sea_ident.discrepancy.measured.check import Findings
from sea_ident.discrepancy.nameless.unnamed import Unnamed
from sea_ident.discrepancy.result.diagnosis import Diagnosis, read_diagnosis
from sea_ident.discrepancy.result.findings import LackOfFit, Location, MissingEffect
from sea_ident.discrepancy.search.confirm import Confirmed
from sea_ident.discrepancy.search.search import Selection
from sea_ident.discrepancy.trends.trend import Trend, TrendTest
from sea_ident.effects import Column, Contribution, Effect, Side, effect_classes
from sea_ident.effects.friction_drift import FrictionDrift
from sea_ident.exceptions import SeaIdentWarning

PERIOD = 5.0
RIPPLE = ("torque_ripple", "hip", [1.0, 0.5], {"order": 4.0})


@dataclass(frozen=True)
class CrossedFriction(Effect):
    """Friction of one motor that changes with the position of two joints: nothing in the library has both."""

    order: float = 3.0

    name: ClassVar[str] = "crossed_friction"
    side: ClassVar[Side] = Side.MOTOR
    source: ClassVar[str] = "none"

    def columns(self, robot):
        return (Column(self.parameter_name(), "N m", self.name, self.joint, self.side),)

    def form(self, theta, dtheta, i, k):
        turning = np.tanh(dtheta[..., i] / 0.5)
        return turning * np.sin(self.order * theta[..., k]) * np.cos(2.0 * self.order * theta[..., i])

    def indices(self, robot):
        i = robot.index(self.joint)
        return i, (i + 1) % robot.n

    def evaluate(self, state):
        i, k = self.indices(state.robot)
        motor = np.zeros((len(state.motion), state.robot.n, 1))
        motor[:, i, 0] = self.form(state.motion.theta, state.motion.dtheta, i, k)
        return Contribution(np.zeros_like(motor), motor)

    def torque(self, robot, values):
        i, k = self.indices(robot)

        def act(state, link, motor):
            motor[i] += float(values[0] * self.form(np.asarray(state.theta), np.asarray(state.dtheta), i, k))

        return act


def test_where_nothing_can_be_told_no_size_is_told(tmp_path):
    """A joint that friction holds: noise of 5e21 N m, in which every other number drowns."""
    gap = Gap({"hip": 2.56e19}, {"hip": 2.55e19}, {"hip": 4.9e21})
    effect = MissingEffect("torque_ripple", "hip", (), 3e18, 0.0, ())
    place = Location("hip", "link", "slow", 1e29, 200.0)
    lack = LackOfFit(1300.0, 1376, 0.87, 1.0, {"hip": {"motor": 1e58}}, 3e18)
    full = Diagnosis(Verdict.CANNOT_TELL, "Nothing.", lack, (place,), (effect,), gap, gap, warnings=("held",))
    assert "e+" in full.summary()
    bare = without_sizes(full)
    assert bare.summary() == "cannot_tell: Nothing.\n  warning: held"
    bare.save(tmp_path / "d.json")
    assert "e+" not in (tmp_path / "d.json").read_text()
    assert read_diagnosis(tmp_path / "d.json").summary() == bare.summary()


def diagnosed(laboratory, recording, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        model = sea_ident.identify(laboratory.leg, recording, period=PERIOD)
        return sea_ident.diagnose(model, recording, **options)


def names(found):
    return [(m.effect, m.joint) for m in found.missing]


def test_the_planted_effect_is_in_no_library():
    assert CrossedFriction.name not in effect_classes()


@pytest.mark.slow
def test_what_does_not_hold_on_another_motion_is_suspect(laboratory):
    """A disturbance that looks like a ripple is there on one day, and has turned round on another."""
    training = laboratory.record([RIPPLE], periods=8)
    turned = ("torque_ripple", "hip", [-1.0, -0.5], {"order": 4.0})
    found = diagnosed(laboratory, training, holdout=laboratory.record([turned], motion=1, periods=6, seed=9))
    assert found.verdict is Verdict.SUSPECT
    assert names(found) == [("torque_ripple", "hip")]
    assert found.missing[0].transfer < 0.0
    assert found.holdout.shrink < 0.0


@pytest.mark.slow
def test_an_effect_that_no_library_has_gets_no_name_of_its_own(laboratory):
    strange = (CrossedFriction("knee"), [2.0])
    found = diagnosed(laboratory, laboratory.record([strange], periods=12))
    assert found.verdict is Verdict.NOT_IN_LIBRARY
    assert found.lack_of_fit.p_value < 1e-6
    assert found.locations[0].joint == "knee"
    assert found.lack_of_fit.remainder > 3e-3


def test_what_predicts_worse_than_no_model_does_not_hold_there():
    torque = {"hip": 10.0, "knee": 4.0}
    noise = {"hip": 300.0, "knee": 200.0}
    assert predicts(Gap({"hip": 9.0, "knee": 5.0}, {"hip": 1.0, "knee": 3.9}, noise), torque)
    # within three times its noise, but that says nothing where it is beyond the torque itself
    wild = Gap({"hip": 900.0, "knee": 0.0}, {"hip": 600.0, "knee": 0.0}, noise)
    assert explains(Gap({"hip": 1.0}, {"hip": 0.0}, {"hip": 0.1}), wild)
    assert not predicts(wild, torque)
    found = Gap({"hip": 1.0}, {"hip": 0.0}, {"hip": 0.1})
    assert not goes_there(found, wild, torque, ())
    # of what a joint carries that stood, nothing was known: that is no fault of what was found
    assert goes_there(found, wild, torque, ("hip",))


@pytest.mark.scenario
def test_nothing_is_missing_and_yet_something_was_changed_before_the_motion_that_was_held_out(laboratory):
    changed = laboratory.record([("torque_offset", "knee", [1.5], {})], motion=1)
    found = diagnosed(laboratory, laboratory.record(periods=12), holdout=changed)
    assert found.verdict is Verdict.NONE
    told = re.search(r"On the recording that was held out the model leaves ([\d.]+) N m at knee \(", found.text)
    assert told is not None
    assert float(told[1]) == pytest.approx(1.5, rel=0.1)  # beside reversals it is not counted
    assert any(text.endswith("Diagnose that one as well") for text in found.warnings)


@pytest.mark.parametrize(
    ("verdict", "told"),
    [
        (Verdict.NONE, ["hip", "knee"]),
        (Verdict.NAMED, ["hip", "knee"]),
        (Verdict.AMBIGUOUS, ["hip", "knee"]),
        (Verdict.SUSPECT, ["knee"]),
        (Verdict.NOT_IN_LIBRARY, []),
    ],
)
def test_what_is_left_of_another_motion_is_told_beside_every_verdict_with_a_model(
    rippled, laboratory, monkeypatch, verdict, told
):
    """Of what is suspect it is said that it does not hold; told is but what the recording hardly tells."""
    bench, start, final = rippled
    left = {"hip": Left(2.0, 0.2, 0.1, "friction"), "knee": Left(1.5, 0.3, 1.0, "ripple")}
    module = "sea_ident.discrepancy.conclude"
    monkeypatch.setattr(f"{module}.left_of", lambda *_: left)
    monkeypatch.setattr(f"{module}.verdict_of", lambda *_: verdict)
    selection = Selection(start, final, 1, (1e-9,))
    held = replace(tried(laboratory.bench(laboratory.record(motion=1)), selection, "other"), kind=Kind.OTHER_MOTION)
    confirmed = Confirmed(selection, bench, start, final)
    found = conclude(bench, confirmed, drifting(None), {}, held, None, Findings())
    assert found.verdict is verdict
    assert [joint for joint in left if re.search(rf"leaves [^:]* N m at {joint} \(", found.text)] == told


def test_what_only_the_samples_near_reversals_show_has_its_place_there(rippled):
    bench, start, final = rippled
    assert locate(bench, final.fit, final.noise) == ()
    silent = Confirmed(Selection(start, final, 1, (1e-9,)), bench, final, final)
    places = _locations(bench, silent)
    assert (places[0].joint, places[0].equation) == ("hip", "motor")
    assert _locations(bench, replace(silent, selection=replace(silent.selection, added=0))) == ()


@pytest.mark.parametrize(
    ("joint", "share", "transfer", "expected"),
    [("hip", 1e-3, -3.6, True), ("hip", 1.0, -3.6, False), ("knee", 1e-3, -3.6, False), ("hip", 1e-3, 0.9, True)],
)
def test_it_is_no_matter_of_doubt_where_it_is_known_what_holds(rippled, joint, share, transfer, expected):
    """A push that follows the position comes at another time on another motion."""
    found = MissingEffect("external_force", "hip", (), 0.02, 0.0, (), transfer=transfer)
    relative = Unnamed("external_force", joint, "at the same place", share, rippled[1].fit.solution)
    assert _known_better([found], (relative,)) is expected


def test_what_leaves_more_than_half_needs_no_choice_between_equals(rippled):
    bench, start, right = rippled

    def beyond(final, added=1, change=None):
        found = Confirmed(Selection(start, final, added, ()), bench, start, final)
        return beyond_the_library(found, drifting(change))

    assert beyond(start)
    assert not beyond(right)
    assert not beyond(start, added=0)
    left = remainder_share(bench, start)
    assert not beyond(start, change=1.1 * left)
    assert beyond(start, change=0.9 * left), "what drifts leaves no more in the mean than it changes"


@pytest.mark.parametrize(("change", "verdict"), [(0.06, Verdict.NAMED_WITH_REMAINDER), (0.006, Verdict.NOT_IN_LIBRARY)])
def test_what_drifts_is_no_excuse_for_more_than_it_changes(rippled, change, verdict):
    bench = rippled[0]
    found = [MissingEffect("transmission_coupling", "hip", (), 0.06, 0.0, ())]
    notes = Findings()
    assert verdict_of(bench, found, drifting(change), None, 0.036, 0.05, notes) is verdict
    assert verdict_of(bench, found, drifting(None), None, 0.036, 0.05, notes) is Verdict.NOT_IN_LIBRARY


@pytest.mark.parametrize(("change", "searches"), [(0.9, 1), (1.1, 2)])
def test_a_search_is_repeated_only_for_what_drifts_enough(rippled, monkeypatch, change, searches):
    bench, start, _ = rippled
    found = Confirmed(Selection(start, start, 0, ()), bench, start, start)
    trends, calls = drifting(change * remainder_share(bench, start)), []

    def searched(bench, *rest, **options):
        calls.append(bench)
        return searching.Found(bench, found, trends)

    monkeypatch.setattr(Changing, "compared", lambda *rest: drifting(None))
    monkeypatch.setattr(Changing, "less", lambda self, bench, *rest: bench)
    monkeypatch.setattr(searching, "_searched_mean", searched)
    monkeypatch.setattr(searching, "searched_beside_reversals", lambda *both: both)
    searching._searched(bench, Changing(None), lambda what, share: None)
    assert len(calls) == searches


def drifting(change):
    """A comparison of periods that found one drift with such a change of the torque, or none."""
    effect = FrictionDrift("ankle")
    none = np.zeros(2)
    trends = () if change is None else (Trend(effect, none, none, 100.0, 1e-9, change),)
    return TrendTest(1e-9, trends, False)
