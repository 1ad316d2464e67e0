"""What changes from period to period, and is invisible in the mean."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import stats
from scipy.special import expit

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.fit import Fit
from sea_ident.discrepancy.bench.linear import off
from sea_ident.discrepancy.measured.noise import NoiseFloor, noise_directions, step_freedom
from sea_ident.discrepancy.search.next_effect import BESIDE_ANOTHER
from sea_ident.discrepancy.trends.trend_directions import (
    Direction,
    Name,
    PeriodColumns,
    courses,
    flat_periods,
    inside_of_periods,
    steady_rows,
)
from sea_ident.discrepancy.trends.trend_left_out import surest_values
from sea_ident.discrepancy.trends.trend_scatter import column_space, gain, held_basis, scatter_whitener
from sea_ident.discrepancy.trends.trend_search import Chosen, Sized, as_good, best_trend, find_trends
from sea_ident.discrepancy.trends.trend_values import CourseValues
from sea_ident.effects import Effect
from sea_ident.effects.drift import TrendEffect
from sea_ident.side_by_side import side_by_side

SURE = 3.0
"""Standard deviations by which a value of a trend that is over soon must differ from zero, its course free [-], ..."""

NOT_AT_ALL = 1.0
"""... and of any other: a rate that may as well be none is not told [-], ..."""

CERTAIN = 1e-6
"""... unless what drifts is a matter of chance with no more than this probability: how it went at first may be known no
better than to its own size, and that it went is plain all the same."""

LEVEL = 1e-4
"""Probability that a trend must have by chance at most to be one. The scatter of periods is no normal distribution far
out: of a thousand recordings without a trend about five come out below 1e-3."""

MOST_TRENDS = 4
"""Largest number of trends that are named."""

CARRIED_ON = 0.3
"""Share of what a trend would do after the first period that it must do there, or it was a settling start [-], ..."""

CHANCE = 4.0
"""... and what it must do there for each of its columns: more than two standard deviations."""

FREE_BEND = 2.0
"""What a course that bends must explain more to be as likely as a straight one where the deviations of rates are told:
Akaike's price of a parameter, not that of a name."""

SHADOW = 0.1
"""A trend beside another that explains less than this share of what no trend explains may be a part of that [-]."""

UNEXPLAINED = 0.5
"""Share of what changes from which on trends that leave it are no explanation of it [-]."""

FEWEST_AFTER_START = 5
"""Periods from which on the first may be left out as start-up."""

SOON = 2.0
"""Periods in a time constant below which what drifts is named only where its rate is known."""

SMALLEST_CHANGE = 1e-3
"""A trend must change the torque of an equation by this share of its rms over the recording, or it does not matter."""


@dataclass(frozen=True, eq=False)
class Trend:
    """A trend over the periods.

    Attributes:
        effect: the effect.
        values: (k,) its parameters.
        stds: (k,) their standard deviations, with that of the time constant in them.
        gain: drop of the statistic of the comparison of periods.
        p_value: corrected for all that was tried.
        torque_change: rms over periods of the change, as a share of the torque [-].
        alternatives: others that explain the same, with the share of it that they explain.
        time_constant_std: standard deviation of the time constant [s]; 0 where there is none or the course is straight.
        in_model: whether the model that was diagnosed has it.
    """

    effect: Effect
    values: FloatArray
    stds: FloatArray
    gain: float
    p_value: float
    torque_change: float
    alternatives: tuple[tuple[Effect, float], ...] = ()
    time_constant_std: float = 0.0
    in_model: bool = False

    @property
    def name(self) -> Name:
        """Effect and joint."""
        return self.effect.name, self.effect.joint

    def known(self, deviations: float) -> bool:
        """Whether any value differs from zero by so many of its standard deviations."""
        return bool(np.any(np.abs(self.values) > deviations * self.stds))


