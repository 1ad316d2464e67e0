"""What a refit absorbs, against an earlier model."""

from dataclasses import dataclass

import numpy as np
from scipy import stats

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.bench import Bench
from sea_ident.discrepancy.findings import Alternative, MissingEffect, MissingParameter
from sea_ident.discrepancy.fit import Fit
from sea_ident.discrepancy.noise import NoiseFloor
from sea_ident.effects import make_effect
from sea_ident.estimation import Model
from sea_ident.regressor import prior_parameters
from sea_ident.singular_values import svd

LEVEL = 1e-3
"""Probability of a change where there is none."""

SMALLEST_CHANGE = 2e-3
"""A change must alter the torque by this share of its rms, or it does not matter."""

EQUALLY_GOOD = 13.8
"""Two patterns between whose statistics there is less than this are not told apart."""


@dataclass(frozen=True, eq=False)
class ParameterChange:
    """Comparison of the parameters with those of an earlier model.

    Attributes:
        p_value: of no change.
        torque_change: rms of the change of the torque, as a share of the torque [-].
        missing: what changed, where it has a pattern.
    """

    p_value: float
    torque_change: float
    missing: tuple[MissingEffect, ...]

    @property
    def changed(self) -> bool:
        """Whether the parameters changed by what is no chance and matters."""
        return self.p_value < LEVEL and self.torque_change > SMALLEST_CHANGE


@dataclass(frozen=True, eq=False)
class _Pattern:
    effect: str
    joint: str | None
    names: tuple[str, ...]
    units: tuple[str, ...]
    columns: FloatArray


def compare_with_reference(
    bench: Bench, fit: Fit, noise: NoiseFloor, reference: Model | None
) -> ParameterChange | None:
    """Test the parameters against those of an earlier model, and find the pattern of the change.

    Args:
        bench: the recording.
        fit: the model without additions, refitted.
        noise: its noise floor.
        reference: the earlier model, None for no comparison.

    Returns:
        The change, None without a reference.
    """
    if reference is None:
        return None
    base = reference.base
    names = [c.name for c in base.columns]
    now = np.array([fit.parameters.get(name, 0.0) for name in names])
    position = {c.name: k for k, c in enumerate(fit.columns)}
    rows = np.array([position.get(name, -1) for name in names])
    factor = np.where(rows[:, None] >= 0, fit.covariance_factor[np.maximum(rows, 0)], 0.0)
    springs = [s for s in reference.springs if f"{s.joint}.spring_stiffness" in position]
    spring_names = [
        f"{s.joint}.{part}" for s in springs for part in ("spring_stiffness", "spring_stiffening", "spring_damping")
    ]
    spring_rows = np.array([position[name] for name in spring_names], dtype=int)
    earlier_springs = np.array([v for s in springs for v in (s.stiffness, s.cubic_stiffness, s.damping)])
    change = np.concatenate([base.grouping @ now - reference.values, fit.values[spring_rows] - earlier_springs])
    spread = np.concatenate([base.grouping @ factor, fit.covariance_factor[spring_rows]])
    size = len(change)
    covariance = spread @ spread.T
    covariance[: base.rank, : base.rank] += reference.covariance
    for k, s in enumerate(springs):
        part = slice(base.rank + 3 * k, base.rank + 3 * k + 3)
        covariance[part, part] += np.array(s.covariance)
    unit = np.sqrt(np.diag(covariance))
    strength, vectors = np.linalg.eigh(covariance / np.outer(unit, unit))
    keep = strength > 1e-9 * strength[-1]
    whitener = (vectors[:, keep] / np.sqrt(strength[keep])).T / unit
    z = whitener @ change
    freedom = min(noise.total_freedom, reference.uncertainty.degrees_of_freedom * size)
    statistic = float(z @ z)
    p_value = float(stats.f.sf(statistic / len(z), len(z), max(freedom, 4.0)))
    share = _torque_change(bench, fit, reference, names)
    if p_value >= LEVEL or share <= SMALLEST_CHANGE:
        return ParameterChange(p_value, share, ())
    patterns = _patterns(bench, reference, earlier_springs, spring_names)
    return ParameterChange(p_value, share, _explain(z, whitener, patterns, share))


def _torque_change(bench: Bench, fit: Fit, reference: Model, names: list[str]) -> float:
    """Rms difference of the torques that both models predict for this motion, as a share of the torque."""
    earlier = reference.predict(bench.data.motion)
    rms = np.sqrt(np.mean((earlier - bench.data.tau_motor) ** 2, axis=0))
    own = np.sqrt(np.mean(bench.data.tau_motor**2, axis=0))
    noise = np.sqrt(np.mean(bench.data.period_tau_motor.var(axis=0, ddof=1), axis=0) / bench.data.periods)
    return float(np.max(np.sqrt(np.maximum(rms**2 - noise**2, 0.0)) / own))


