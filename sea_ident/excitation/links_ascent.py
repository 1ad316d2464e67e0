"""Designs whose limits hold for links on their springs, not only for the motors that play them.

From the design for theta = q, shrunk until the links are inside, the criterion is raised again: limits are linearised
at each trajectory, and as much of every ascent is taken as the true response allows.
"""

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.excitation.barrier import raise_inside
from sea_ident.excitation.elastic_limits import ElasticLimits
from sea_ident.excitation.elastic_wall import elastic_wall, wall_size
from sea_ident.excitation.information import Information
from sea_ident.excitation.problem import Problem
from sea_ident.excitation.starts import detailed
from sea_ident.excitation.walls import DynamicWall

_ROUNDS = 20
_STEPS = 30
# slopes of a wall, 400 MB
_LARGEST = 5e7
# gains, in units of the criterion's tolerance, that are not worth another round
_SMALL = 200.0
# of an ascent that leads outside: how much of it is tried, and how far that is shrunk toward rest
_PARTS = (1.0, 0.5, 0.25, 0.1, 0.04)
_SHRUNK = (1.0, 0.99, 0.96, 0.9)
# part of its range by which a limit is broken that so little shrinking does not mend
_FAR = 0.1
# factors by which the design for theta = q is shrunk in turn, and the smallest one that is tried in all
_SMALLER = 0.8
_LEAST_PART = 0.3
_SMALLEST = 1e-3


def keep_links_inside(
    problem: Problem, limits: ElasticLimits, coefficients: FloatArray, *, hurry: bool
) -> FloatArray | None:
    """Turn a design for theta = q into one whose links are inside all limits.

    Args:
        problem: what was raised, inside what.
        limits: limits of the links.
        coefficients: (n, 2 L + 1) design, inside for theta = q.
        hurry: whether shrinking it toward rest is to be enough. It is as well where the slopes of the limits would not
            fit into memory.

    Returns:
        (n, 2 L + 1) coefficients, those of the design if its links are inside; None if no trajectory was found. If
        interrupted from the keyboard, the best so far.
    """
    best = _shrunk(problem, limits, coefficients)
    if best is None or best is coefficients or hurry or wall_size(limits, problem.series(best)) > _LARGEST:
        return best
    information = detailed(problem, best)
    value, small = problem.value(information, best), 0
    try:
        for _ in range(_ROUNDS):
            found = _raised(problem, limits, information, best, value)
            if found is None:
                break
            gain, (value, best) = found[0] - value, found
            small = small + 1 if gain < _SMALL * problem.tolerance(problem.criterion) else 0
            if small == 2:
                break
    except KeyboardInterrupt:
        pass
    return best


def room(problem: Problem, limits: ElasticLimits, coefficients: FloatArray) -> float:
    """What motors and links leave of the limit that they come nearest to, as a part of its range; negative outside."""
    series = problem.series(coefficients)
    motors = float((problem.limits.margins(series) / problem.limits.width).min(initial=1.0))
    if motors < 0.0:
        return motors
    margins = limits.margins(series)
    return -np.inf if margins is None else float((margins / limits.sizes).min(initial=motors))


def _shrunk(problem: Problem, limits: ElasticLimits, coefficients: FloatArray) -> FloatArray | None:
    """A trajectory shrunk toward rest until it is inside."""
    factor, trial = 1.0, coefficients
    while factor > _SMALLEST:
        left = room(problem, limits, trial)
        if left >= 0.0:
            return trial
        # what moves about the middle of its range, in proportion, would just be inside
        factor *= max(_LEAST_PART, min(_SMALLER, 0.5 / (0.5 - left)))
        trial = problem.centre + factor * (coefficients - problem.centre)
    return None


def _raised(
    problem: Problem, limits: ElasticLimits, information: Information, point: FloatArray, value: float
) -> tuple[float, FloatArray] | None:
    """One ascent with limits linearised at a trajectory: criterion and coefficients, None if nothing is gained."""
    wall = elastic_wall(limits, problem.series(point), problem.centre)
    if wall is None:
        return None
    # those for theta = q would be about another torque
    walls = [wall, *(wall for wall in problem.walls if not isinstance(wall, DynamicWall))]
    end = raise_inside(
        information,
        problem.criterion,
        walls,
        problem.centre,
        point,
        iterations=_STEPS,
        barrier=1e-2,
        tolerance=problem.tolerance(problem.criterion),
    )
    for part in _PARTS:
        ahead = point + part * (end - point)
        for shrunk in _SHRUNK:
            trial = problem.centre + shrunk * (ahead - problem.centre)
            reached = problem.value(information, trial)
            if reached <= value:
                break
            left = room(problem, limits, trial)
            if left >= 0.0:
                return reached, trial
            if left < -_FAR:
                break
    return None
