"""What the samples that are left out take up: the same as an orthonormal basis of it would."""

import numpy as np
import pytest

from sea_ident.discrepancy.bench.free_samples import free_samples
from sea_ident.discrepancy.bench.freed import FreeColumns, Freed
from sea_ident.discrepancy.bench.linear import off, span, whiten
from sea_ident.discrepancy.measured.noise import leverage_of

SAMPLES, HARMONICS, EQUATIONS = 200, 40, 4


def whitening(rng, apart):
    """(H + 1, E, E) of a noise floor that is common to all equations but for a part of it (apart) of their own."""
    shape = (HARMONICS + 1, EQUATIONS, 2 * EQUATIONS)
    colour = rng.standard_normal(shape) + 1j * rng.standard_normal(shape)
    colour = apart * colour + colour[:, :1]
    colour[0] = colour[0].real
    colour *= np.logspace(0.0, 3.0, EQUATIONS)[:, None]
    covariance = colour @ colour.conj().transpose(0, 2, 1)
    return np.linalg.inv(np.linalg.cholesky(covariance))


def left_out(rng, equations):
    """(N, E) some samples around six instants, the same in some equations."""
    chosen = np.zeros((SAMPLES, EQUATIONS), dtype=bool)
    for centre in rng.integers(0, SAMPLES, 6):
        chosen[np.ix_(np.arange(centre, centre + 5) % SAMPLES, equations)] = True
    return chosen


@pytest.mark.parametrize("equations", [(0, 1, 2, 3), (1, 3), (2,), ()])
@pytest.mark.parametrize("apart", [1.0, 1e-2, 1e-3, 1e-6])
def test_it_is_the_projection_by_an_orthonormal_basis(equations, apart):
    rng = np.random.default_rng(4)
    whitener, columns = whitening(rng, apart), FreeColumns.of(free_samples(left_out(rng, equations), HARMONICS))
    basis, freed = span(whiten(whitener, columns.spectra)), Freed(whitener, columns)
    assert freed.count == basis.shape[1] == columns.count
    assert freed.count > 0 or not equations
    np.testing.assert_allclose(freed.basis, basis)
    for shape in ((len(basis),), (len(basis), 7)):
        values = rng.standard_normal(shape)
        left = freed.off(values)
        np.testing.assert_allclose(left, off(basis, values), atol=1e-9)
        np.testing.assert_allclose(basis.T @ left, 0.0, atol=1e-9)
        assert left is not values
    np.testing.assert_allclose(freed.leverage, leverage_of(basis, EQUATIONS), atol=1e-6)
    # every dimension takes up as much as one number, a complex coefficient is two
    assert freed.leverage[0].sum() + 2.0 * freed.leverage[1:].sum() == pytest.approx(freed.count)


def test_columns_that_depend_on_each_other_are_counted_once():
    rng = np.random.default_rng(5)
    spectra = free_samples(left_out(rng, (0, 2)), HARMONICS)
    first = np.flatnonzero(np.any(spectra[:, 0], axis=0))
    doubled = np.concatenate([spectra[:, :, first], spectra[:, :, first[:3]], spectra[:, :, len(first) :]], axis=2)
    whitener = whitening(rng, 1.0)
    plain, twice = (Freed(whitener, FreeColumns.of(each)) for each in (spectra, doubled))
    assert twice.count == plain.count == spectra.shape[2]
    values = rng.standard_normal((EQUATIONS * (2 * HARMONICS + 1), 3))
    np.testing.assert_allclose(twice.off(values), plain.off(values), atol=1e-9)
    np.testing.assert_allclose(twice.leverage, plain.leverage, atol=1e-9)
