"""What a recording tells and what it does not: essential parameters, correlations, information."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import stats

from sea_ident._typing import FloatArray
from sea_ident.base_parameters import find_base_parameters
from sea_ident.effects import Effect
from sea_ident.estimation.model import Model
from sea_ident.estimation.uncertainty import FEWEST_BLOCKS
from sea_ident.exceptions import IdentificationError

CORRELATED = 0.95
"""Correlation from which on two parameters are hardly told apart."""

ROUNDING = 1e-12
"""Share of unity that keeps a covariance positive definite."""

POOR = 30.0
"""Relative standard deviation [%] from which on a parameter is not told."""


def regular_covariance(model: Model) -> FloatArray:
    """A covariance of the base parameters that can be inverted.

    The spread of P periods gives a matrix of rank P - 1 with false sharp directions. In coordinates in which eq. 13 is
    unity it is drawn toward a multiple of unity, the more the fewer periods there are and the less they contradict
    eq. 13. Directions that the motion tells sharply stay sharp and no others become so, which keeping every standard
    deviation as it was seen would not give.

    Args:
        model: an identified model.

    Returns:
        (b, b) positive definite covariance.

    References:
        Chen, Wiesel, Eldar, Hero, Shrinkage algorithms for MMSE covariance estimation, IEEE Transactions on Signal
        Processing, 2010 (the factor of shrinkage).
    """
    least = 1e-12 * np.maximum(np.abs(model.values), 1e-12)
    scale = np.maximum(np.sqrt(np.maximum(np.diag(model.model_covariance), 0.0)), least)
    strength, directions = np.linalg.eigh(model.model_covariance / np.outer(scale, scale))
    root = scale[:, None] * directions * np.sqrt(np.maximum(strength, ROUNDING * strength[-1]))
    half = np.linalg.solve(root, model.covariance)
    seen = np.linalg.solve(root, half.T)
    freedom = model.uncertainty.degrees_of_freedom
    drawn = _shrunk(0.5 * (seen + seen.T), freedom if np.isfinite(freedom) else FEWEST_BLOCKS)
    return np.asarray(root @ drawn @ root.T, dtype=np.float64)


def _shrunk(covariance: FloatArray, freedom: float) -> FloatArray:
    """A covariance (b, b) drawn toward a multiple of unity, as far as its degrees of freedom advise."""
    size = len(covariance)
    trace = float(np.trace(covariance))
    if trace <= 0.0:
        return ROUNDING * np.eye(size)
    square = float(np.sum(covariance**2))
    spread = (freedom + 1.0 - 2.0 / size) * (square - trace**2 / size)
    share = 1.0 if spread <= 0.0 else min(1.0, ((1.0 - 2.0 / size) * square + trace**2) / spread)
    share = max(share, ROUNDING)
    return np.asarray((1.0 - share) * covariance + share * trace / size * np.eye(size), dtype=np.float64)


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
    # what is left is known as well as was stated, or better where dropping others helps
    stated = model.std / np.sqrt(np.diag(covariance))
    reduced = replace(
        model,
        values=values,
        uncertainty=replace(
            model.uncertainty,
            covariance=current * np.outer(stated, stated) if dropped else model.covariance,
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
