"""What a motion does not tell of the columns of a spring, and what only a rest that it does not show tells."""

import numpy as np
import pytest

from sea_ident.estimation.solve import solve_across
from sea_ident.estimation.spring_untold import told_by_rest, untold
from sea_ident.exceptions import IdentificationError

TIME = np.linspace(0.0, 1.0, 200, endpoint=False)
DEFLECTION = 0.05 * np.sin(2.0 * np.pi * TIME)
LAW = np.column_stack([DEFLECTION, DEFLECTION**3, np.gradient(DEFLECTION)])
OWNERS = ["the stiffness", "the cubic stiffness", "the damping", "friction", "friction", "the zero"]


def gram(*columns):
    table = np.column_stack([LAW, *columns])
    table = table / np.linalg.norm(table, axis=0)
    return table.T @ table


def test_columns_of_one_effect_may_be_the_same():
    other = np.sign(DEFLECTION)
    direction = untold("knee", gram(other, 3.0 * other), OWNERS)[:, 0]
    np.testing.assert_allclose(np.abs(direction), [0.0, 0.0, 0.0, 0.5**0.5, 0.5**0.5], atol=1e-6)
    assert untold("knee", gram(other, other**2 + DEFLECTION), OWNERS).shape == (5, 0)


def test_those_of_different_ones_must_not():
    with pytest.raises(IdentificationError, match="does not tell the stiffness and friction of its spring apart"):
        untold("knee", gram(2.0 * DEFLECTION, np.sign(DEFLECTION)), OWNERS)


def test_what_is_the_law_but_for_a_constant_may_be_all_of_it():
    columns = np.column_stack([LAW, 20.0 * (DEFLECTION - 0.01), np.sign(DEFLECTION), np.ones(200)])
    off = told_by_rest(columns, np.array([200.0, 0.0, 1.0, 3.0, 2.0, 1.0]))
    np.testing.assert_allclose(off, [[-60.0], [0.0], [0.0], [3.0], [0.0], [0.0]], atol=1e-6)


def test_a_law_alone_has_nothing_to_rest():
    assert told_by_rest(LAW, np.ones(3)).shape == (3, 0)


def test_what_is_not_told_takes_no_part_in_a_solution():
    """Not even where rounding, or noise on the right, points that way."""
    basis = np.linalg.qr(np.random.default_rng(0).normal(size=(4, 4)))[0]
    nothing = basis[:, :1]
    gram = basis[:, 1:] @ np.diag([1.0, 2.0, 3.0]) @ basis[:, 1:].T + 1e-15 * nothing @ nothing.T
    exact = basis[:, 1:] @ np.array([1.0, -2.0, 0.5])
    found = solve_across(gram, gram @ exact + 0.1 * nothing[:, 0], nothing)
    np.testing.assert_allclose(found, exact, atol=1e-12)
