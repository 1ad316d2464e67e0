"""What is told of an effect that was found."""

import numpy as np
import pytest

from sea_ident.discrepancy.named import named_effect
from sea_ident.discrepancy.powers import with_open_powers
from sea_ident.discrepancy.settle import Settled
from sea_ident.discrepancy.uncertainty import uncertainties
from sea_ident.effects import make_effect


@pytest.mark.parametrize(("share", "known"), [(0.1, True), (0.6, False)])
def test_where_dry_friction_in_a_spring_slips_shows_only_where_it_does(laboratory, nothing_missing, share, known):
    """What sticks all the time is a spring and a constant, whatever it would slip at."""
    usual, start = nothing_missing
    slip = share * float(np.ptp(usual.data.motion.deflection[:, 0]))
    bench = laboratory.bench(laboratory.record([("spring_hysteresis", "hip", [0.5, 0.5], {"slip": slip})]))
    effect = make_effect("spring_hysteresis", "hip", slip=slip)
    fit = bench.fit((*start.fit.effects, effect), start.noise, start=start.fit.parameters)
    now = Settled(fit, start.noise)
    found = named_effect(bench, fit, len(fit.effects) - 1, uncertainties(bench, now), 0.0, ())
    told = {p.name.removeprefix("hip.spring_hysteresis_"): p for p in found.parameters}
    assert set(told) == {"narrow", "wide", "slip"}
    assert told["slip"].value == pytest.approx(slip)
    unsure = {name: p.std >= abs(p.value) for name, p in told.items()}
    assert unsure["slip"] == (not known)
    assert known or all(unsure.values())


def test_the_power_that_a_search_tried_is_told_with_what_is_known_of_it(laboratory, nothing_missing):
    """A spring that stiffens by a power of 2.015, fitted with 2: as sure of its size as of its power."""
    _, start = nothing_missing
    planted = [("spring_stiffening", "knee", [4000.0], {"exponent": 2.015})]
    bench = laboratory.bench(laboratory.record(planted))
    effects = (*start.fit.effects, make_effect("spring_stiffening", "knee", exponent=2.0))
    now = Settled(bench.fit(effects, start.noise, start=start.fit.parameters), start.noise)
    open_ = with_open_powers(bench, now)
    assert with_open_powers(bench, start) is start
    told = [
        named_effect(bench, now.fit, len(effects) - 1, uncertainties(bench, each), 0.0, (), each.fit.free_shapes)
        for each in (now, open_)
    ]
    held, free = ({p.name.removeprefix("knee.spring_stiffening_"): p for p in each.parameters} for each in told)
    assert told[1].detail == effects[-1]
    assert (held["exponent"].value, held["exponent"].std) == (free["exponent"].value, 0.0) == (2.0, 0.0)
    assert held["power"].value == free["power"].value
    for name, planted_value in (("power", 4000.0), ("exponent", 2.015)):
        assert abs(free[name].value - planted_value) < 3.0 * free[name].std
    assert free["power"].std > 3.0 * held["power"].std
