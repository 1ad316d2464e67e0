"""Torque of single effects, as it is known beside a model."""

import numpy as np
import pytest

from sea_ident.discrepancy.contribution import as_known
from sea_ident.discrepancy.settle import settle
from sea_ident.effects import make_effect


@pytest.mark.scenario
def test_fitted_beside_what_is_known_an_effect_comes_out_as_it_does_with_all_free(laboratory):
    """What is known is a part of the stiffness that scales the residual too."""
    bench = laboratory.bench(laboratory.record([("spring_offset", "knee", [-0.4], {})]))
    start = settle(bench, bench.effects)
    noise, first = start.noise, len(start.fit.effects)
    kinked = make_effect("asymmetric_spring", "hip", kink=0.001)
    whole = bench.refine((*start.fit.effects, kinked, make_effect("spring_offset", "knee")), noise)
    known = as_known(bench, whole, [first])
    others = [effect for k, effect in enumerate(whole.effects) if k != first]
    fit = bench.fit(others, noise, start=whole.parameters, known=known)
    assert known.stiffness.any()
    np.testing.assert_allclose(bench.stiffness_of(fit), bench.stiffness_of(whole), rtol=1e-3)
    assert fit.statistic == pytest.approx(whole.statistic, rel=1e-6)
