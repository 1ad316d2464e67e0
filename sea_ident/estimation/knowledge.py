"""What a recording tells and what it does not: essential parameters, correlations, information."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import stats

from sea_ident._typing import FloatArray
from sea_ident.base_parameters import find_base_parameters
from sea_ident.effects import Effect
from sea_ident.estimation.model import Model
from sea_ident.exceptions import IdentificationError

CORRELATED = 0.95
"""Correlation from which on two parameters are hardly told apart."""

POOR = 30.0
"""Relative standard deviation [%] from which on a parameter is not told."""


def regular_covariance(model: Model) -> FloatArray:
    """A covariance of the base parameters that can be inverted.

    The spread of P periods gives a matrix of rank P - 1 whose small eigenvalues are too small. Standard deviations are
    kept; the correlations are pulled toward those of eq. 13, the more the fewer periods there are per parameter.

    Args:
        model: an identified model.

    Returns:
        (b, b) positive definite covariance.
    """
    std = np.maximum(model.std, 1e-12 * np.maximum(np.abs(model.values), 1e-12))
    assumed = np.sqrt(np.diag(model.model_covariance))
    shape = model.model_covariance / np.outer(assumed, assumed)
    freedom = model.uncertainty.degrees_of_freedom
    share = 1.0 if not np.isfinite(freedom) else min(1.0, len(std) / freedom)
    if np.all(model.std > 0.0):
        seen = model.covariance / np.outer(model.std, model.std)
        shape = share * shape + (1.0 - share) * seen
    return np.asarray(shape * np.outer(std, std), dtype=np.float64)


def information_about(model: Model, effects: Sequence[Effect] | None = None) -> FloatArray:
    """Information that a model holds, for the design of the next excitation.

    Args:
        model: an identified model.
        effects: the model that the excitation is designed for; that of the identified model where None. Parameters that
            only the identified model has count as known.

    Returns:
        (p, p) inverse covariance of the base parameters of `effects`, in the order of `find_base_parameters`.

    Raises:
        IdentificationError: a base parameter of `effects` is not one of the model.
    """
    whole = np.linalg.inv(regular_covariance(model))
    if effects is None:
        return np.asarray(whole, dtype=np.float64)
    base = find_base_parameters(model.robot, tuple(effects))
    own = [model.base.columns[k].name for k in model.base.independent]
    wanted = [base.columns[k].name for k in base.independent]
    missing = [name for name in wanted if name not in own]
    if missing:
        raise IdentificationError(
            f"the model has no base parameters {', '.join(missing)}; it has {', '.join(own)}. Identify it with the "
            "same effects"
        )
    take = [own.index(name) for name in wanted]
    return np.asarray(whole[np.ix_(take, take)], dtype=np.float64)


@dataclass(frozen=True, eq=False)
class Knowledge:
    """What a recording tells about the parameters of a model.

    Attributes:
        essential: base parameters that the data need.
        dropped: base parameters that the data do not need, in the order in which they were dropped.
        reduced: the model with those at zero, and the others fitted again.
        statistic: F statistic of dropping all of them at once.
        p_value: probability of a larger one if they were zero.
        poor: base parameters with a relative standard deviation beyond 30 %, and that [%].
        correlated: pairs of base parameters that are hardly told apart, with their correlation.
        weakest: combination of base parameters, in units of their values, that is known worst, largest terms first.
        weakest_percent: relative standard deviation of that combination [%].
    """

    essential: tuple[str, ...]
    dropped: tuple[str, ...]
    reduced: Model
    statistic: float
    p_value: float
    poor: tuple[tuple[str, float], ...]
    correlated: tuple[tuple[str, str, float], ...]
    weakest: tuple[tuple[str, float], ...]
    weakest_percent: float

    def summary(self) -> str:
        """Text for people."""
        lines = [f"{len(self.essential)} essential parameters of {len(self.essential) + len(self.dropped)}"]
        if self.dropped:
            lines.append(f"  not needed (F = {self.statistic:.3g}, p = {self.p_value:.2g}): {', '.join(self.dropped)}")
        for name, percent in self.poor:
            lines.append(f"  {name} is known to {percent:.0f} % only")
        for first, second, value in self.correlated:
            lines.append(f"  {first} and {second} are hardly told apart (correlation {value:.3f})")
        terms = " ".join(f"{factor:+.2f} {name}" for name, factor in self.weakest[:4])
        lines.append(f"  known worst, to {self.weakest_percent:.1f} %: {terms}")
        return "\n".join(lines)


def what_is_known(model: Model, *, level: float = 0.05) -> Knowledge:
    """Find the essential parameters, and what the data cannot tell.

    The parameter with the largest relative standard deviation is dropped and the others are fitted again, as long as an
    F test does not reject that all the dropped ones are zero.

    Args:
        model: an identified model.
        level: significance at which dropping stops.

    Returns:
        What is known.

    References:
        Presse, Gautier, New criteria of exciting trajectories for robot identification, ICRA 1993.
    """
    covariance = regular_covariance(model)
    names = model.names
    count = len(names)
    freedom = model.uncertainty.degrees_of_freedom
    dropped: list[int] = []
    values, current = model.values.copy(), covariance.copy()
    statistic, p_value = 0.0, 1.0
    while len(dropped) < count - 1:
        with np.errstate(divide="ignore", invalid="ignore"):
            relative = np.sqrt(np.maximum(np.diag(current), 0.0)) / np.abs(values)
        relative[dropped] = -1.0
        candidate = [*dropped, int(np.argmax(np.where(np.isnan(relative), np.inf, relative)))]
        size = len(candidate)
        block = covariance[np.ix_(candidate, candidate)]
        wald = float(model.values[candidate] @ np.linalg.solve(block, model.values[candidate])) / size
        if np.isfinite(freedom):
            probability = float(stats.f.sf(wald, size, max(freedom, 1.0)))
        else:
            probability = float(stats.chi2.sf(wald * size, size))
        if probability < level:
            break
        dropped, statistic, p_value = candidate, wald, probability
        gain = covariance[:, dropped] @ np.linalg.inv(block)
        values = model.values - gain @ model.values[dropped]
        values[dropped] = 0.0
        current = covariance - gain @ covariance[dropped]
        current[dropped], current[:, dropped] = 0.0, 0.0
    reduced = replace(
        model,
        values=values,
        uncertainty=replace(
            model.uncertainty,
            covariance=current if dropped else model.covariance,
            influences=np.zeros((0, count)) if dropped else model.uncertainty.influences,
        ),
    )
    weakest, percent_known = _weakest(names, model.values, covariance)
    return Knowledge(
        essential=tuple(names[k] for k in range(count) if k not in dropped),
        dropped=tuple(names[k] for k in dropped),
        reduced=reduced,
        statistic=statistic,
        p_value=p_value,
        poor=tuple(
            (name, float(percent))
            for name, percent in zip(names, model.relative_std_percent, strict=True)
            if percent > POOR
        ),
        correlated=_correlated(names, covariance),
        weakest=weakest,
        weakest_percent=percent_known,
    )


def _correlated(names: tuple[str, ...], covariance: FloatArray) -> tuple[tuple[str, str, float], ...]:
    std = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(std, std)
    pairs = [
        (names[i], names[j], float(correlation[i, j]))
        for i in range(len(names))
        for j in range(i)
        if abs(correlation[i, j]) > CORRELATED
    ]
    return tuple(sorted(pairs, key=lambda pair: -abs(pair[2])))


def _weakest(
    names: tuple[str, ...], values: FloatArray, covariance: FloatArray
) -> tuple[tuple[tuple[str, float], ...], float]:
    """The direction, in relative units, in which least is known."""
    scale = np.maximum(np.abs(values), np.sqrt(np.diag(covariance)))
    spread, directions = np.linalg.eigh(covariance / np.outer(scale, scale))
    direction = directions[:, -1]
    direction = direction * np.sign(direction[np.argmax(np.abs(direction))])
    order = np.argsort(-np.abs(direction))
    terms = tuple((names[k], float(direction[k])) for k in order if abs(direction[k]) > 0.1)
    return terms, float(100.0 * np.sqrt(max(spread[-1], 0.0)))
