"""Which trends there are: chosen one beside the other, exchanged, and kept where each is needed."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy import stats
from scipy.optimize import minimize_scalar

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.measured.noise import NoiseFloor
from sea_ident.discrepancy.trends.trend_directions import Direction, Name, with_course
from sea_ident.discrepancy.trends.trend_scatter import blocks, gain, held_basis, scatter_p
from sea_ident.discrepancy.trends.trend_values import times_course
from sea_ident.effects import Effect

PRICE_OF_A_BEND = 6.6
"""What a time constant of its own must explain beyond a straight course, or one that was measured: one in a hundred."""

EQUALLY_GOOD = 13.8
"""Two trends between whose gains there is less than this (odds of a thousand) are not told apart."""

FORM = 1e-3
"""Share of its gain up to which the form of a trend is known no better than that of another one [-]: what a wrist with
next to no load does with a torque constant that falls is friction that grows, but for a part in a thousand."""

ROUNDS = 3
"""Largest number of exchanges of all trends."""


@dataclass(frozen=True, eq=False)
class Chosen:
    """A trend that was chosen.

    Attributes:
        direction: the trend, with its course.
        used: columns that speak for it.
        gain: drop of the statistic beside the others.
        p_value: corrected for all that was tried.
    """

    direction: Direction
    used: tuple[int, ...]
    gain: float
    p_value: float

    def worth(self, warmed: Collection[str | None]) -> float:
        """Gain, less the price of a time constant, and of a course in time where there is that of a temperature."""
        direction = self.direction
        own_course = direction.effect.name == "friction_drift" and direction.effect.joint in warmed
        return self.gain - PRICE_OF_A_BEND * (int(direction.bent) + int(own_course))

    @property
    def net(self) -> float:
        """Gain, less the price of a time constant and of every column but the first."""
        return self.gain - PRICE_OF_A_BEND * (int(self.direction.bent) + len(self.used) - 1)


class Sized(NamedTuple):
    """A trend with its course and its values (k,)."""

    direction: Direction
    values: FloatArray


def best_trend(
    periods: FloatArray,
    directions: Sequence[Direction],
    middle: FloatArray,
    noise: NoiseFloor,
    held: Sequence[Direction] = (),
) -> Chosen:
    """The trend that explains most beside others.

    Args:
        periods: (P, M) whitened numbers of every period.
        directions: trends to choose from.
        middle: (P,) middles of the periods [s].
        noise: noise floor.
        held: trends beside it, their sizes and courses free.

    Returns:
        It, with the course that explains most.
    """
    basis = held_basis(held)
    names = {d.name for d in held}
    tried = [_untested(periods, d, basis) for d in directions if d.name not in names]
    warmed = {d.effect.joint for d in directions if d.effect.name == "temperature_friction"}
    best = max(tried, key=lambda c: c.worth(warmed))
    if best.direction.bent:
        best = _refined(periods, best, middle, basis)
    families = len({d.name for d in directions})
    by_floor = len(directions) * stats.f.sf(best.gain / len(best.used), len(best.used), max(noise.total_freedom, 4.0))
    by_scatter = families * scatter_p(periods, best.direction.only(best.used), held)
    return replace(best, p_value=min(1.0, float(max(by_floor, by_scatter))))


def _untested(periods: FloatArray, direction: Direction, basis: FloatArray | None) -> Chosen:
    amount, used = gain(periods, direction, basis)
    return Chosen(direction, used, amount, 1.0)


def _refined(periods: FloatArray, start: Chosen, middle: FloatArray, basis: FloatArray | None) -> Chosen:
    """The same with the time constant that explains most."""

    def at(logarithm: float) -> Direction:
        effect = replace(start.direction.effect, time_constant=float(np.exp(logarithm)))  # type: ignore[call-arg]
        return with_course(effect, start.direction.columns, middle)

    first = float(np.log(start.direction.effect.time_constant))  # type: ignore[attr-defined]
    found = minimize_scalar(
        lambda x: -gain(periods, at(x), basis)[0], bounds=(first - 0.5, first + 0.5), method="bounded",
        options={"xatol": 1e-3},
    )  # fmt: skip
    new = _untested(periods, at(float(found.x)), basis)
    return new if new.gain > start.gain else start


def as_good(
    periods: FloatArray,
    directions: Sequence[Direction],
    middle: FloatArray,
    own: Chosen,
    held: FloatArray | None,
) -> tuple[tuple[Effect, float], ...]:
    """What explains as much as a trend, each kind with the course that explains most.

    Args:
        periods: (P, M) whitened numbers of every period.
        directions: trends to choose from.
        middle: (P,) middles of the periods [s].
        own: the trend.
        held: orthonormal basis of the trends beside it; None where there are none.

    Returns:
        Effects, and the share of what the trend explains that each does, the largest first.
    """
    best: dict[Name, Chosen] = {}
    for direction in directions:
        tried = _untested(periods, direction, held)
        if direction.name != own.direction.name and tried.net >= best.get(direction.name, tried).net:
            best[direction.name] = tried
    found = []
    for rival in best.values():
        refined = _refined(periods, rival, middle, held) if rival.direction.bent else rival
        if own.net - refined.net < max(EQUALLY_GOOD, FORM * own.gain):
            found.append((refined.direction.effect, alike(periods, own.direction, refined.direction, held)))
    return tuple(sorted(found, key=lambda each: -each[1]))


def find_trends(
    periods: FloatArray,
    directions: Sequence[Direction],
    middle: FloatArray,
    noise: NoiseFloor,
    most: int,
    level: float,
    matters: Callable[[Sized, Sequence[Sized]], bool],
    known: Collection[Name] = (),
) -> list[Chosen]:
    """Trends that are there, the strongest first.

    Every one is judged beside the others, their sizes and courses free: what one leaves where its course is not quite
    that of the library is no trend of another joint or kind.

    Args:
        periods: (P, M) whitened numbers of every period.
        directions: trends to choose from.
        middle: (P,) middles of the periods [s].
        noise: noise floor.
        most: largest number.
        level: of the probability of naming one where there is none.
        matters: whether a trend with its values is worth a name beside others with theirs.
        known: trends that the model has: where they are there, no other takes their place.

    Returns:
        The trends.
    """
    named: list[Chosen] = []
    for name in known:
        own_courses = [d for d in directions if d.name == name]
        if own_courses:
            new = best_trend(periods, own_courses, middle, noise, [c.direction for c in named])
            named.extend([new] if new.p_value <= level else [])
    for _ in range(most - len(named)):
        others = [c.direction for c in named]
        if len({d.name for d in directions} - {d.name for d in others}) == 0:
            break
        new = best_trend(periods, directions, middle, noise, others)
        if new.p_value > level:
            break
        *beside, own = _sized(periods, [*named, new])
        if not matters(own, ()):
            break
        if not matters(own, beside):
            directions = [d for d in directions if d.name != own.direction.name]
            continue
        named = _exchanged(periods, directions, middle, noise, [*named, new], known)
        if any(c.p_value > level for c in named):
            named = [c for c in named if c.p_value <= level]
            break
    return sorted(named, key=lambda c: -c.gain)


def _exchanged(
    periods: FloatArray,
    directions: Sequence[Direction],
    middle: FloatArray,
    noise: NoiseFloor,
    named: list[Chosen],
    known: Collection[Name],
) -> list[Chosen]:
    """Every trend in turn replaced by what explains most beside the others, those of the model by their best course."""
    for _ in range(ROUNDS):
        before = [c.direction.name for c in named]
        for k in range(len(named)):
            others = [c.direction for i, c in enumerate(named) if i != k]
            held = named[k].direction.name in known
            own = [d for d in directions if d.name == named[k].direction.name] if held else directions
            named[k] = best_trend(periods, own, middle, noise, others)
        if [c.direction.name for c in named] == before:
            break
    return named


def _sized(periods: FloatArray, chosen: Sequence[Chosen]) -> list[Sized]:
    """Trends with the values that each has beside the others."""
    held = [[other.direction for other in chosen if other is not own] for own in chosen]
    return [Sized(own.direction, _values(periods, own, others)) for own, others in zip(chosen, held, strict=True)]


def _values(periods: FloatArray, chosen: Chosen, held: Sequence[Direction]) -> FloatArray:
    """(k,) values of a trend beside others; those of columns that do not speak for it are zero."""
    own = chosen.direction.only(chosen.used)
    lengths = np.linalg.norm(times_course(own.columns, own.profile), axis=0)
    design = np.concatenate([blocks(own), *(blocks(d, bends=True) for d in held)], axis=1)
    amounts = np.linalg.lstsq(design, periods.ravel(), rcond=1e-10)[0]
    values = np.zeros(chosen.direction.columns.shape[2])
    values[list(chosen.used)] = amounts[: len(chosen.used)] / lengths
    return values


def alike(periods: FloatArray, one: Direction, other: Direction, held: FloatArray | None) -> float:
    """Share of what one trend explains beside others that another explains too."""
    target = periods.ravel()
    bases = []
    for direction in (one, other):
        own = blocks(direction)
        if held is not None:
            own = own - held @ (held.T @ own)
        bases.append(np.linalg.qr(own)[0])
    explained = bases[0] @ (bases[0].T @ target)
    return float(np.sum((bases[1].T @ explained) ** 2) / max(float(explained @ explained), 1e-300))
