"""Candidates: in which order they come."""

from dataclasses import replace

import numpy as np

from sea_ident.discrepancy import candidates
from sea_ident.discrepancy.candidates import scan
from sea_ident.discrepancy.judge import penalty
from sea_ident.effects import make_effect


def test_of_candidates_that_do_the_same_the_simplest_comes_first(nothing_missing, monkeypatch):
    bench, now = nothing_missing
    exactly, rng = candidates._exactly, np.random.default_rng(4)

    def alike(*arguments):
        found = exactly(*arguments)
        size = 5e5 if found.effect.joint == "knee" else 6e5
        return replace(found, gain=size * (1.0 + 1e-13 * rng.standard_normal()))

    monkeypatch.setattr(candidates, "_exactly", alike)
    names = ("torque_ripple", "torque_offset", "stribeck_friction")
    effects = [make_effect(name, joint) for joint in ("knee", "hip") for name in names]
    orders = []
    for tried in (effects, effects[::-1]):
        found = scan(bench, now.fit, now.noise, tried)
        assert [c.effect.joint for c in found] == ["hip"] * 3 + ["knee"] * 3
        for three in (found[:3], found[3:]):
            prices = [penalty(c.effect, bench) for c in three]
            assert prices == sorted(prices)
            assert prices[0] < prices[-1]
            orders.append([c.effect.name for c in three])
    assert orders[0] == orders[1]
    assert all(order[0] == "torque_offset" for order in orders)
