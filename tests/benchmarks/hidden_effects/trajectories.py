"""Random Fourier trajectories inside the limits, the best of a few by the determinant of the base regressor."""

from functools import cache

import numpy as np

from sea_ident.base_parameters import find_base_parameters
from sea_ident.effects import base_effects
from sea_ident.motion import FourierSeries
from sea_ident.regressor import build_regressor
from tests.benchmarks.hidden_effects.case import FloatArray
from tests.benchmarks.hidden_effects.plants import nominal_robot, source_of

HARMONICS = 5
MARGIN = 0.95


@cache
def _base_columns(name: str) -> FloatArray:
    robot = nominal_robot(name)
    return find_base_parameters(robot, base_effects(robot)).independent


def draw_trajectory(
    name: str, period: float, rng: np.random.Generator, *, weak: bool = False, candidates: int = 16
) -> FourierSeries:
    """A trajectory inside all linear limits.

    Args:
        name: robot.
        period: [s].
        rng: random numbers.
        weak: two harmonics and a quarter of the amplitude; the first that is drawn.
        candidates: how many are drawn to choose the best from.

    Returns:
        The series.
    """
    best, best_score = None, -np.inf
    for _ in range(1 if weak else candidates):
        series = _draw(name, period, rng, weak)
        score = 0.0 if weak else _score(name, series)
        if score > best_score:
            best, best_score = series, score
    assert best is not None
    return best


def _draw(name: str, period: float, rng: np.random.Generator, weak: bool) -> FourierSeries:
    robot, how = nominal_robot(name), source_of(name)
    limits, n = robot.limits, robot.n
    harmonics = 2 if weak else HARMONICS
    order = np.arange(1, harmonics + 1)
    a, b = (rng.standard_normal((n, harmonics)) * order**0.3 for _ in range(2))
    lower, upper = np.maximum(limits.lower, -np.pi), np.minimum(limits.upper, np.pi)
    wave = FourierSeries(1.0 / period, np.zeros(n), a, b)
    time = np.linspace(0.0, period, 400, endpoint=False)
    shapes = [wave.evaluate(time, d) for d in range(3)]
    velocity = MARGIN * np.minimum(limits.velocity, how.velocity)
    acceleration = MARGIN * np.minimum(limits.acceleration, how.acceleration)
    reach = np.minimum((upper - lower) / 2.0, how.reach)
    span = np.ptp(shapes[0], axis=0) / 2.0
    scale = np.min(
        [
            MARGIN * reach / span,
            velocity / np.abs(shapes[1]).max(axis=0),
            acceleration / np.abs(shapes[2]).max(axis=0),
        ],
        axis=0,
    )
    scale *= 0.25 if weak else rng.uniform(0.8, 1.0, n)
    middle = (shapes[0].max(axis=0) + shapes[0].min(axis=0)) / 2.0
    for _ in range(200):
        slack = MARGIN * ((upper - lower) / 2.0) - scale * span
        centre = (upper + lower) / 2.0 + np.maximum(slack, 0.0) * rng.uniform(-1.0, 1.0, n)
        offset = centre - scale * middle
        series = FourierSeries(1.0 / period, offset, a * scale[:, None], b * scale[:, None])
        sums = (offset + scale * shapes[0]) @ limits.combinations.T
        if np.all(sums >= limits.combination_lower) and np.all(sums <= limits.combination_upper):
            return series
        scale = scale * 0.985
    return series


def _score(name: str, series: FourierSeries) -> float:
    robot = nominal_robot(name)
    rows = build_regressor(robot, base_effects(robot), series.sample(samples=60)).sum
    matrix = rows.reshape(-1, rows.shape[2])[:, _base_columns(name)]
    matrix = matrix / np.maximum(np.linalg.norm(matrix, axis=0), 1e-9) ** 0.5
    return float(np.linalg.slogdet(matrix.T @ matrix)[1])
