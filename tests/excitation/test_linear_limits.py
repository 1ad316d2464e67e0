"""Limits hold for all t: extrema of trigonometric polynomials against dense grids and closed forms."""

import numpy as np
import pytest

import sea_ident.excitation.linear_limits as linear_limits_module
from sea_ident.exceptions import ExcitationError
from sea_ident.excitation.linear_limits import linear_limits, stationary_points
from sea_ident.motion import FourierSeries, fourier_basis


def random_series(n, harmonics, seed, frequency=0.1):
    rng = np.random.default_rng(seed)
    return FourierSeries(
        frequency, rng.normal(size=n), rng.normal(size=(n, harmonics)), rng.normal(size=(n, harmonics))
    )


@pytest.mark.parametrize("harmonics", [1, 2, 5, 10, 25])
@pytest.mark.parametrize("derivative", [0, 1, 2, 3])
def test_extremes_bound_a_dense_grid_and_are_reached(harmonics, derivative):
    series = random_series(4, harmonics, seed=harmonics)
    low, high, which, time = stationary_points(series, np.full(4, derivative))
    dense = series.evaluate(np.linspace(0.0, 10.0, 40_001), derivative)
    scale = np.abs(dense).max()
    assert np.all(dense.max(axis=0) <= high + 1e-12 * scale)
    assert np.all(dense.min(axis=0) >= low - 1e-12 * scale)
    # the grid misses a peak by at most an eighth of the square of its step times the curvature
    bend = np.abs(series.evaluate(np.linspace(0.0, 10.0, 4001), derivative + 2)).max()
    miss = (10.0 / 40_000) ** 2 / 8.0 * bend * 1.1
    np.testing.assert_allclose(dense.max(axis=0), high, atol=miss)
    np.testing.assert_allclose(dense.min(axis=0), low, atol=miss)
    slope = series.evaluate(time, derivative + 1)[np.arange(len(time)), which]
    assert np.abs(slope).max() <= 1e-5 * np.abs(series.evaluate(time, derivative + 1)).max()


def test_extremes_of_a_known_polynomial():
    """cos x + cos 2x: largest 2 at 0, smallest -9/8 where cos x = -1/4."""
    series = FourierSeries(1.0 / (2.0 * np.pi), np.array([0.5]), np.zeros((1, 2)), -np.array([[1.0, 2.0]]))
    low, high, _, _ = stationary_points(series, np.array([0]))
    assert high[0] == pytest.approx(2.5, abs=1e-14)
    assert low[0] == pytest.approx(0.5 - 9.0 / 8.0, abs=1e-14)


@pytest.mark.parametrize("coefficients", [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0, 1e-14, 0.0]])
def test_extremes_where_harmonics_vanish(coefficients):
    series = FourierSeries(1.0 / (2.0 * np.pi), np.array([0.0]), np.zeros((1, 3)), -np.array([coefficients]))
    low, high, _, _ = stationary_points(series, np.array([1]))
    assert high[0] == pytest.approx(max(coefficients), abs=1e-12)
    assert low[0] == pytest.approx(-max(coefficients), abs=1e-12)


@pytest.mark.parametrize("kind", ["random", "nearly smooth", "one wave", "still"])
@pytest.mark.parametrize("harmonics", [3, 12, 45])
def test_isolated_roots_are_those_of_the_companion_matrix(monkeypatch, harmonics, kind):
    """Two independent ways to the extrema, for any number of harmonics."""
    series = random_series(6, harmonics, seed=harmonics)
    gain = {"random": 1.0, "nearly smooth": 1e-9, "one wave": 0.0, "still": 0.0}[kind]
    a, b = series.a.copy(), series.b.copy()
    a[:, harmonics // 2 :] *= gain
    b[:, 1:] *= gain
    a[:, 0] *= kind != "still"
    a[:, 1:] *= kind != "one wave" and kind != "still"
    b[:, 0] *= kind != "one wave" and kind != "still"
    series = FourierSeries(0.1, series.offset, a, b)
    derivative = np.array([0, 1, 2, 3, 0, 2])
    found = []
    for companion in (harmonics, harmonics - 1):
        monkeypatch.setattr(linear_limits_module, "_COMPANION", companion)
        low, high, _, _ = stationary_points(series, derivative)
        found.append((low, high))
    for one, other in zip(*found, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-12 * np.ptp(found[0], axis=0).max() + 1e-15)


def test_flat_extremum():
    """cos x - cos(2x)/4 is flat to fourth order at its largest value: 3 cos x/4 ... its slope has a threefold root."""
    series = FourierSeries(1.0 / (2.0 * np.pi), np.zeros(1), np.zeros((1, 2)), np.array([[-1.0, 0.5]]))
    phase = np.linspace(-np.pi, np.pi, 100_001)
    dense = np.cos(phase) - np.cos(2 * phase) / 4.0
    low, high, _, _ = stationary_points(series, np.array([0]))
    assert high[0] >= dense.max() - 1e-14
    assert high[0] == pytest.approx(0.75, abs=1e-12)
    assert low[0] == pytest.approx(-1.25, abs=1e-12)


def test_limits_of_exo_leg(robot_of):
    robot = robot_of("exo_leg")
    limits = linear_limits(robot, robot.limits)
    assert limits.names[-1] == "hip_knee_sum"
    assert len(limits) == 10
    series = random_series(3, 4, seed=1)
    time = np.linspace(0.0, 10.0, 20_001)
    hip, knee = series.evaluate(time)[:, :2].T
    expected = (hip + knee).min() - 0.1
    assert limits.margins(series)[-1] == pytest.approx(expected, abs=1e-5)
    k = limits.names.index("knee.acceleration")
    fastest = np.abs(series.evaluate(time, 2)[:, 1]).max()
    assert limits.margins(series)[k] == pytest.approx(1.5 * np.pi - fastest, abs=1e-5)


def test_rows_are_the_limited_values(robot_of):
    robot = robot_of("exo_leg")
    limits = linear_limits(robot, robot.limits)
    series = random_series(3, 4, seed=2)
    which, time = np.array([0, 4, 8, 9]), np.array([0.3, 1.7, 4.0, 9.0])
    values = limits.rows((0.1, 4), which, time) @ series.coefficients.ravel()
    basis = [fourier_basis(time, 0.1, 4, order) @ series.coefficients.T for order in range(3)]
    expected = [basis[0][0, 0], basis[1][1, 1], basis[2][2, 2], basis[0][3, 0] + basis[0][3, 1]]
    np.testing.assert_allclose(values, expected, atol=1e-12)


@pytest.mark.parametrize(
    ("field", "value", "says"),
    [
        ("lower", np.nan, "hip.position: is NaN"),
        ("lower", 2.0, "hip.position: lower limit 2 rad is above"),
        ("velocity", 0.0, "hip.velocity: the range is zero"),
        ("acceleration", np.nan, "hip.acceleration: is NaN"),
    ],
)
def test_limits_that_cannot_be_used(robot_of, field, value, says):
    robot = robot_of("exo_leg")
    values = getattr(robot.limits, field).copy()
    values[0] = value
    with pytest.raises(ExcitationError, match=says):
        linear_limits(robot, robot.limits.replace(**{field: values}))


def test_zero_position_range(robot_of):
    robot = robot_of("exo_leg")
    lower = robot.limits.lower.copy()
    lower[0] = robot.limits.upper[0]
    with pytest.raises(ExcitationError, match=r"hip.position: the range is zero .* Lock the joint"):
        linear_limits(robot, robot.limits.replace(lower=lower))
