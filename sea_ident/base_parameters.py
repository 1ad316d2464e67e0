"""Base parameters: the combinations of parameters that motion and torque can tell."""

import warnings as python_warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from sea_ident._typing import FloatArray, IntArray
from sea_ident.effects import Column, Effect
from sea_ident.exceptions import SeaIdentError, SeaIdentWarning
from sea_ident.motion import Motion
from sea_ident.one_thread import one_thread
from sea_ident.regressor import build_total, model_columns
from sea_ident.robot import Robot

# A column that lies this close to the span of those kept before it (as a fraction of its length) adds nothing.
_CLOSE = 1e-8
# A column that is this much smaller than the largest one of its effect is rounding.
_ROUNDING = 1e-13
# Weights of a pivoted choice: first moments before moments of inertia before masses.
_PREFERENCE = {"m": 0.25, "Ixx": 0.5, "Ixy": 0.5, "Iyy": 0.4, "Ixz": 0.5, "Iyz": 0.5}


@dataclass(frozen=True, eq=False)
class BaseParameters:
    """Base parameters as a matrix: ``psi_base = grouping @ psi``; names are labels.

    Attributes:
        columns: (p,) all columns of the model.
        independent: (b,) indices of the columns that carry the base parameters.
        grouping: (b, p) how every parameter enters the base parameters; identity at `independent`.
        singular_values: (p,) of the column-normalised stacked regressor.
        tolerance: singular values below ``tolerance * largest`` count as zero.
        warnings: findings, such as a rank that hangs on the tolerance.
    """

    columns: tuple[Column, ...]
    independent: IntArray
    grouping: FloatArray
    singular_values: FloatArray
    tolerance: float
    warnings: tuple[str, ...] = ()

    @property
    def rank(self) -> int:
        """Number b of base parameters."""
        return len(self.independent)

    @property
    def names(self) -> tuple[str, ...]:
        """(b,) names: that of the independent column, with a `*` where other parameters are grouped into it."""
        grouped = np.count_nonzero(self.grouping, axis=1) > 1
        return tuple(self.columns[k].name + ("*" if g else "") for k, g in zip(self.independent, grouped, strict=True))

    @property
    def units(self) -> tuple[str, ...]:
        """(b,) units."""
        return tuple(self.columns[k].unit for k in self.independent)

    @property
    def gap(self) -> float:
        """Smallest kept over largest rejected singular value; infinite where nothing is rejected."""
        if self.rank == len(self.columns):
            return float("inf")
        rejected = float(self.singular_values[self.rank])
        return float(self.singular_values[self.rank - 1]) / rejected if rejected > 0.0 else float("inf")

    def combination(self, index: int) -> dict[str, float]:
        """Parameters and coefficients that make up one base parameter."""
        row = self.grouping[index]
        order = [
            int(self.independent[index]),
            *(int(k) for k in np.flatnonzero(row) if k != self.independent[index]),
        ]
        return {self.columns[k].name: float(row[k]) for k in order}

    def project(self, parameters: FloatArray) -> FloatArray:
        """(b,) base parameters of (p,) parameters; NaN where a parameter that enters is NaN."""
        values: FloatArray = np.where(self.grouping != 0.0, self.grouping * parameters, 0.0).sum(axis=1)
        return values

    def summary(self) -> str:
        """One line per base parameter."""
        lines = [
            f"{self.rank} base parameters of {len(self.columns)}; singular values {self.singular_values[0]:.3g} .. "
            f"{self.singular_values[self.rank - 1]:.3g}, then a gap of {self.gap:.2g}"
        ]
        for k in range(self.rank):
            terms = [f"{c:+.4g} {name}" for name, c in self.combination(k).items()]
            lines.append("  " + " ".join(terms).removeprefix("+1 "))
        lines.extend(f"  warning: {text}" for text in self.warnings)
        return "\n".join(lines)