def _patterns(bench: Bench, reference: Model, earlier_springs: FloatArray, spring_names: list[str]) -> list[_Pattern]:
    robot, base = bench.robot, reference.base
    index = {c.name: k for k, c in enumerate(base.columns)}
    size = base.rank + len(spring_names)

    def of(names: list[str]) -> FloatArray:
        columns = np.zeros((size, len(names)))
        for k, name in enumerate(names):
            if name in index:
                columns[: base.rank, k] = base.grouping[:, index[name]]
            elif name in spring_names:
                columns[base.rank + spring_names.index(name), k] = 1.0
        return columns

    found = []
    for joint, body in zip(robot.joint_names, robot.bodies, strict=False):
        own = [name for name in robot.inertial_names if name.startswith(f"{body}.")]
        payload = make_effect("payload", joint)
        labels = payload.columns(robot)
        found.append(_Pattern("payload", joint, tuple(c.name for c in labels), tuple(c.unit for c in labels), of(own)))
    scale = np.concatenate([reference.values, earlier_springs])[:, None]
    found.append(_Pattern("torque_constant", None, ("robot.torque_constant",), ("-",), scale))
    for column in base.columns:
        if column.effect != "rigid_bodies":
            found.append(_Pattern(column.effect, column.joint, (column.name,), (column.unit,), of([column.name])))
    for name in spring_names:
        joint, _, effect = name.partition(".")
        found.append(_Pattern(effect, joint, (name,), ("",), of([name])))
    return found


def _explain(z: FloatArray, whitener: FloatArray, patterns: list[_Pattern], share: float) -> tuple[MissingEffect, ...]:
    """The fewest patterns that explain a whitened change, at most three."""
    chosen: list[_Pattern] = []
    left = z
    for _ in range(3):
        scores = []
        for pattern in patterns:
            together = np.concatenate([whitener @ p.columns for p in (*chosen, pattern)], axis=1)
            basis = _span(together)
            rest = z - basis @ (basis.T @ z)
            own = _span(whitener @ pattern.columns).shape[1]
            scores.append((float(rest @ rest) + own * np.log(max(len(z), 3)), own, rest, pattern))
        best = min(scores, key=lambda s: s[0])
        gain = float(left @ left - best[2] @ best[2])
        if (
            best[1] == 0
            or float(stats.chi2.sf(gain, best[1])) * len(patterns) > LEVEL
            or gain < 0.2 * float(left @ left)
        ):
            break
        chosen.append(best[3])
        left = best[2]
    out = []
    for pattern in chosen:
        others = [p for p in chosen if p is not pattern]
        columns = np.concatenate([whitener @ p.columns for p in (pattern, *others)], axis=1)
        values = np.linalg.pinv(columns, rcond=1e-8) @ z
        inverse = np.linalg.pinv(columns, rcond=1e-8)
        without = _rest(z, whitener, others)
        gain = without - _rest(z, whitener, [pattern, *others])
        width = max(_span(whitener @ pattern.columns).shape[1], 1)
        alike = []
        for p in patterns:
            if p is pattern or p in others:
                continue
            loss = _rest(z, whitener, [p, *others]) - _rest(z, whitener, [pattern, *others])
            price = (_span(whitener @ p.columns).shape[1] - width) * np.log(max(len(z), 3))
            if loss + price < EQUALLY_GOOD:
                alike.append(Alternative(p.effect, p.joint, float(np.clip(1.0 - loss / max(gain, 1e-300), 0.0, 1.0))))
        visible = np.linalg.norm(whitener @ pattern.columns, axis=0) > 0.0
        out.append(
            MissingEffect(
                effect=pattern.effect,
                joint=pattern.joint,
                parameters=tuple(
                    MissingParameter(n, float(values[k]), float(np.linalg.norm(inverse[k])), u)
                    for k, (n, u) in enumerate(zip(pattern.names, pattern.units, strict=True))
                    if visible[k]
                ),
                torque_share=share,
                p_value=min(1.0, len(patterns) * float(stats.chi2.sf(gain, width))),
                alternatives=tuple(alike),
            )
        )
    return tuple(out)


def _rest(z: FloatArray, whitener: FloatArray, patterns: list[_Pattern]) -> float:
    if not patterns:
        return float(z @ z)
    basis = _span(np.concatenate([whitener @ p.columns for p in patterns], axis=1))
    rest = z - basis @ (basis.T @ z)
    return float(rest @ rest)


def _span(columns: FloatArray) -> FloatArray:
    norms = np.linalg.norm(columns, axis=0)
    columns = columns[:, norms > 1e-9 * max(float(norms.max(initial=0.0)), 1e-300)]
    if not columns.shape[1]:
        return np.zeros((len(columns), 0))
    left, strength, _ = svd(columns / np.linalg.norm(columns, axis=0))
    kept: FloatArray = left[:, strength > 1e-6 * strength[0]]
    return kept


__all__ = ["ParameterChange", "compare_with_reference", "prior_parameters"]
