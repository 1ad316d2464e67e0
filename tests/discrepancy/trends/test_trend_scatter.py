"""Scatter of the periods along the columns of trends: what it is, and what a trend is worth in it."""

from dataclasses import replace

import numpy as np
import pytest

from sea_ident.discrepancy.trends.trend_directions import Direction
from sea_ident.discrepancy.trends.trend_scatter import gain, held_basis, scatter_p, scatter_whitener
from sea_ident.effects import make_effect

LEVEL = 0.05
DRAWS = 1000


def direction(rng, periods, size, width=2, columns=None, joint="hip"):
    time = np.linspace(0.0, 1.0, periods)
    profile, square = time - time.mean(), -(time**2) - np.mean(-(time**2))
    if columns is None:
        columns = rng.standard_normal((size, width)) @ np.array([[1.0, 0.9], [0.0, 0.4]])[:width, :width]
    each = np.broadcast_to(columns, (periods, *columns.shape))
    return Direction(make_effect("friction_drift", joint), profile, each, square)


def put(own, values):
    return own.profile[:, None] * (own.columns @ values)


def test_size_of_the_test_by_scatter():
    """Without any trend, but noise that is large and correlated along the columns: 5 % at 5 %."""
    rng = np.random.default_rng(11)
    own = direction(rng, 10, 30)
    basis, mixing = np.linalg.qr(own.columns[0])[0], np.array([[30.0, 0.0], [25.0, 4.0]])
    rejected = 0
    for _ in range(DRAWS):
        flat = rng.standard_normal((10, 30)) + rng.standard_normal((10, 2)) @ mixing.T @ basis.T
        rejected += scatter_p(flat - flat.mean(axis=0), own) < LEVEL
    assert 0.03 < rejected / DRAWS < 0.07


def test_size_of_the_test_beside_another_trend():
    """The other is large, shares half of the columns, and has another course than it is given."""
    rng = np.random.default_rng(12)
    own = direction(rng, 12, 20, 1)
    other = direction(rng, 12, 20, columns=own.columns[0] + rng.standard_normal((20, 1)), joint="knee")
    course = other.profile + 0.3 * other.bend
    rejected = 0
    for _ in range(DRAWS):
        flat = rng.standard_normal((12, 20)) + 100.0 * course[:, None] * (other.columns @ [1.0])
        rejected += scatter_p(flat - flat.mean(axis=0), own, [other]) < LEVEL
    # the bend of the other counts as lost in full, where it takes half: rather too rare than too often
    assert 0.01 < rejected / DRAWS < 0.07


def test_power_of_the_test_by_scatter():
    rng = np.random.default_rng(13)
    own = direction(rng, 10, 30)
    trend = put(own, [2.0, 0.0])
    found = [scatter_p(rng.standard_normal((10, 30)) + trend, own) for _ in range(50)]
    assert np.mean(np.array(found) < 1e-3) > 0.9


def test_gain_of_an_exact_trend():
    own = direction(np.random.default_rng(14), 8, 20)
    flat = put(own, [2.0, 3.0])
    amount, used = gain(flat, own)
    assert amount == pytest.approx(np.sum(flat**2))
    assert used == (0, 1)


def test_one_cause_does_not_change_its_columns_in_opposite_ways():
    own = direction(np.random.default_rng(15), 8, 20)
    flat = put(own, [2.0, -3.0])
    amount, used = gain(flat, own)
    assert len(used) == 1
    assert amount < 0.9 * np.sum(flat**2)


def test_a_course_that_is_not_that_of_the_library_leaves_nothing_to_another_trend():
    """Half straight, half bent: without its bend beside it, the rest would go to what shares its columns."""
    rng = np.random.default_rng(16)
    own = direction(rng, 12, 20, 1)
    other = direction(rng, 12, 20, columns=own.columns[0] + 0.1 * rng.standard_normal((20, 1)), joint="knee")
    other = replace(other, profile=own.bend)
    flat = 5.0 * (own.profile + 0.5 * own.bend)[:, None] * (own.columns @ [1.0])
    assert gain(flat, other)[0] > 1.0
    assert gain(flat, other, held_basis([own]))[0] < 1e-9 * np.sum(flat**2)


def test_white_scatter_stays_as_it_is():
    rng = np.random.default_rng(17)
    middle = np.arange(20) + 0.5
    changed = [
        np.abs(np.linalg.eigvalsh(scatter_whitener(rng.standard_normal((20, 12)), middle)) - 1.0).max() > 1e-9
        for _ in range(100)
    ]
    # the largest of all that chance gives lies about the edge: what goes beyond it is little
    assert np.mean(changed) < 0.4


def test_scatter_along_one_direction_is_taken_to_unit_variance_and_trends_are_none():
    """Noise of fivefold amplitude along one direction, and trends of any size along all, which must not count."""
    rng = np.random.default_rng(18)
    middle = np.arange(20) + 0.5
    axis = np.linalg.qr(rng.standard_normal((8, 1)))[0]
    sizes = []
    for _ in range(100):
        trend = 50.0 * np.outer(-np.expm1(-middle / 30.0), rng.standard_normal(8))
        periods = rng.standard_normal((20, 8)) + 5.0 * rng.standard_normal((20, 1)) @ axis.T + trend
        whitener = scatter_whitener(periods, middle)
        sizes.append(float(np.squeeze(axis.T @ whitener @ axis)))
    assert np.median(sizes) == pytest.approx(1.0 / np.sqrt(26.0), rel=0.2)