def random_motion(robot: Robot, samples: int, seed: int = 0) -> Motion:
    """Independent random states of links and motors, for identities and ranks.

    Positions are spread over the limits (at least 1 rad or m wide, at most 2 pi), so that narrow joints do not hide
    what geometry makes visible.

    Args:
        robot: the robot.
        samples: N.
        seed: of the random numbers.

    Returns:
        (N, n) motion; theta is independent of q at elastic joints and equal to it at rigid ones.
    """
    rng = np.random.default_rng(seed)
    lower, upper = robot.limits.lower, robot.limits.upper
    finite = np.isfinite(lower) & np.isfinite(upper)
    centre = np.where(finite, (np.where(finite, lower, 0.0) + np.where(finite, upper, 0.0)) / 2.0, 0.0)
    width = np.clip(
        np.where(finite, np.where(finite, upper, 0.0) - np.where(finite, lower, 0.0), 2 * np.pi),
        1.0,
        2 * np.pi,
    )
    q = centre + width * rng.uniform(-0.5, 0.5, (samples, robot.n))
    dq, ddq, dtheta, ddtheta = (rng.uniform(-3.0, 3.0, (samples, robot.n)) for _ in range(4))
    theta = q + rng.uniform(-0.5, 0.5, (samples, robot.n))
    elastic = np.array(robot.elastic, dtype=bool)
    return Motion(
        np.arange(samples, dtype=float), q, dq, ddq,
        np.where(elastic, theta, q), np.where(elastic, dtheta, dq), np.where(elastic, ddtheta, ddq),
    )  # fmt: skip


