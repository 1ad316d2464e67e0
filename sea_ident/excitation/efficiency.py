"""How much better than a design any periodic motion inside the limits could be.

A periodic motion is a measure over states s = (q, q', q''), and log det is a concave function of that measure
(Kiefer and Wolfowitz). Any measure over the box of states would be too much freedom: acceleration and position could be
chosen apart. But along a periodic motion the mean of every total time derivative is zero,

    mean of dh/dq q' + dh/dq' q'' = 0      for every function h(q, q'),

and a motion of L harmonics has ``mean q''^2 <= (L w)^2 mean q'^2``. Both are linear in the measure. Nor does such a
motion reach all of the box: where |q'| <= V and |q - middle| <= R at all times, Bernstein's inequality in the form of
van der Corput and Schaake gives at every time

    q''^2 + (L w)^2 q'^2 <= (L w V)^2    and    q'^2 + (L w)^2 (q - middle)^2 <= (L w R)^2.

With d the
quadratic form of the columns in a matrix W, and multipliers u, v >= 0 of these conditions,

    log det M <= p log(top / p) - log det W,    top = max over s of d(s) + u psi(s) + v chi(s).

The maximum over s is searched from many states; it is not a proof of the largest value, and the result says so.

The bound is loose, and a tight one of this kind is not to be had at a bearable cost. That a measure may mix several
motions is not the reason: for the leg of the paper the best mixture of motions that keep the limits is 0.2 above the
best of them in log det, this bound 10.5. What is missing is that the states follow each other on one closed path. Only
conditions for every function h hold a measure to closed paths; the number of those of a degree grows as its power of
2 n, each one is another multiplier, and their maximum is over 3 n states that is searched anyway.

References:
    van der Corput, Schaake, Ungleichungen fuer Polynome und trigonometrische Polynome, Compositio Mathematica, 1935.
    Kiefer, Wolfowitz, The equivalence of two extremum problems, Canadian J. Mathematics, 1960.
    Lasserre, Henrion, Prieur, Trelat, Nonlinear optimal control via occupation measures and LMI relaxations, SIAM J.
    Control and Optimization, 2008.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from sea_ident._typing import FloatArray, IntArray
from sea_ident.effects import Effect
from sea_ident.exceptions import ExcitationError
from sea_ident.excitation.criteria import DOptimality
from sea_ident.excitation.defaults import default_limits
from sea_ident.excitation.design_model import design_model, reduced_effects
from sea_ident.excitation.linear_limits import linear_limits
from sea_ident.excitation.result import Excitation
from sea_ident.motion import Motion
from sea_ident.robot import Robot

_DEGREE = 2
_FINEST = 1e-2


@dataclass(frozen=True)
class EfficiencyBound:
    """A bound on log det of all periodic motions.

    It is loose, so that efficiencies may be far higher than it says: a measure over states need not follow one closed
    path.

    Attributes:
        log_det: no motion with these harmonics in these limits was found to be able to exceed it.
        columns: number p of columns.
        searched: states from which the largest value was searched in the last round.
        slack: part of the bound that the last search still moved it by.
    """

    log_det: float
    columns: int
    searched: int
    slack: float

    def efficiency(self, log_det: float) -> float:
        """D-efficiency of a design: the share of the samples with which the bound would tell as much."""
        return float(np.exp((log_det - self.log_det) / self.columns))

    def summary(self, log_det: float) -> str:
        """How good a design is at least, and why it may be better, as text."""
        return (
            f"log det {log_det:.2f} of at most {self.log_det:.2f}: D-efficiency at least "
            f"{100.0 * self.efficiency(log_det):.0f} % ({self.columns} columns; largest value searched from "
            f"{self.searched} states, which still moved the bound by {self.slack:.2f})\n"
            f"  the bound is loose: it knows which states a motion can reach and that means of total derivatives of "
            f"degree {_DEGREE} vanish, not that the states follow each other on one closed path"
        )


class _States:
    """The box of states, the columns there, and the conditions on their mean."""

    def __init__(self, robot: Robot, effects: tuple[Effect, ...], base_frequency: float, harmonics: int) -> None:
        self.columns = design_model(robot, effects, DOptimality(), None)[0].columns
        bounded = default_limits(robot, robot.limits, [])
        omega = 2.0 * np.pi * base_frequency * harmonics
        # a trigonometric polynomial of degree L and its derivative: Bernstein's inequality
        velocity = np.minimum(bounded.velocity, omega * 0.5 * (bounded.upper - bounded.lower))
        acceleration = np.minimum(bounded.acceleration, omega * velocity)
        self.n = robot.n
        self.middle = np.concatenate([0.5 * (bounded.lower + bounded.upper), np.zeros(2 * self.n)])
        self.half = np.concatenate([0.5 * (bounded.upper - bounded.lower), velocity, acceleration])
        limits = linear_limits(robot, bounded)
        combined = [k for k in range(len(limits)) if np.count_nonzero(limits.joints[k]) > 1]
        self.combined, self.lower, self.upper = limits.joints[combined], limits.lower[combined], limits.upper[combined]
        self.omega = omega
        powers = [
            np.bincount(np.array(chosen, dtype=np.intp), minlength=2 * self.n)
            for degree in range(1, _DEGREE + 1)
            for chosen in combinations_with_replacement(range(2 * self.n), degree)
        ]
        self.powers = np.array(powers)

    def inside(self, x: FloatArray) -> NDArray[np.bool_]:
        """Which of the states (K, 3 n), in units of the box, keep the limits on combinations of joints."""
        q = self.middle[: self.n] + self.half[: self.n] * x[:, : self.n]
        value = q @ self.combined.T
        within: NDArray[np.bool_] = np.all((value >= self.lower) & (value <= self.upper), axis=1)
        return within

    def reached(self, x: FloatArray) -> FloatArray:
        """States (K, 3 n), in units of the box, with velocities and accelerations cut to what can be had there."""
        n = self.n
        span, speed, rate = self.half[:n], self.half[n : 2 * n], self.half[2 * n :]
        fastest = np.minimum(1.0, self.omega * span / speed * np.sqrt(np.maximum(1.0 - x[:, :n] ** 2, 0.0)))
        velocity = np.clip(x[:, n : 2 * n], -fastest, fastest)
        most = np.minimum(1.0, self.omega * speed / rate * np.sqrt(np.maximum(1.0 - velocity**2, 0.0)))
        return np.hstack([x[:, :n], velocity, np.clip(x[:, 2 * n :], -most, most)])

    def rows(self, x: FloatArray) -> FloatArray:
        """(K, R, p) columns."""
        n = self.n
        state = self.middle + self.half * x
        motion = Motion.rigid(np.arange(len(x), dtype=np.float64), state[:, :n], state[:, n : 2 * n], state[:, 2 * n :])
        return self.columns.at(motion).columns().transpose(2, 0, 1)

    def conditions(self, x: FloatArray) -> FloatArray:
        """(K, m + n) total derivatives of monomials of q and q', then (L w)^2 q'^2 - q''^2."""
        n = self.n
        there = np.concatenate([x[:, :n], x[:, n : 2 * n]], axis=1)
        velocity = self.half[n : 2 * n] * x[:, n : 2 * n]
        acceleration = self.half[2 * n :] * x[:, 2 * n :]
        rate = np.concatenate([velocity / self.half[:n], acceleration / self.half[n : 2 * n]], axis=1)
        total = np.zeros((len(x), len(self.powers)))
        for j in range(2 * n):
            lowered = self.powers.copy()
            lowered[:, j] = np.maximum(lowered[:, j] - 1, 0)
            monomials = np.prod(there[:, None, :] ** lowered[None], axis=2)
            total += self.powers[:, j] * monomials * rate[:, j : j + 1]
        band = (self.omega * velocity) ** 2 - acceleration**2
        scale = np.maximum(np.abs(total).max(axis=0, initial=0.0), 1e-12)
        self.scale = getattr(self, "scale", scale)
        return np.concatenate([total / self.scale, band / (self.omega * self.half[n : 2 * n]) ** 2], axis=1)


def bound_log_det(
    robot: Robot,
    excitation: Excitation,
    *,
    effects: Sequence[Effect] | None = None,
    states: int = 1500,
    rounds: int = 12,
    seed: int = 0,
) -> EfficiencyBound:
    """Bound log det of all periodic motions inside the limits of a robot.

    Torque limits, and what the starting model leaves out, only lower what is possible: the bound holds with them too.

    Args:
        robot: the robot, with the limits that the excitation was designed for.
        excitation: gives base frequency, harmonics and samples, and states to begin with: those of a motion meet all
            conditions, which few random ones do.
        effects: the model; `reduced_effects` by default.
        states: random states to begin with, and from which the largest value is searched in every round.
        rounds: at most so many.
        seed: of the states.

    Returns:
        The bound.

    Raises:
        ExcitationError: fewer states than can carry the columns.
    """
    model = reduced_effects(robot) if effects is None else tuple(effects)
    box = _States(robot, model, excitation.base_frequency, excitation.series.harmonics)
    p = len(box.columns.chosen)
    if states < 4 * p:
        raise ExcitationError(f"states is {states}; {p} columns need at least {4 * p}")
    generator = np.random.default_rng(seed)
    # so many samples that no condition sees an alias: the highest product of derivatives has degree + 1 factors
    own = excitation.series.sample(samples=2 * (_DEGREE + 1) * excitation.series.harmonics + 1)
    along = (np.hstack([own.q, own.dq, own.ddq]) - box.middle) / box.half
    x = np.concatenate([along, _random(box, states, generator)])
    scale = 1.0 / np.sqrt(np.einsum("krp,krp->p", box.rows(x), box.rows(x)) / len(x))
    best, slack = np.inf, np.inf
    dual: _Dual | None = None
    for count in range(rounds):
        # an early solution well inside is steadier than a vertex of what few states allow
        accuracy = max(_FINEST, 0.5**count)
        dual = _solve(box.rows(x) * scale, box.conditions(x), robot.n, dual, accuracy)
        trial = _random(box, states, generator)
        trial = _climb(box, dual, scale, np.concatenate([trial, x[-states:]]))
        values = dual.values(box.rows(trial) * scale, box.conditions(trial))
        found = dual.bound(float(values.max())) - 2.0 * float(np.log(scale).sum())
        slack = dual.bound(float(values.max())) - dual.bound(dual.top)
        best = min(best, found)
        if slack < 0.02 and accuracy <= _FINEST:
            break
        order = np.flatnonzero(values > dual.top)
        active = dual.values(box.rows(x) * scale, box.conditions(x)) > 0.5 * dual.top
        x = np.concatenate([along, x[active], trial[order]])
    return EfficiencyBound(best + p * float(np.log(excitation.samples)), p, 2 * states, slack)


def _random(box: _States, count: int, generator: np.random.Generator) -> FloatArray:
    """States in the box, many of them at its corners, where quadratic forms are largest."""
    kept: list[FloatArray] = []
    while sum(len(part) for part in kept) < count:
        x = generator.uniform(-1.0, 1.0, (2 * count, 3 * box.n))
        corner = generator.random(x.shape) < 0.5
        x = np.where(corner, np.sign(x), x)
        kept.append(box.reached(x[box.inside(x)]))
    return np.concatenate(kept)[:count]


@dataclass(frozen=True, eq=False)
class _Dual:
    """W, multipliers of the conditions, and the largest value over the states that it was solved for."""

    matrix: FloatArray
    multipliers: FloatArray
    top: float

    def values(self, rows: FloatArray, conditions: FloatArray) -> FloatArray:
        """(K,) d + u psi + v chi."""
        quadratic: FloatArray = np.einsum("krp,krp->k", rows @ self.matrix, rows)
        return quadratic + conditions @ self.multipliers

    def bound(self, top: float) -> float:
        """The bound with a largest value `top`."""
        p = len(self.matrix)
        return float(p * np.log(top / p) - np.linalg.slogdet(self.matrix)[1])


def _solve(rows: FloatArray, conditions: FloatArray, inequalities: int, start: _Dual | None, accuracy: float) -> _Dual:
    """Minimise ``-log det W`` with values of at most p at all states, by a logarithmic barrier."""
    count, _, p = rows.shape
    upper = np.triu_indices(p)
    twice = np.where(upper[0] == upper[1], 1.0, 2.0)
    squares = np.einsum("kri,krj->kij", rows, rows)[:, upper[0], upper[1]] * twice
    table = np.concatenate([squares, conditions], axis=1)
    m = conditions.shape[1]
    matrix = np.linalg.inv(np.einsum("krp,krq->pq", rows, rows) / count) if start is None else start.matrix
    multipliers = np.full(m, 1e-6) if start is None else start.multipliers.copy()
    multipliers[: m - inequalities] *= start is not None
    first = _Dual(matrix, multipliers, 0.0)
    shrunk = 0.5 * p / float(first.values(rows, conditions).max())
    variables = np.concatenate([(matrix * shrunk)[upper], multipliers * shrunk])
    multipliers_at = slice(len(upper[0]) + m - inequalities, None)
    variables[multipliers_at] = np.maximum(variables[multipliers_at], 1e-9)
    barrier = 1.0
    for _ in range(120):
        matrix = _square(variables[: len(upper[0])], p)
        inverse = np.linalg.inv(matrix)
        slack = p - table @ variables
        # -log det W - barrier (sum log slack + sum log v)
        gradient = barrier * (table.T @ (1.0 / slack))
        gradient[: len(upper[0])] -= inverse[upper] * twice
        gradient[multipliers_at] -= barrier / variables[multipliers_at]
        hessian = (table.T * (barrier / slack**2)) @ table
        pairs = (
            inverse[np.ix_(upper[0], upper[0])] * inverse[np.ix_(upper[1], upper[1])]
            + inverse[np.ix_(upper[0], upper[1])] * inverse[np.ix_(upper[1], upper[0])]
        ) / 2.0
        size = len(upper[0])
        hessian[:size, :size] += pairs * np.outer(twice, twice)
        places = np.arange(len(variables))[multipliers_at]
        hessian[places, places] += barrier / variables[multipliers_at] ** 2
        hessian[np.diag_indices_from(hessian)] += 1e-12 * np.trace(hessian) / len(hessian)
        step = -scipy.linalg.solve(hessian, gradient, assume_a="pos", check_finite=False)
        decrement = float(-gradient @ step)
        length = _feasible_length(variables, step, table, slack, places, p, size)
        variables = variables + length * step
        if decrement < 0.1 * max(barrier, 1e-3) and length > 0.5:
            if barrier * count < accuracy:
                break
            barrier *= 0.3
    found = _Dual(_square(variables[:size], p), variables[size:], 0.0)
    return _Dual(found.matrix, found.multipliers, float(found.values(rows, conditions).max()))


def _square(packed: FloatArray, p: int) -> FloatArray:
    matrix = np.zeros((p, p))
    matrix[np.triu_indices(p)] = packed
    return matrix + np.triu(matrix, 1).T


def _feasible_length(
    variables: FloatArray, step: FloatArray, table: FloatArray, slack: FloatArray, places: IntArray, p: int, size: int
) -> float:
    """Largest part of a Newton step that stays inside."""
    closing = table @ step
    worst = float((closing / slack).max(initial=0.0))
    worst = max(worst, float((-step[places] / variables[places]).max(initial=0.0)))
    length = 1.0 if worst < 0.95 else 0.95 / worst
    for _ in range(40):
        try:
            np.linalg.cholesky(_square((variables + length * step)[:size], p))
        except np.linalg.LinAlgError:
            length *= 0.5
        else:
            return length
    return length


def _climb(box: _States, dual: _Dual, scale: FloatArray, x: FloatArray) -> FloatArray:
    """Raise the values at many states at once, coordinate by coordinate: to the ends, and a step to either side."""
    value = dual.values(box.rows(x) * scale, box.conditions(x))
    for width in (1.0, 0.5, 0.2, 0.05):
        for j in range(x.shape[1]):
            for move in ("low", "high", -width, width):
                trial = x.copy()
                if move == "low" or move == "high":
                    trial[:, j] = -1.0 if move == "low" else 1.0
                else:
                    trial[:, j] = np.clip(trial[:, j] + float(move), -1.0, 1.0)
                trial = box.reached(trial)
                found = dual.values(box.rows(trial) * scale, box.conditions(trial))
                better = (found > value) & box.inside(trial)
                x[better], value[better] = trial[better], found[better]
    return x
