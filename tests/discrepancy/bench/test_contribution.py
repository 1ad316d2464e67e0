"""Torque of single effects, as it is known beside a model."""

import numpy as np
import pytest

from sea_ident.discrepancy.bench.contribution import as_known, torque_std
from sea_ident.discrepancy.bench.settle import settle
from sea_ident.discrepancy.measured.data import waveform
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


def test_what_a_model_leaves_makes_the_band_of_a_torque_wider(rippled):
    """A hip that cogs, told as a constant torque: that is not as sure as noise alone would have it."""
    bench, start, right = rippled
    worse = bench.fit((*start.fit.effects, make_effect("torque_offset", "hip")), start.noise)
    for fit, larger in ((worse, True), (right.fit, False)):
        ratio = fit.statistic / fit.dof
        assert (ratio > 2.0) is larger
        expected = max(ratio, 1.0) ** 0.5
        position = len(fit.effects) - 1
        band = torque_std(bench, fit, position)
        columns = waveform(bench.column_spectra(fit.effects[position], fit.effects), bench.data.samples)
        counts = bench.counts(fit.effects)
        free = [len(fit.columns) + k for k, (owner, _) in enumerate(fit.free_shapes) if owner == position]
        own = fit.covariance_factor[[*range(sum(counts[:position]), sum(counts[: position + 1])), *free]]
        if free:
            shapes = [pair for pair in fit.free_shapes if pair[0] == position]
            bent, _ = bench.tangents(fit.effects, fit.columns, fit.values, shapes)
            columns = np.concatenate([columns, waveform(bent, bench.data.samples)], axis=2)
        np.testing.assert_allclose(band, expected * np.linalg.norm(columns @ own, axis=2), rtol=1e-9, atol=1e-12)
