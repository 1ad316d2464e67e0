"""Steps inside linearised walls reach the optimum of the quadratic program; corrected ones follow bent walls."""

import numpy as np
import pytest

from sea_ident.excitation.model_step import Side, StepProblem
from sea_ident.excitation.quadratic import solve_quadratic
from sea_ident.excitation.walls import DynamicTangent


def side(slack, barrier):
    slack = np.atleast_2d(slack)
    return Side(0, 1.0, np.ones_like(slack), np.zeros_like(slack), slack, barrier / slack, np.ones_like(slack))


@pytest.mark.parametrize("seed", range(3))
def test_step_is_that_of_the_quadratic_program(seed):
    rng = np.random.default_rng(seed)
    v, rows = 8, 30
    root, normals = rng.normal(size=(v, v)), rng.normal(size=(rows, v))
    curvature, gradient, slack = root @ root.T + np.eye(v), 20.0 * rng.normal(size=v), 0.1 + rng.random(rows)
    problem = StepProblem(gradient, curvature, {0: DynamicTangent(normals[None])}, [side(slack, 1e-2)], (2, 4))
    found = problem.solve(1e-2)
    best, _ = solve_quadratic(curvature, -gradient, normals, np.full(rows, -np.inf), slack)

    def gain(step):
        return gradient @ step - 0.5 * step @ curvature @ step

    assert np.all(normals @ found.step < slack)
    np.testing.assert_allclose(found.slacks[0][0], slack - normals @ found.step, atol=1e-12)
    # what the barrier keeps is at most its weight times the number of walls, twice for multipliers not yet converged
    assert gain(best) - gain(found.step) <= 2.0 * rows * found.barrier
    assert gain(found.step) <= gain(best) + 1e-6


def test_a_wall_that_is_touched_stops_the_step_toward_it_alone():
    """Its curvature is beyond all digits of the others: the step along it is exact all the same."""
    slack = np.array([1e-10, 10.0])
    problem = StepProblem(np.ones(2), np.eye(2), {0: DynamicTangent(np.eye(2)[None])}, [side(slack, 1e-2)], (1, 2))
    found = problem.solve(1e-2)
    assert abs(found.step[0]) < 2.0 * slack[0]
    assert found.step[1] == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize("angle", [0.0, 0.5, 1.0])
def test_correction_follows_a_bent_wall(angle):
    """Along the inside of a cylinder, x^2 + y^2 <= 1: shrinking toward the middle would cost height."""
    here = np.array([0.97 * np.cos(angle), 0.97 * np.sin(angle), 2.0])
    gradient, barrier = np.array([np.cos(angle) - np.sin(angle), np.sin(angle) + np.cos(angle), 1.0]), 1e-3

    def slack(x):
        return 1.0 - float(x[:2] @ x[:2])

    def gain(x):
        """Of what is left when the end is shrunk toward the middle until it is inside."""
        x = x / max(1.0, float(np.linalg.norm(x[:2])))
        return gradient @ (x - here) - (x - here) @ (x - here)

    tangents = {0: DynamicTangent(2.0 * np.append(here[:2], 0.0)[None, None, :])}
    problem = StepProblem(gradient, 2.0 * np.eye(3), tangents, [side(slack(here), barrier)], (1, 3))
    found = problem.solve(barrier)
    outside = slack(here + found.step)
    assert outside < 0.0
    corrected = problem.correct(found, [side(outside, barrier)])
    assert slack(here + corrected) > 0.1 * outside
    assert gain(here + corrected) > gain(here + found.step) > 0.0
