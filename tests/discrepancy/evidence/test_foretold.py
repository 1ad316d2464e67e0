"""What a model leaves of another motion, beside what its own parameters leave open there."""

from dataclasses import replace

import numpy as np
import pytest

from sea_ident.discrepancy.bench.free_shapes import moved_within
from sea_ident.discrepancy.bench.gap import Gap, gap_of, per_joint, torque_by_joint
from sea_ident.discrepancy.bench.settle import settle
from sea_ident.discrepancy.compared.heldout import HeldOut, Kind, tried
from sea_ident.discrepancy.evidence import foretold
from sea_ident.discrepancy.evidence.foretold import foretold_std, left_of
from sea_ident.discrepancy.search.search import Selection
from sea_ident.effects import make_effect


def test_it_is_the_scatter_of_what_models_within_the_covariance_foretell(rippled, laboratory):
    """Along every axis of the covariance a model of its own, small enough for shapes to act in a straight line."""
    _, _, right = rippled
    fit, other, small = right.fit, laboratory.bench(laboratory.record(motion=1)), 1e-3
    count, power = len(fit.columns), 0.0
    assert fit.free_shapes
    for axis in fit.covariance_factor.T:
        torques = []
        for way in (-small, small):
            effects = fit.effects
            for k, (position, shape) in enumerate(fit.free_shapes):
                effects = moved_within(effects, position, shape, way * axis[count + k])
            values = fit.values + way * axis[:count]
            named = {column.name: float(value) for column, value in zip(fit.columns, values, strict=True)}
            torques.append(other.predicted(effects, named).residual)
        power += np.sum(np.abs((torques[1] - torques[0]) / (2.0 * small)) ** 2, axis=0)
    expected = per_joint(other, fit.unit * power)
    found = foretold_std(other, fit, range(len(fit.effects)))
    np.testing.assert_allclose([found[j] for j in expected], list(expected.values()), rtol=1e-3)
    # of a part of the model it is that of this part alone, and none of it is known better than nothing
    ripple = foretold_std(other, fit, [len(fit.effects) - 1])
    assert ripple["hip"] > 0.0
    assert ripple["knee"] == ripple["ankle"] == 0.0


def test_what_is_little_or_within_noise_or_of_the_same_periods_is_not_asked_for(laboratory):
    bench = laboratory.bench(laboratory.record(motion=1))
    now = settle(bench, bench.effects)
    held = HeldOut(bench, now.fit, now.fit, now.noise, now, (), "other", kind=Kind.OTHER_MOTION)
    torque = torque_by_joint(bench)
    sizes = {"hip": 0.2 * torque["hip"], "knee": 0.2 * torque["knee"], "ankle": 0.03 * torque["ankle"]}
    gap = Gap(sizes, sizes, {"hip": 0.01 * torque["hip"], "knee": 0.1 * torque["knee"], "ankle": 0.0})
    (joint, left), *others = left_of(bench, now, held, gap).items()
    assert (joint, others) == ("hip", [])
    assert (left.size, left.share) == (sizes["hip"], pytest.approx(0.2))
    assert left.std < 0.05 * left.size
    assert not left.as_unsure
    assert left_of(bench, now, replace(held, kind=Kind.OTHER_PERIODS), gap) == {}


def test_it_is_as_wide_as_parameters_are_told_to_be(rippled, laboratory, monkeypatch):
    """Which is more than noise alone would have it where periods scatter, or where a shape is hardly known."""
    bench, start, right = rippled
    other = laboratory.bench(laboratory.record(motion=1))
    held = replace(tried(other, Selection(start, right, 1, (1e-9,)), "other"), kind=Kind.OTHER_MOTION)
    torque = torque_by_joint(other)
    gap = Gap(torque, torque, dict.fromkeys(torque, 0.0))
    plain = right.fit.unit**0.5 * np.linalg.norm(right.fit.covariance_factor, axis=1)
    for times in (1.0, 3.0):
        monkeypatch.setattr(foretold, "uncertainties", lambda *_, wide=times: wide * plain)
        expected = foretold_std(other, right.fit, range(len(right.fit.effects)))
        for joint, left in left_of(bench, right, held, gap).items():
            assert left.std == pytest.approx(times * expected[joint])
    # a parameter that nothing tells, or that is held, is as unsure as its covariance says
    monkeypatch.setattr(foretold, "uncertainties", lambda *_: np.full(len(plain), np.inf))
    assert left_of(bench, right, held, gap)["hip"].std == pytest.approx(expected["hip"])


@pytest.mark.scenario
@pytest.mark.parametrize(("changed", "as_unsure"), [(0.0, True), (8.0, False)])
def test_an_order_that_a_small_motion_does_not_tell_is_told_from_a_change(laboratory, changed, as_unsure):
    """The right effect, with an order that is off by a few of its deviations, leaves half of the torque."""
    large, other = laboratory.motions
    small = replace(laboratory, motions=(replace(large, a=0.3 * large.a, b=0.3 * large.b), other))
    planted = [("position_dependent_friction", "ankle", [0.8, 0.3], {"order": 4.0})]
    bench = small.bench(small.record(planted))
    start = settle(bench, bench.effects)
    final = settle(bench, (*bench.effects, make_effect("position_dependent_friction", "ankle", order=4.0)))
    there = small.bench(small.record([*planted, ("torque_offset", "ankle", [changed], {})], motion=1, periods=5))
    held = replace(tried(there, Selection(start, final, 1, (1e-9,)), "other"), kind=Kind.OTHER_MOTION)
    left = left_of(bench, final, held, gap_of(there, held.before, held.after, held.noise))
    assert left["ankle"].share > 0.2
    assert left["ankle"].as_unsure is as_unsure
    assert left["ankle"].least_known == "position_dependent_friction at ankle"
