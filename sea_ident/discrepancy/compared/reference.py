"""What a refit absorbs, against an earlier model."""

from dataclasses import dataclass

import numpy as np
from scipy import stats

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.measured.data import PeriodData
from sea_ident.discrepancy.result.findings import Alternative, MissingEffect, MissingParameter
from sea_ident.effects import make_effect, spring_effects
from sea_ident.estimation import Model
from sea_ident.estimation.knowledge import regular_covariance
from sea_ident.estimation.observations import base_rows
from sea_ident.singular_values import svd

LEVEL = 1e-3
"""Probability of a change where there is none."""

SMALLEST_CHANGE = 2e-3
"""A change must alter the torque by this share of its rms, or it does not matter."""

WORTH = 0.2
"""A further pattern must explain this share of what those before leave."""

MOST = 3
"""Patterns that are named at most."""

SAME = 1e-6
"""A base parameter whose combination differs by no more than this share is seen by both models."""

SPRING_PARAMETERS = ("spring_stiffness", "spring_stiffening", "spring_damping")

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


def compare_with_reference(now: Model, reference: Model, data: PeriodData) -> ParameterChange:
    """Test the parameters against those of an earlier model, and find the pattern of the change.

    Args:
        now: a model of the recording, with the effects of the earlier one before any others (see `against`).
        reference: the earlier model.
        data: the recording.

    Returns:
        The change.
    """
    change = _difference(now, reference, data)
    statistic = float(change.z @ change.z)
    p_value = float(stats.f.sf(statistic / len(change.z), len(change.z), change.freedom))
    share = change.torque_share(change.parameters)
    if p_value >= LEVEL or share <= SMALLEST_CHANGE:
        return ParameterChange(p_value, share, ())
    return ParameterChange(p_value, share, _explain(change, _patterns(now, reference, change)))


@dataclass(frozen=True, eq=False)
class _Change:
    """Difference of the parameters of two models, what of it both see.

    Attributes:
        grouping: (b, p) of the base parameters that are compared.
        parameters: (b + 3 k,) change of base parameters, and of K1, K3 and D of every spring.
        earlier: (b + 3 k,) their values in the earlier model.
        springs: names of the parameters of springs.
        whitener: (r, b + 3 k) makes of a change one of unit covariance.
        freedom: degrees of freedom of the covariances.
        torques: (N, n + k, b + 3 k) torques of the motors, then of the springs, by parameter on the motion of the
            recording.
        rms: (n + k,) rms of the torque of the motor of every row.
    """

    grouping: FloatArray
    parameters: FloatArray
    earlier: FloatArray
    springs: tuple[str, ...]
    whitener: FloatArray
    freedom: float
    torques: FloatArray
    rms: FloatArray

    def chance(self, gain: float, count: int) -> float:
        """Probability that so many parameters of no change at all explain this much."""
        return float(stats.f.sf(gain / count, count, self.freedom))

    @property
    def z(self) -> FloatArray:
        """(r,) the change in units of its uncertainty."""
        return self.whitener @ self.parameters

    def torque_share(self, parameters: FloatArray) -> float:
        """Rms of the torque that a change makes, as a share of the torque, at the joint where it is most."""
        changed = np.sqrt(np.mean((self.torques @ parameters) ** 2, axis=0))
        return float(np.max(changed / np.maximum(self.rms, 1e-300)))