@dataclass(frozen=True, eq=False)
class TrendTest:
    """Outcome of the comparison of periods.

    Attributes:
        p_value: of no trend at all.
        trends: what is named, the strongest first.
        unnamed: whether a trend remains that no effect of the library explains.
        notes: what a user should know.
    """

    p_value: float
    trends: tuple[Trend, ...]
    unnamed: bool
    notes: tuple[str, ...] = ()

    @property
    def names(self) -> set[Name]:
        """Effects and joints of what is named."""
        return {trend.name for trend in self.trends}

    @property
    def torque_change(self) -> float:
        """By how much all that is named changes the torque, as a share of it [-]: no more of it is in the mean."""
        return sum(trend.torque_change for trend in self.trends)

    def may_leave(self, remainder: float) -> bool:
        """Whether it is known what drifts, and that may leave so much of the torque in the mean of the periods [-]."""
        return bool(self.trends) and not self.unnamed and remainder <= self.torque_change


def compare_periods(
    bench: Bench, fit: Fit, temperature: FloatArray | None = None, known: Collection[Name] = ()
) -> TrendTest:
    """Test the residuals of the periods for a trend, and name it.

    Args:
        bench: the recording.
        fit: the model.
        temperature: (P, n) mean temperature of every period [degC], None where it was not measured.
        known: trends that the model has.

    Returns:
        The trends.
    """
    periods = bench.data.periods
    if periods < 4:
        return TrendTest(1.0, (), False)
    noise = bench.noise_of_cut(fit)
    flat = flat_periods(bench, fit, noise)
    middle: FloatArray = bench.data.starts + 0.5 * bench.data.period
    omnibus = _omnibus(flat, middle, noise)
    columns = PeriodColumns(bench, fit, noise)
    causes = columns.causes(temperature)
    if not causes:
        return TrendTest(min(1.0, 2.0 * omnibus), (), omnibus < LEVEL)
    space = column_space(causes)
    numbers = flat @ space
    within = side_by_side(lambda cause: columns.within(cause, space), causes)
    directions = [d for cause, own in zip(causes, within, strict=True) for d in courses(cause, own, middle)]
    notes: tuple[str, ...] = ()
    if periods > FEWEST_AFTER_START:
        later = flat[1:] - flat[1:].mean(axis=0)
        settled = _omnibus(later, middle[1:], noise)
        started = _settles(bench, fit, noise, space, directions)
        if started:
            alike = ", which are alike" if settled > LEVEL else ""
            notes = (
                f"{bench.data.source}: the first period differs from the {periods - 1} later ones{alike}: the motion "
                "was still settling. It was left out of the search for trends; start recording later",
            )
            flat, numbers, middle, omnibus = later, later @ space, middle[1:], settled
            directions = [d.over(slice(1, None)) for d in directions]
    plain, scatter = numbers, scatter_whitener(numbers, middle)
    numbers = numbers @ scatter
    directions = [replace(d, columns=scatter @ d.columns) for d in directions]
    change = _Change(bench, fit)

    def matters(own: Sized, others: Sequence[Sized]) -> bool:
        # the form of a large drift is known no better than that of any other effect
        joint = own.direction.effect.joint
        beside = max((change(*each) for each in others if each.direction.effect.joint == joint), default=0.0)
        return change(*own) >= max(SMALLEST_CHANGE, BESIDE_ANOTHER * beside)

    chosen = find_trends(numbers, directions, middle, noise, MOST_TRENDS, LEVEL, matters, known)
    whole = {cause.name: cause for cause in causes}

    as_seen = np.linalg.inv(scatter)

    def values_of(direction: Direction, beside: Sequence[Direction]) -> CourseValues:
        own = [replace(d, columns=as_seen @ d.columns).course for d in (direction, *beside)]
        found = surest_values(plain, own, middle)
        return columns.inside(direction, found, middle, whole[direction.name].temperature)

    held = held_basis(
        [replace(c.direction, columns=columns.within(whole[c.direction.name])[-len(flat) :]) for c in chosen]
    )
    left = flat if held is None else off(held, flat.ravel()).reshape(flat.shape)
    unnamed = _omnibus(left, middle, noise) < LEVEL
    if unnamed and chosen:
        unexplained = trend_excess(left, middle)
        while len(chosen) > 1 and chosen[-1].gain < SHADOW * unexplained:
            chosen = find_trends(numbers, directions, middle, noise, len(chosen) - 1, LEVEL, matters, known)
        whole_excess = trend_excess(flat, middle)
        if unexplained > UNEXPLAINED * whole_excess:
            chosen = []
        # nor is the form of a large drift known any better than to that share of it
        unnamed = not chosen or unexplained > BESIDE_ANOTHER**2 * whole_excess
    column_p = min((c.p_value for c in chosen), default=1.0)
    if not chosen:
        column_p = best_trend(numbers, directions, middle, noise).p_value
    trends = tuple(_trend(numbers, chosen, k, directions, middle, change, values_of) for k in range(len(chosen)))
    soon = [_is_over_soon(bench, c.direction) for c in chosen]
    told = [
        trend.known(SURE if over else NOT_AT_ALL) or (not over and trend.p_value < CERTAIN)
        for trend, over in zip(trends, soon, strict=True)
    ]
    if not all(told):
        notes += tuple(
            _not_told(bench, trend, over) for trend, over, known in zip(trends, soon, told, strict=True) if not known
        )
        chosen = [c for c, known in zip(chosen, told, strict=True) if known]
        trends = tuple(_trend(numbers, chosen, k, directions, middle, change, values_of) for k in range(len(chosen)))
    trends = tuple(replace(trend, in_model=trend.name in known) for trend in trends)
    return TrendTest(min(1.0, 2.0 * min(omnibus, column_p)), trends, unnamed, notes)


