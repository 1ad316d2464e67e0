"""Singular values where the fast way gives up."""

import numpy as np
import pytest

from sea_ident.discrepancy.bench.linear import solve
from sea_ident.singular_values import svd


def gives_up(*arguments, **options):
    raise np.linalg.LinAlgError("SVD did not converge")


@pytest.mark.parametrize("shape", [(7, 4), (4, 7), (5, 5)])
def test_the_sure_way_finds_what_the_fast_one_does(shape, monkeypatch):
    matrix = np.random.default_rng(1).standard_normal(shape)
    matrix[:, 1] = 0.0
    fast = svd(matrix)
    monkeypatch.setattr(np.linalg, "svd", gives_up)
    left, strength, right = svd(matrix)
    assert [part.shape for part in (left, strength, right)] == [part.shape for part in fast]
    np.testing.assert_allclose(strength, fast[1], atol=1e-12)
    np.testing.assert_allclose(left * strength @ right, matrix, atol=1e-12)


def test_least_squares_do_not_depend_on_the_way(monkeypatch):
    rng = np.random.default_rng(2)
    columns, target = rng.standard_normal((30, 6)), rng.standard_normal(30)
    columns[:, 3] = 0.0
    expected = solve(columns, target)
    monkeypatch.setattr(np.linalg, "svd", gives_up)
    found = solve(columns, target)
    np.testing.assert_allclose(found[0], expected[0], atol=1e-12)
    np.testing.assert_allclose(found[1] @ found[1].T, expected[1] @ expected[1].T, atol=1e-12)


def test_what_is_not_finite_is_refused():
    with pytest.raises(np.linalg.LinAlgError):
        svd(np.array([[1.0, np.nan], [0.0, 1.0]]))