def _difference(now: Model, reference: Model, data: PeriodData) -> _Change:
    """Difference of two models in the parameters that both see."""
    # what is new has no part in what the earlier model saw
    grouping = np.zeros((reference.base.rank, len(now.base.columns)))
    grouping[:, : len(reference.base.columns)] = reference.base.grouping
    combined = np.linalg.lstsq(grouping.T, now.base.grouping.T, rcond=None)[0].T
    left = np.linalg.norm(now.base.grouping - combined @ grouping, axis=1)
    both = np.flatnonzero(left <= SAME * np.linalg.norm(now.base.grouping, axis=1))
    combined = combined[both]
    before = combined @ reference.values
    earlier_springs = {s.joint: s for s in reference.springs}
    pairs = [(s, earlier_springs[s.joint]) for s in now.springs if s.joint in earlier_springs]
    rank, size = len(both), len(both) + 3 * len(pairs)
    values, earlier = np.zeros(size), np.zeros(size)
    values[:rank], earlier[:rank] = now.values[both], before
    covariance = np.zeros((size, size))
    covariance[:rank, :rank] = regular_covariance(now)[np.ix_(both, both)]
    covariance[:rank, :rank] += combined @ regular_covariance(reference) @ combined.T
    for k, pair in enumerate(pairs):
        part = slice(rank + 3 * k, rank + 3 * k + 3)
        values[part], earlier[part] = ((s.stiffness, s.cubic_stiffness, s.damping) for s in pair)
        covariance[part, part] = sum(np.array(s.covariance) for s in pair)
    unit = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    strength, vectors = np.linalg.eigh(covariance / np.outer(unit, unit))
    keep = strength > 1e-9 * strength[-1]
    joints = now.robot.joint_names
    own = [joints.index(spring.joint) for spring, _ in pairs]
    torques = np.zeros((len(data.motion), len(joints) + len(pairs), size))
    rows = base_rows(now.robot, now.effects, now.base, data.motion, data.channels)
    torques[:, : len(joints), :rank] = rows[:, :, both]
    for k, i in enumerate(own):
        bent, rate = data.motion.deflection[:, i], data.motion.deflection_rate[:, i]
        column = rank + 3 * k
        torques[:, len(joints) + k, column : column + 3] = np.stack([bent, bent**3, rate], axis=1)
    rms = np.sqrt(np.mean(data.tau_motor**2, axis=0))
    return _Change(
        grouping=now.base.grouping[both],
        parameters=values - earlier,
        earlier=earlier,
        springs=tuple(f"{s.joint}.{part}" for s, _ in pairs for part in SPRING_PARAMETERS),
        whitener=(vectors[:, keep] / np.sqrt(strength[keep])).T / unit,
        freedom=max(min(now.uncertainty.degrees_of_freedom, reference.uncertainty.degrees_of_freedom), 4.0),
        torques=torques,
        rms=np.concatenate([rms, rms[own]]),
    )


def _patterns(now: Model, reference: Model, change: _Change) -> list[_Pattern]:
    robot = now.robot
    index = {c.name: k for k, c in enumerate(now.base.columns)}
    rank, size = len(change.grouping), len(change.parameters)

    def of(names: list[str]) -> FloatArray:
        columns = np.zeros((size, len(names)))
        for k, name in enumerate(names):
            if name in index:
                columns[:rank, k] = change.grouping[:, index[name]]
            elif name in change.springs:
                columns[rank + change.springs.index(name), k] = 1.0
        return columns

    found = []
    for joint, body in zip(robot.joint_names, robot.bodies, strict=False):
        own = [name for name in robot.inertial_names if name.startswith(f"{body}.")]
        payload = make_effect("payload", joint)
        labels = payload.columns(robot)
        found.append(_Pattern("payload", joint, tuple(c.name for c in labels), tuple(c.unit for c in labels), of(own)))
    scale = change.earlier[:, None]
    found.append(_Pattern("torque_constant", None, ("robot.torque_constant",), ("-",), scale))
    for column in reference.base.columns:
        if column.effect != "rigid_bodies":
            found.append(_Pattern(column.effect, column.joint, (column.name,), (column.unit,), of([column.name])))
    for effect in spring_effects(robot):
        for column in effect.columns(robot):
            if column.name in change.springs:
                found.append(_Pattern(column.effect, column.joint, (column.name,), (column.unit,), of([column.name])))
    return found