def _settles(bench: Bench, fit: Fit, noise: NoiseFloor, space: FloatArray, directions: Sequence[Direction]) -> bool:
    """Whether the first period differs from the later ones, and these do not go on with it."""
    middle: FloatArray = bench.data.starts + 0.5 * bench.data.period
    inside = inside_of_periods(bench, fit, noise)
    numbers = inside @ space
    first = best_trend(numbers, directions, middle, noise)
    differs = min(first.p_value, _apart(inside[0], inside[1:])) < LEVEL
    return differs and _only_in_the_first(numbers, first.direction)


def _only_in_the_first(numbers: FloatArray, direction: Direction) -> bool:
    """Whether a trend is not seen without the first period."""
    rest, later = direction.over(slice(1, None)), numbers[1:] - numbers[1:].mean(axis=0)
    expected = gain(numbers, direction)[0] * float(np.sum(rest.profile**2) / np.sum(direction.profile**2))
    return bool(gain(later, rest)[0] < max(CARRIED_ON * expected, CHANCE * direction.columns.shape[2]))


def _omnibus(flat: FloatArray, middle: FloatArray, noise: NoiseFloor) -> float:
    """Probability of the linear trend in everything at once."""
    profile = middle - middle.mean()
    along = profile @ flat / np.linalg.norm(profile)
    dof = max(int(np.count_nonzero(np.abs(along) > 0.0)), 1)
    ratio = float(along @ along) / dof
    directions = min(noise_directions(np.diff(flat, axis=0)), float(dof))
    return float(stats.f.sf(ratio, directions, directions * step_freedom(len(flat))))


def trend_excess(flat: FloatArray, middle: FloatArray) -> float:
    """What the linear trend in everything is beyond the scatter of the periods."""
    profile = middle - middle.mean()
    along = profile @ flat / np.linalg.norm(profile)
    return float(along @ along - np.sum(np.diff(flat, axis=0) ** 2) / (2.0 * (len(flat) - 1)))


def _apart(first: FloatArray, later: FloatArray) -> float:
    """Probability of the distance (M,) of the first period from the mean of the later ones (P - 1, M)."""
    difference = (first - later.mean(axis=0)) / np.sqrt(1.0 + 1.0 / len(later))
    dof = max(int(np.count_nonzero(np.abs(difference) > 0.0)), 1)
    directions = min(noise_directions(np.diff(later, axis=0)), float(dof))
    spread = float(np.sum(np.diff(later, axis=0) ** 2)) / (2.0 * (len(later) - 1))
    ratio = float(difference @ difference) / max(spread, 1e-300)
    return float(stats.f.sf(ratio, directions, directions * step_freedom(len(later))))


