"""Whether limits can hold together, a point well inside them, and random starts.

A trajectory that keeps limits which are linear in the coefficients keeps them on average, and the average is a
constant: if any trajectory is inside, one at rest is. So feasibility is a linear program in the n positions.
"""

import numpy as np
from scipy.optimize import linprog

from sea_ident._typing import FloatArray, IntArray
from sea_ident.exceptions import InfeasibleError
from sea_ident.excitation.ascent import Problem, constrained_step, grid_cuts, pull_inside
from sea_ident.excitation.linear_limits import LinearLimits


def _one_sided(limits: LinearLimits) -> tuple[FloatArray, FloatArray, IntArray]:
    """Position limits at rest as ``rows q <= bounds`` with the limit that each row belongs to."""
    position = np.flatnonzero(limits.derivative == 0)
    rows, bounds, owner = [], [], []
    for k in position:
        if np.isfinite(limits.upper[k]):
            rows.append(limits.joints[k])
            bounds.append(limits.upper[k])
            owner.append(int(k))
        if np.isfinite(limits.lower[k]):
            rows.append(-limits.joints[k])
            bounds.append(-limits.lower[k])
            owner.append(int(k))
    n = limits.joints.shape[1]
    return np.array(rows).reshape(len(rows), n), np.array(bounds), np.array(owner, dtype=np.intp)


def inner_point(limits: LinearLimits) -> FloatArray:
    """The position at rest that is furthest inside, relative to the range of each limit.

    Args:
        limits: the limits.

    Returns:
        (n,) position.

    Raises:
        InfeasibleError: the limits exclude each other; names a smallest set of them and the slack that it needs.
    """
    rows, bounds, owner = _one_sided(limits)
    n = limits.joints.shape[1]
    width = limits.width[owner]
    # maximise s with rows q + s width <= bounds, s <= 1/2
    program = linprog(
        np.append(np.zeros(n), -1.0),
        A_ub=np.column_stack([rows, width]) if len(rows) else None,
        b_ub=bounds if len(rows) else None,
        bounds=[(None, None)] * n + [(None, 0.5)],
    )
    if program.status != 0 or program.x[-1] <= 1e-9:
        raise InfeasibleError(_conflict(limits, rows, bounds, owner))
    point: FloatArray = np.asarray(program.x[:n], dtype=np.float64)
    return point


def _slack(rows: FloatArray, bounds: FloatArray) -> float:
    """Smallest s so that rows q <= bounds + s has a solution."""
    n = rows.shape[1]
    program = linprog(
        np.append(np.zeros(n), 1.0),
        A_ub=np.column_stack([rows, -np.ones(len(rows))]),
        b_ub=bounds,
        bounds=[(None, None)] * n + [(-1.0, None)],
    )
    return float(program.x[-1]) if program.status == 0 else -1.0


def _conflict(limits: LinearLimits, rows: FloatArray, bounds: FloatArray, owner: IntArray) -> str:
    """Which limits exclude each other, by leaving out one after the other."""
    kept = sorted({int(k) for k in owner})
    for k in list(kept):
        rest = [other for other in kept if other != k]
        take = np.isin(owner, rest)
        if rest and _slack(rows[take], bounds[take]) > -1e-9:
            kept = rest
    take = np.isin(owner, kept)
    slack = max(_slack(rows[take], bounds[take]), 0.0)
    unit = limits.units[kept[0]]
    described = ", ".join(
        f"{limits.names[k]} in [{limits.lower[k]:.6g}, {limits.upper[k]:.6g}] {limits.units[k]}" for k in kept
    )
    return (
        f"no trajectory satisfies these limits together: {described}. Widen each by more than {slack:.4g} {unit}, "
        f"or leave one out"
    )


def random_start(problem: Problem, centre: FloatArray, generator: np.random.Generator) -> FloatArray:
    """A random trajectory inside all limits.

    Args:
        problem: the limits.
        centre: (n,) position well inside.
        generator: of the random numbers.

    Returns:
        (n, 2 L + 1) coefficients.
    """
    n, width = problem.shape
    harmonics = (width - 1) // 2
    rest = np.zeros((n, width))
    rest[:, -1] = centre
    omega = 2.0 * np.pi * problem.information.base_frequency * np.arange(1, harmonics + 1)
    reach = _reach(problem.limits, n)
    wish = generator.normal(size=(n, width))
    wish[:, :-1] *= 0.5 * reach[:, None] * np.tile(np.minimum(omega, omega[-1] / 3.0), 2) / np.sqrt(harmonics)
    wish[:, -1] = centre + 0.2 * reach * wish[:, -1]
    return repair(problem, rest, wish)


def repair(problem: Problem, rest: FloatArray, wish: FloatArray) -> FloatArray:
    """The trajectory inside all limits that is nearest to a wish.

    Args:
        problem: the limits.
        rest: (n, 2 L + 1) a trajectory well inside.
        wish: (n, 2 L + 1) a trajectory that may be outside.

    Returns:
        (n, 2 L + 1) coefficients.
    """
    harmonics = problem.information.harmonics
    cuts = grid_cuts(problem, 2 * harmonics + 2)
    # near in velocity, with the mean position counted like the slowest harmonic
    weight = np.ones(problem.shape)
    weight[:, -1] = (2.0 * np.pi * problem.information.base_frequency) ** 2
    hessian = np.diag(weight.ravel())
    step, _ = constrained_step(cuts, rest, (weight * (wish - rest)).ravel(), hessian)
    move = step.reshape(rest.shape)
    return rest + 0.999 * pull_inside(problem, rest, rest + move) * move


def _reach(limits: LinearLimits, n: int) -> FloatArray:
    """(n,) width of the position range of each joint."""
    reach = np.full(n, 2.0 * np.pi)
    for k in range(len(limits)):
        if limits.derivative[k] == 0 and np.count_nonzero(limits.joints[k]) == 1:
            i = int(np.argmax(limits.joints[k] != 0.0))
            reach[i] = min(reach[i], float(limits.width[k]))
    return reach
