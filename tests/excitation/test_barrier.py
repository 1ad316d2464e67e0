"""A criterion raised inside walls, wherever it begins."""

from dataclasses import dataclass, field

import numpy as np
import pytest

import sea_ident
from sea_ident.excitation import DOptimality, reduced_effects
from sea_ident.excitation.barrier import place_inside, raise_inside
from sea_ident.excitation.defaults import default_limits
from sea_ident.excitation.design_model import design_model
from sea_ident.excitation.feasibility import random_start
from sea_ident.excitation.problem import Problem
from sea_ident.excitation.states import Sampling


@dataclass(frozen=True)
class Singular(DOptimality):
    """The criterion of a start at which a parameter does not show: minus infinity the first time."""

    asked: list = field(default_factory=list)

    def value(self, matrix):
        self.asked.append(matrix)
        return super().value(matrix) if len(self.asked) > 1 else -np.inf


@pytest.mark.parametrize("kind", [DOptimality, Singular])
def test_an_ascent_leaves_where_it_begins_even_where_a_parameter_does_not_show(kind):
    criterion = kind()
    robot = sea_ident.load_robot("exo_leg")
    model, _ = design_model(robot, reduced_effects(robot), DOptimality(), None)
    limits = default_limits(robot, robot.limits, [])
    problem = Problem.of(
        robot, model, criterion, limits, Sampling(0.1, 3, 60), noise=None, collected=None, seed=0, notes=[]
    )
    start = random_start(problem.limits, 0.1, problem.centre, np.random.default_rng(0))
    middle = [wall.values(problem.centre) for wall in problem.walls]
    inside = next(
        point
        for point in (problem.centre + 0.8**k * (start - problem.centre) for k in range(30))
        if place_inside(problem.walls, middle, problem.centre, point) is not None
    )
    information = problem.coarse(60, np.full(robot.n, 0.3))
    values = []
    end = raise_inside(
        information, criterion, problem.walls, problem.centre, inside, iterations=3,
        report=lambda value, _: bool(values.append(value)),
    )  # fmt: skip
    assert np.all(np.isfinite(values))
    assert DOptimality().value(information.matrix(end)) > DOptimality().value(information.matrix(inside))
