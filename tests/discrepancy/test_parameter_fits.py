"""Parameters of a model fitted with its shapes held."""

import numpy as np
import pytest

from sea_ident.discrepancy.fit import Known
from sea_ident.effects import make_effect


def test_columns_are_the_derivative_of_the_whitened_residual(rippled):
    """That of a link too, whose scale follows the stiffness that is fitted."""
    bench, _, now = rippled
    fit, flat = now.fit, bench.whitening(now.noise).flat
    for name in ("hip.spring_stiffness", "knee.spring_stiffness", "knee.coulomb_friction", "foot.mass"):
        column = next((k for k, c in enumerate(fit.columns) if c.name == name), None)
        if column is None:
            continue
        step = 1e-4 * abs(fit.values[column])
        ends = []
        for sign in (-1.0, 1.0):
            there = bench.predicted(fit.effects, {**fit.parameters, name: fit.values[column] + sign * step})
            ends.append(flat(there.residual * there.scale))
        slope = (ends[0] - ends[1]) / (2.0 * step)
        np.testing.assert_allclose(slope, fit.flat[:, column], atol=1e-5 * np.abs(slope).max())


def test_a_fit_stands_where_no_parameter_brings_the_statistic_down(rippled):
    fit = rippled[2].fit
    columns = fit.flat[:, : len(fit.columns)]
    lengths = np.linalg.norm(columns, axis=0)
    slope = columns.T @ fit.whitened / np.where(lengths > 0.0, lengths, 1.0)
    # a standard deviation is one
    assert np.abs(slope).max() < 0.05


def test_a_planted_effect_is_fitted_within_its_own_standard_errors(rippled):
    fit = rippled[2].fit
    found = [k for k, c in enumerate(fit.columns) if "torque_ripple" in c.name]
    assert len(found) == 2
    for k, planted in zip(found, (1.0, 0.5), strict=True):
        assert fit.values[k] == pytest.approx(planted, abs=4.0 * fit.std(k))
        assert fit.std(k) < 0.06


def test_a_shape_is_refined_beside_what_is_known(rippled):
    """A part of the ripple is known: what is left has the same order, and so much smaller amounts."""
    bench, start, with_it = rippled
    part = 0.3
    sizes = {name: value for name, value in with_it.fit.parameters.items() if "torque_ripple" in name}
    torque = bench.column_spectra(make_effect("torque_ripple", "hip", order=4.0), with_it.fit.effects)
    known = Known(torque @ (part * np.array(list(sizes.values()))), np.zeros(len(bench.data.equations)))
    model = (*start.fit.effects, make_effect("torque_ripple", "hip", order=4.2))
    found = bench.refine(model, with_it.noise, start=start.fit.parameters, only=len(bench.effects), known=known)
    assert found.known is known
    count = len(found.columns)
    assert found.effects[-1].order == pytest.approx(4.0, abs=3.0 * found.std(count + len(found.free_shapes) - 1))
    for k, column in enumerate(found.columns):
        if column.name in sizes:
            assert found.values[k] == pytest.approx((1.0 - part) * sizes[column.name], abs=3.0 * found.std(k))
    # as good as with all of it in the model
    assert found.statistic == pytest.approx(with_it.fit.statistic, abs=5.0)
