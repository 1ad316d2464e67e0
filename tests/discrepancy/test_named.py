"""What is told of an effect that was found."""

import numpy as np
import pytest

from sea_ident.discrepancy.named import named_effect
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