def _is_over_soon(bench: Bench, direction: Direction) -> bool:
    """Whether what drifts stands still again after a period or two: whatever was still settling does that."""
    constant = float(getattr(direction.effect, "time_constant", np.inf))
    return direction.bent and constant < SOON * bench.data.period


def _not_told(bench: Bench, trend: Trend, over_soon: bool) -> str:
    effect = trend.effect
    if not over_soon:
        return (
            f"{bench.data.source}: the periods differ a little as {effect.title} would make them, but its rate is "
            "known no better than to its own size: it is not named. Record more periods"
        )
    return (
        f"{bench.data.source}: the first periods differ as {effect.title} would make them, but it is over so soon "
        f"(within about {getattr(effect, 'time_constant', 0.0):.2g} s) that its rate is not known: it is not named. "
        "Record more periods from the same start, or start recording later"
    )


class _Change:
    """How much trends of a recording change its torques.

    Args:
        bench: the recording.
        fit: the model.
    """

    def __init__(self, bench: Bench, fit: Fit) -> None:
        self._bench, self._fit = bench, fit

    def __call__(self, direction: Direction, values: FloatArray) -> float:
        """Rms over the periods of the change of the torque, as a share of the torque of its equation."""
        effect, bench = direction.effect, self._bench
        if not isinstance(effect, TrendEffect):
            return 0.0
        rows = bench.data.rows(steady_rows(bench, self._fit, effect)) @ values
        spread = np.sqrt(np.mean(direction.profile**2))
        return float(np.max(np.sqrt(np.mean(rows**2, axis=0)) * spread / np.maximum(bench.torque_rms, 1e-300)))


def _trend(
    numbers: FloatArray,
    chosen: Sequence[Chosen],
    position: int,
    directions: Sequence[Direction],
    middle: FloatArray,
    change: _Change,
    values_of: Callable[[Direction, Sequence[Direction]], CourseValues],
) -> Trend:
    """One of the trends that were chosen, its values beside the others, and what else it could be."""
    own, others = chosen[position], [c for k, c in enumerate(chosen) if k != position]
    direction = own.direction
    beside = [c.direction for c in others]
    values = values_of(direction, beside)
    held = held_basis(beside)
    directions = [d for d in directions if d.name == direction.name or d.name not in {c.direction.name for c in others}]
    alternatives = as_good(numbers, directions, middle, own, held)
    at_start = _at_start(direction, values.values)
    # of a share of what drifts itself: d (v / (1 + v c)) = (1 / (1 + v c))^2 dv
    share = np.divide(at_start, values.values, out=np.ones_like(at_start), where=values.values != 0.0)
    stds = values.stds * share**2
    bends = [d for d in directions if d.name == direction.name and d.bent]
    if bends and not direction.bent:
        bent = max(bends, key=lambda d: gain(numbers, d, held)[0])
        rival = values_of(bent, beside)
        chance = float(expit(0.5 * (gain(numbers, bent, held)[0] - own.gain - FREE_BEND)))
        stds = _of_either(at_start, stds, _at_start(bent, rival.values), rival.stds, chance)
    return Trend(
        effect=direction.effect,
        values=at_start,
        stds=stds,
        gain=own.gain,
        p_value=own.p_value,
        torque_change=change(direction, values.values),
        alternatives=alternatives,
        time_constant_std=getattr(direction.effect, "time_constant", 0.0) * values.bend_std,
    )


def _at_start(direction: Direction, values: FloatArray) -> FloatArray:
    if not isinstance(direction.effect, TrendEffect):
        return values
    return direction.effect.referred(values, direction.level)


def _of_either(
    values: FloatArray, stds: FloatArray, others: FloatArray, their: FloatArray, chance: float
) -> FloatArray:
    """(k,) standard deviations of values that by some chance are those of another model.

    As Buckland, Burnham, Augustin, Model selection: an integral part of inference, Biometrics 53, 1997.

    A course that is called straight because nothing speaks for its bend may bend all the same: the rate at its start is
    another one then, by far more than the scatter around a straight course.
    """
    return np.sqrt((1.0 - chance) * stds**2 + chance * (their**2 + (others - values) ** 2))
