"""Least squares and bases of columns that depend on each other."""

import numpy as np
import pytest

from sea_ident.discrepancy.bench.linear import least_squares, least_squares_near, off, solve, solve_near, span

RNG = np.random.default_rng(7)


@pytest.fixture(params=["independent", "dependent", "with a column of zeros", "more columns than rows"])
def columns(request):
    free = RNG.standard_normal((40, 6)) * 10.0 ** np.arange(-3, 3)
    mixed = free @ RNG.standard_normal((6, 3))
    return {
        "independent": free,
        "dependent": np.concatenate([free, mixed], axis=1),
        "with a column of zeros": np.concatenate([free, np.zeros((40, 1))], axis=1),
        "more columns than rows": RNG.standard_normal((5, 9)),
    }[request.param]


def test_the_solution_is_the_smallest_in_normalised_columns(columns):
    target = RNG.standard_normal(len(columns))
    norms = np.linalg.norm(columns, axis=0)
    norms[norms == 0.0] = 1.0
    expected = np.linalg.lstsq(columns / norms, target, rcond=1e-9)[0] / norms
    values, basis, factor = solve(columns, target)
    np.testing.assert_allclose(values, expected, rtol=1e-7, atol=1e-9)
    np.testing.assert_allclose(least_squares(columns, target)[0], expected, rtol=1e-7, atol=1e-9)
    covariance = np.linalg.pinv((columns / norms).T @ (columns / norms), hermitian=True, rcond=1e-12)
    np.testing.assert_allclose(factor @ factor.T * np.outer(norms, norms), covariance, rtol=1e-6, atol=1e-8)
    np.testing.assert_allclose(off(basis, target), target - columns @ expected, atol=1e-8)


@pytest.mark.parametrize("apart", [0.0, 0.1, 3.0], ids=["the same", "near", "far"])
def test_a_frame_serves_for_columns_nearby_and_does_no_harm_far_away(columns, apart):
    target = RNG.standard_normal(len(columns))
    frame = least_squares(columns, target)[1]
    made = columns @ frame
    np.testing.assert_allclose(made.T @ made, np.eye(frame.shape[1]), atol=1e-9)
    # rows in another scale: the columns depend on each other as before
    others = columns * (1.0 + apart * RNG.random((len(columns), 1)))
    left = target - others @ np.linalg.lstsq(others, target, rcond=1e-12)[0]
    values = least_squares_near(frame, others, target)
    np.testing.assert_allclose(target - others @ values, left, atol=1e-8)
    basis, factor = solve_near(frame, others)
    np.testing.assert_allclose(basis.T @ basis, np.eye(np.linalg.matrix_rank(others)), atol=1e-12)
    np.testing.assert_allclose(off(basis, others), 0.0, atol=1e-9 * np.abs(others).max())
    # what the columns tell has the same covariance whatever the frame
    usual = solve(others, target)[2]
    np.testing.assert_allclose(others @ factor @ factor.T @ others.T, others @ usual @ usual.T @ others.T, atol=1e-9)


def test_a_frame_of_other_columns_is_given_up():
    """Far from orthonormal the products tell less than the columns: all is worked out anew."""
    free, target = RNG.standard_normal((40, 6)), RNG.standard_normal(40)
    frame = least_squares(free, target)[1]
    # two of them nearly the same now, and one a thousand times as long
    others = free.copy()
    others[:, 1] = others[:, 0] + 1e-4 * others[:, 1]
    others[:, 5] *= 1e3
    usual, basis, factor = solve(others, target)
    np.testing.assert_allclose(least_squares_near(frame, others, target), usual, rtol=1e-7)
    near = solve_near(frame, others)
    np.testing.assert_allclose(near[0] @ (near[0].T @ target), basis @ (basis.T @ target), atol=1e-9)
    np.testing.assert_allclose(near[1] @ near[1].T, factor @ factor.T, rtol=1e-6)


def test_a_basis_spans_the_columns_and_no_more(columns):
    basis = span(columns)
    assert basis.shape == (len(columns), np.linalg.matrix_rank(columns))
    np.testing.assert_allclose(basis.T @ basis, np.eye(basis.shape[1]), atol=1e-12)
    np.testing.assert_allclose(off(basis, columns), 0.0, atol=1e-9 * np.abs(columns).max())


def test_nothing_spans_nothing():
    nothing = np.zeros((4, 0))
    assert span(nothing).shape == (4, 0)
    assert least_squares(nothing, np.ones(4))[0].shape == (0,)


@pytest.mark.parametrize("apart", [1.0, 0.05, 1e-3, 1e-7])
def test_a_basis_is_orthonormal_however_much_columns_are_alike(apart):
    columns = RNG.standard_normal((200, 1)) + apart * RNG.standard_normal((200, 8))
    basis = span(columns * 10.0 ** np.arange(-4, 4))
    np.testing.assert_allclose(basis.T @ basis, np.eye(8), atol=1e-9)
    np.testing.assert_allclose(off(basis, columns), 0.0, atol=1e-8)
