"""Joints that are elsewhere than the description says: told before a search begins."""

import warnings
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from sea_ident.discrepancy import diagnose
from sea_ident.discrepancy.bench.settle import Settled, settle
from sea_ident.discrepancy.search.candidates import scan
from sea_ident.discrepancy.search.explained_by_one import PROMISED
from sea_ident.discrepancy.search.placements import with_placements
from sea_ident.effects import make_effect
from sea_ident.effects.joint_placement import JointPlacement
from sea_ident.estimation import identify
from sea_ident.exceptions import SeaIdentWarning


@pytest.mark.scenario
@pytest.mark.parametrize(
    ("joint", "way", "beside"),
    [
        ("knee", (-0.02, 0.0), ()),
        ("ankle", (0.04, 0.01), ()),
        ("knee", (0.03, 0.0), (("torque_offset", "hip", [1.0], {}),)),
    ],
)
def test_a_leg_that_was_set_to_another_length_is_told(laboratory, leg, joint, way, beside):
    """To within the standard deviations; what is repaired goes on another motion, in torque and in simulation."""
    planted = [("joint_placement", joint, list(way), {}), *beside]
    recording, holdout = (
        laboratory.record(planted, periods=p, seed=s, motion=m) for p, s, m in ((10, 3, 0), (6, 7, 1))
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        found = diagnose(identify(leg, recording, period=5.0), recording, holdout=holdout)
    assert found.verdict == ("ambiguous" if beside else "named")
    assert {(m.effect, m.joint) for m in found.missing} == {(name, where) for name, where, *_ in planted}
    missing = next(m for m in found.missing if m.effect == "joint_placement")
    assert missing.alternatives == ()
    for parameter, size in zip(missing.parameters, way, strict=True):
        assert parameter.unit == "m"
        assert parameter.value == pytest.approx(size, abs=3.0 * parameter.std)
        assert parameter.std < 1e-3
    assert found.holdout.shrink > 0.4
    assert found.simulation_gap["q"].shrink > 0.8
    assert any("identify again" in text for text in found.warnings)


def test_nothing_is_moved_where_nothing_is_missing(nothing_missing):
    bench, start = nothing_missing
    assert with_placements(bench, start, []) is start


@pytest.mark.scenario
def test_joints_are_moved_where_nothing_else_explains_nearly_all(laboratory):
    """And another effect that is really there is none of theirs."""
    bench = laboratory.bench(laboratory.record([("joint_placement", "knee", [0.04, 0.0], {})]))
    start = settle(bench, bench.effects)
    candidates = scan(bench, start.fit, start.noise)
    assert not any(isinstance(candidate.effect, JointPlacement) for candidate in candidates)
    now = with_placements(bench, start, candidates)
    (found,) = now.fit.effects[len(bench.effects) :]
    assert (found.name, found.joint) == ("joint_placement", "knee")
    assert found.shift[0] == pytest.approx(0.04, abs=0.01)
    assert now.fit.statistic < 1.3 * now.fit.dof
    better = SimpleNamespace(gain=1.01 * PROMISED * start.fit.excess)
    assert with_placements(bench, start, [better]) is start
    tilted = laboratory.bench(laboratory.record([("base_tilt", None, [0.03, 0.02], {})]))
    start = settle(tilted, tilted.effects)
    assert with_placements(tilted, start, scan(tilted, start.fit, start.noise)) is start


@pytest.mark.scenario
def test_what_promises_less_than_it_explains_is_no_placement(laboratory):
    """A first joint that is off by much turns gravity, as if both joints behind it were elsewhere."""
    bench = laboratory.bench(laboratory.record([("joint_offset", "hip", [], {"offset": 0.6})]))
    start = settle(bench, bench.effects)
    candidates = scan(bench, start.fit, start.noise)
    assert candidates[0].effect.name == "base_tilt"
    assert candidates[0].gain < PROMISED * start.fit.excess
    assert with_placements(bench, start, candidates) is start


def test_a_model_that_has_one_is_not_given_it_again(nothing_missing, monkeypatch):
    """Nor another one that explains too little."""
    bench, start = nothing_missing
    tried = []

    def with_left(share, times=20.0):
        """As if the model left some times the noise, and with a joint moved a share of what is too much."""
        far = start.fit.statistic / start.fit.dof / times
        fit = replace(start.fit, whitened=start.fit.whitened / np.sqrt(far))
        less = 1.0 - (1.0 - share) * fit.excess / fit.statistic
        monkeypatch.setattr(
            "sea_ident.discrepancy.search.placements.side_by_side",
            lambda trial, places: [
                tried.append(place.joint) or (less * fit.statistic, fit.solution) for place in places
            ],
        )
        monkeypatch.setattr(
            "sea_ident.discrepancy.search.placements.settle_again",
            lambda bench, now: Settled(replace(fit, whitened=np.sqrt(less) * fit.whitened), start.noise),
        )
        monkeypatch.setattr(
            type(bench),
            "again",
            lambda bench, solution, noise: SimpleNamespace(statistic=less * fit.statistic, fit=fit),
        )
        return replace(start, fit=fit)

    little = with_left(0.6)
    assert with_placements(bench, little, []) is little
    assert tried == ["knee", "ankle"]
    tried.clear()
    there = replace(
        little, fit=replace(little.fit, effects=(*little.fit.effects, make_effect("joint_placement", "knee")))
    )
    assert with_placements(bench, there, []) is there
    assert tried == ["ankle"]
    tried.clear()
    much = with_left(0.1)
    assert with_placements(bench, much, []) is not much
    promising = [SimpleNamespace(gain=0.94 * much.fit.excess)]
    assert with_placements(bench, much, promising) is much
    tried.clear()
    hardly = with_left(0.1, 9.0)
    assert with_placements(bench, hardly, []) is hardly
    assert tried == []