@one_thread
def find_base_parameters(
    robot: Robot,
    effects: Sequence[Effect],
    motion: Motion | None = None,
    *,
    seed: int = 0,
    tolerance: float = 1e-9,
) -> BaseParameters:
    """Find the base parameters of a model: by orthogonalisation, with the singular values as the judge.

    A parameter that depends on others is grouped into those of bodies nearer to the base, masses last; what a further
    effect adds leaves the base parameters of the others as they are.

    Args:
        robot: the robot.
        effects: the model.
        motion: motion that decides what is visible; random states by default (structural rank).
        seed: of the random states.
        tolerance: singular values below this fraction of the largest count as zero.

    Returns:
        The base parameters.

    Raises:
        SeaIdentError: if the model has no column that moves anything.

    References:
        Gautier, Numerical calculation of the base inertial parameters of robots, J. Robotic Systems, 1991.
    """
    columns = model_columns(robot, effects)
    if motion is None:
        motion = random_motion(robot, max(40, 4 * (len(columns) // robot.n + 1)), seed)
    triangle = np.zeros((0, len(columns)))
    for part in motion.chunks(500):
        rows = build_total(robot, effects, part).reshape(-1, len(columns))
        triangle = scipy.linalg.qr(np.vstack([triangle, rows]), mode="r", check_finite=False)[0][: len(columns)]
    return group_columns(columns, triangle, tolerance)


def group_columns(columns: tuple[Column, ...], triangle: FloatArray, tolerance: float = 1e-9) -> BaseParameters:
    """Group the columns of a stacked regressor.

    Args:
        columns: (p,) labels.
        triangle: (r, p) the stacked regressor, or the triangular factor of its QR decomposition.
        tolerance: singular values below this fraction of the largest count as zero.

    Returns:
        The base parameters.

    Raises:
        SeaIdentError: if all columns are zero.
    """
    norms = np.linalg.norm(triangle, axis=0)
    visible = _visible(columns, norms, tolerance)
    if not np.any(visible):
        raise SeaIdentError("no parameter has any influence on the torque: the motion is at rest without gravity")
    scale = np.where(visible, norms, np.inf)
    normalised = triangle / scale
    singular_values = np.zeros(len(columns))
    found = np.linalg.svd(normalised, compute_uv=False)
    singular_values[: len(found)] = found
    rank = int(np.count_nonzero(singular_values > tolerance * singular_values[0]))

    kept = _first_independent(columns, normalised, rank)
    if kept is None:
        kept = _pivoted(columns, normalised, rank)
    rejected = np.setdiff1d(np.flatnonzero(visible), kept)
    # columns rejected = columns kept @ relation, in the units of the parameters
    orthogonal, upper = np.linalg.qr(normalised[:, kept])
    relation = scipy.linalg.solve_triangular(upper, orthogonal.T @ normalised[:, rejected])
    relation[np.abs(relation) < 1e-10] = 0.0  # rounding
    grouping = np.zeros((rank, len(columns)))
    grouping[np.arange(rank), kept] = 1.0
    grouping[:, rejected] = relation / scale[kept][:, None] * scale[rejected]

    notes: list[str] = []
    base = BaseParameters(columns, kept, grouping, singular_values, tolerance)
    if base.gap < 10.0:
        text = (
            f"the rank {rank} hangs on the tolerance: the singular values {singular_values[rank - 1]:.3g} and "
            f"{singular_values[rank]:.3g} beside it are less than a decade apart"
        )
        python_warnings.warn(text, SeaIdentWarning, stacklevel=4)
        notes.append(text)
    return BaseParameters(base.columns, base.independent, grouping, singular_values, tolerance, tuple(notes))


def _visible(columns: tuple[Column, ...], norms: FloatArray, tolerance: float) -> NDArray[np.bool_]:
    """(p,) which columns are not zero but for rounding, judged among columns of one effect and unit.

    Where all of a unit are rounding, the other units of the effect tell: masses and inertias are a few metres apart. Of
    another effect they say nothing: a torque to the power of three is many decades above a torque.
    """
    largest: dict[tuple[str, str], float] = {}
    whole: dict[str, float] = {}
    for column, norm in zip(columns, norms, strict=True):
        key = (column.effect, column.unit)
        largest[key] = max(largest.get(key, 0.0), float(norm))
        whole[column.effect] = max(whole.get(column.effect, 0.0), float(norm))
    limit = np.array([max(tolerance * largest[c.effect, c.unit], _ROUNDING * whole[c.effect]) for c in columns])
    visible: NDArray[np.bool_] = (norms > limit) & (norms > 0.0)
    return visible


def _first_independent(columns: tuple[Column, ...], normalised: FloatArray, rank: int) -> IntArray | None:
    """Indices of the first columns that do not depend on those before them; None if there are not `rank` of them.

    Bodies come from the base to the tip, their masses last, then the other effects in their order. So a parameter is
    grouped into those of bodies nearer to the base, the choice does not hang on the motion, and what an effect adds
    leaves the base parameters before it as they are.
    """
    masses = [k for k, c in enumerate(columns) if c.effect == "rigid_bodies" and c.unit == "kg"]
    bodies = [k for k, c in enumerate(columns) if c.effect == "rigid_bodies" and c.unit != "kg"]
    others = [k for k, c in enumerate(columns) if c.effect != "rigid_bodies"]
    basis = np.zeros((normalised.shape[0], rank), order="F")
    kept: list[int] = []
    for k in (*bodies, *masses, *others):
        rest = normalised[:, k].copy()
        for _ in range(2):  # once more, against rounding
            rest -= basis[:, : len(kept)] @ (basis[:, : len(kept)].T @ rest)
        distance = float(np.linalg.norm(rest))
        if distance <= _CLOSE:
            continue
        if len(kept) == rank:
            return None
        basis[:, len(kept)] = rest / distance
        kept.append(k)
    return np.array(sorted(kept), dtype=np.intp) if len(kept) == rank else None


def _pivoted(columns: tuple[Column, ...], normalised: FloatArray, rank: int) -> IntArray:
    """Indices of the most independent columns, by QR with column pivoting: where the rank hangs on the tolerance."""
    preference = np.array([_PREFERENCE.get(column.name.rpartition(".")[2], 1.0) for column in columns])
    _, _, pivots = scipy.linalg.qr(normalised * preference, mode="economic", pivoting=True)
    return np.sort(pivots[:rank]).astype(np.intp)
