"""Whether linear limits can hold together, a position well inside them, and trajectories repaired into them.

A trajectory that keeps limits which are linear in the coefficients keeps them on average, and the average is a
constant: if any trajectory is inside, one at rest is. So their feasibility is a linear program in the n positions.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog

from sea_ident._typing import FloatArray, IntArray
from sea_ident.exceptions import InfeasibleError
from sea_ident.excitation.linear_limits import LinearLimits
from sea_ident.excitation.quadratic import solve_quadratic
from sea_ident.motion import FourierSeries

_CUT_ROUNDS = 3
# harmonics that a random start has at most, and with which a trajectory is repaired by a QP
_DRAWN = 30


@dataclass(frozen=True, eq=False)
class RestLimits:
    """The limits of a robot at rest, as ``rows q <= bounds``.

    Attributes:
        rows: (k, n).
        bounds: (k,).
        owner: (k,) limit that each row belongs to.
    """

    rows: FloatArray
    bounds: FloatArray
    owner: IntArray

    @staticmethod
    def of(limits: LinearLimits) -> "RestLimits":
        """Those on positions; velocities and accelerations are zero at rest."""
        rows, bounds, owner = [], [], []
        for k in np.flatnonzero(limits.derivative == 0):
            for sign, bound in ((1.0, limits.upper[k]), (-1.0, limits.lower[k])):
                if np.isfinite(bound):
                    rows.append(sign * limits.joints[k])
                    bounds.append(sign * bound)
                    owner.append(int(k))
        n = limits.joints.shape[1]
        return RestLimits(np.array(rows).reshape(len(rows), n), np.array(bounds), np.array(owner, dtype=np.intp))

    def slack(self, chosen: NDArray[np.bool_]) -> float:
        """Smallest s so that the chosen rows hold with ``bounds + s``; at least -1."""
        rows, n = self.rows[chosen], self.rows.shape[1]
        program = linprog(
            np.append(np.zeros(n), 1.0),
            A_ub=np.column_stack([rows, -np.ones(len(rows))]),
            b_ub=self.bounds[chosen],
            bounds=[(None, None)] * n + [(-1.0, None)],
        )
        return float(program.x[-1])

    def conflict(self) -> IntArray:
        """A smallest set of limits that exclude each other: none of it can be left out."""
        kept = np.unique(self.owner)
        for k in list(kept):
            rest = kept[kept != k]
            if len(rest) and self.slack(np.isin(self.owner, rest)) > -1e-9:
                kept = rest
        return kept


def inner_position(limits: LinearLimits) -> FloatArray:
    """The position at rest that is furthest inside, relative to the range of each limit.

    Args:
        limits: the limits.

    Returns:
        (n,) position.

    Raises:
        InfeasibleError: the limits exclude each other; names a smallest set of them and the slack that it needs.
    """
    rest = RestLimits.of(limits)
    n = limits.joints.shape[1]
    if not len(rest.rows):
        return np.zeros(n)
    # maximise s with rows q + s width <= bounds, s <= 1/2
    program = linprog(
        np.append(np.zeros(n), -1.0),
        A_ub=np.column_stack([rest.rows, limits.width[rest.owner]]),
        b_ub=rest.bounds,
        bounds=[(None, None)] * n + [(None, 0.5)],
    )
    if program.status != 0 or program.x[-1] <= 1e-9:
        kept = rest.conflict()
        slack = max(rest.slack(np.isin(rest.owner, kept)), 0.0)
        described = ", ".join(
            f"{limits.names[k]} in [{limits.lower[k]:.6g}, {limits.upper[k]:.6g}] {limits.units[k]}" for k in kept
        )
        raise InfeasibleError(
            f"no trajectory satisfies these limits together: {described}. Widen each by more than {slack:.4g} "
            f"{limits.units[int(kept[0])]}, or leave one out"
        )
    # centred in what is left free, with the same reserve everywhere
    middle = linprog(
        np.append(np.zeros(n), -np.ones(len(rest.rows))),
        A_ub=np.column_stack([rest.rows, np.diag(limits.width[rest.owner])]),
        b_ub=rest.bounds,
        bounds=[(None, None)] * n + [(0.999 * program.x[-1], 0.5)] * len(rest.rows),
    )
    position: FloatArray = np.asarray((middle if middle.status == 0 else program).x[:n], dtype=np.float64)
    return position


def at_rest(position: FloatArray, harmonics: int) -> FloatArray:
    """(n, 2 L + 1) coefficients of a trajectory that stays at a position."""
    coefficients = np.zeros((len(position), 2 * harmonics + 1))
    coefficients[:, -1] = position
    return coefficients


def random_start(
    limits: LinearLimits, base_frequency: float, centre: FloatArray, generator: np.random.Generator
) -> FloatArray:
    """A random trajectory inside all linear limits.

    Args:
        limits: the limits.
        base_frequency: of the series [Hz].
        centre: (n, 2 L + 1) a trajectory at rest, well inside.
        generator: of the random numbers.

    Returns:
        (n, 2 L + 1) coefficients.
    """
    harmonics = (centre.shape[1] - 1) // 2
    if harmonics > _DRAWN:
        # the faster ones are left to the ascent
        slow = np.concatenate([centre[:, :_DRAWN], centre[:, harmonics : harmonics + _DRAWN], centre[:, -1:]], axis=1)
        slow = random_start(limits, base_frequency, slow, generator)
        start = np.zeros(centre.shape)
        start[:, :_DRAWN], start[:, harmonics : harmonics + _DRAWN] = slow[:, :_DRAWN], slow[:, _DRAWN:-1]
        start[:, -1] = slow[:, -1]
        return start
    omega = 2.0 * np.pi * base_frequency * np.arange(1, harmonics + 1)
    reach = limits.joint_width()
    wish = generator.normal(size=centre.shape)
    wish[:, :-1] *= 0.5 * reach[:, None] * np.tile(np.minimum(omega, omega[-1] / 3.0), 2) / np.sqrt(harmonics)
    wish[:, -1] = centre[:, -1] + 0.2 * reach * wish[:, -1]
    return repair(limits, base_frequency, centre, wish)


def repair(limits: LinearLimits, base_frequency: float, centre: FloatArray, wish: FloatArray) -> FloatArray:
    """The trajectory inside all linear limits that is nearest to a wish, by one QP (with cuts at its extrema).

    With many harmonics the QP would take minutes; the wish is then shrunk toward rest.

    Args:
        limits: the limits.
        base_frequency: of the series [Hz].
        centre: (n, 2 L + 1) a trajectory at rest, well inside.
        wish: (n, 2 L + 1) a trajectory that may be outside.

    Returns:
        (n, 2 L + 1) coefficients.
    """
    harmonics = (centre.shape[1] - 1) // 2
    points = 2 * harmonics + 2
    count = len(limits)
    period = 1.0 / base_frequency
    which = np.repeat(np.arange(count), points)
    time = (np.tile(np.arange(points), count) + np.repeat(np.arange(count) / max(count, 1), points)) * period / points
    # near in velocity, with the mean position counted like the slowest harmonic
    weight = np.ones(centre.shape)
    weight[:, -1] = (2.0 * np.pi * base_frequency) ** 2
    found, factor = wish, 1.0
    if harmonics > _DRAWN:
        factor = shrink(limits, FourierSeries.from_coefficients(wish, base_frequency), centre[:, -1])
    for _ in range(_CUT_ROUNDS if harmonics <= _DRAWN else 0):
        rows = limits.rows((base_frequency, harmonics), which, time)
        present = rows @ centre.ravel()
        step, _ = solve_quadratic(
            np.diag(weight.ravel()),
            -(weight * (wish - centre)).ravel(),
            rows,
            limits.lower[which] - present,
            limits.upper[which] - present,
            accuracy=1e-6,
        )
        found = centre + step.reshape(centre.shape)
        series = FourierSeries.from_coefficients(found, base_frequency)
        factor = shrink(limits, series, centre[:, -1])
        if factor > 0.99:
            break
        _, _, extreme, when = limits.extremes(series)
        level = limits.rows((base_frequency, harmonics), extreme, when) @ found.ravel()
        outside = (level > limits.upper[extreme]) | (level < limits.lower[extreme])
        which, time = np.concatenate([which, extreme[outside]]), np.concatenate([time, when[outside]])
    return centre + factor * (found - centre)


def shrink(limits: LinearLimits, series: FourierSeries, centre: FloatArray) -> float:
    """Largest factor, at most 1, by which a trajectory keeps all limits when shrunk toward a position at rest.

    Shrinking moves every extreme value in a straight line toward its value at rest, so that the factor is exact.

    Args:
        limits: the limits.
        series: the trajectory.
        centre: (n,) position inside.
    """
    low, high, _, _ = limits.extremes(series)
    rest = np.where(limits.derivative == 0, limits.joints @ centre, 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        upward = np.where(high > limits.upper, (limits.upper - rest) / (high - rest), 1.0)
        downward = np.where(low < limits.lower, (limits.lower - rest) / (low - rest), 1.0)
    return float(min(1.0, upward.min(initial=1.0), downward.min(initial=1.0)))