def _explain(change: _Change, patterns: list[_Pattern]) -> tuple[MissingEffect, ...]:
    """The fewest patterns that explain a change and matter, at most three."""
    z, whitener = change.z, change.whitener
    chosen: list[_Pattern] = []
    left = z
    for _ in range(MOST):
        scores = []
        for pattern in patterns:
            rest = _rest(z, whitener, [*chosen, pattern])
            own = _span(whitener @ pattern.columns).shape[1]
            scores.append((float(rest @ rest) + own * np.log(max(len(z), 3)), own, rest, pattern))
        _, own, rest, best = min(scores, key=lambda s: s[0])
        before = float(left @ left)
        gain = before - float(rest @ rest)
        if own == 0 or change.chance(gain, own) * len(patterns) > LEVEL or gain < WORTH * before:
            break
        share = change.torque_share(best.columns @ _values(z, whitener, [*chosen, best])[-best.columns.shape[1] :])
        if share <= SMALLEST_CHANGE:
            break
        chosen.append(best)
        left = rest
    while True:
        found = [_described(change, pattern, chosen, patterns) for pattern in chosen]
        # beside others that came after it, one may explain nothing any more
        worst = max(range(len(found)), key=lambda k: found[k].p_value, default=None)
        if worst is None or found[worst].p_value <= LEVEL:
            return tuple(found)
        del chosen[worst]


def _described(change: _Change, pattern: _Pattern, chosen: list[_Pattern], patterns: list[_Pattern]) -> MissingEffect:
    z, whitener = change.z, change.whitener
    others = [p for p in chosen if p is not pattern]
    columns = whitener @ np.concatenate([p.columns for p in (pattern, *others)], axis=1)
    inverse = np.linalg.pinv(columns, rcond=1e-8)[: len(pattern.names)]
    values = inverse @ z
    left = _squared(_rest(z, whitener, [pattern, *others]))
    gain = _squared(_rest(z, whitener, others)) - left
    width = max(_span(whitener @ pattern.columns).shape[1], 1)
    alike = []
    for p in patterns:
        if p in chosen:
            continue
        loss = _squared(_rest(z, whitener, [p, *others])) - left
        price = (_span(whitener @ p.columns).shape[1] - width) * np.log(max(len(z), 3))
        if loss + price < EQUALLY_GOOD:
            alike.append(Alternative(p.effect, p.joint, float(np.clip(1.0 - loss / max(gain, 1e-300), 0.0, 1.0))))
    visible = np.linalg.norm(whitener @ pattern.columns, axis=0) > 0.0
    return MissingEffect(
        effect=pattern.effect,
        joint=pattern.joint,
        parameters=tuple(
            MissingParameter(n, float(values[k]), float(np.linalg.norm(inverse[k])), u)
            for k, (n, u) in enumerate(zip(pattern.names, pattern.units, strict=True))
            if visible[k]
        ),
        torque_share=change.torque_share(pattern.columns @ values),
        p_value=min(1.0, len(patterns) * change.chance(gain, width)),
        alternatives=tuple(alike),
    )


def _rest(z: FloatArray, whitener: FloatArray, patterns: list[_Pattern]) -> FloatArray:
    """(r,) what patterns do not explain of a whitened change."""
    if not patterns:
        return z
    basis = _span(np.concatenate([whitener @ p.columns for p in patterns], axis=1))
    rest: FloatArray = z - basis @ (basis.T @ z)
    return rest


def _values(z: FloatArray, whitener: FloatArray, patterns: list[_Pattern]) -> FloatArray:
    """Values of all parameters of patterns, one after another."""
    columns = whitener @ np.concatenate([p.columns for p in patterns], axis=1)
    values: FloatArray = np.linalg.pinv(columns, rcond=1e-8) @ z
    return values


def _squared(values: FloatArray) -> float:
    return float(values @ values)


def _span(columns: FloatArray) -> FloatArray:
    norms = np.linalg.norm(columns, axis=0)
    columns = columns[:, norms > 1e-9 * max(float(norms.max(initial=0.0)), 1e-300)]
    if not columns.shape[1]:
        return np.zeros((len(columns), 0))
    left, strength, _ = svd(columns / np.linalg.norm(columns, axis=0))
    kept: FloatArray = left[:, strength > 1e-6 * strength[0]]
    return kept
