"""What changes from period to period, and is invisible in the mean."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import stats
from scipy.interpolate import interp1d

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.bench import Bench
from sea_ident.discrepancy.fit import Fit
from sea_ident.discrepancy.linear import whiten
from sea_ident.discrepancy.noise import ComplexArray, NoiseFloor, noise_directions, step_freedom
from sea_ident.discrepancy.trend_values import Course, bend, course_values, time_constants
from sea_ident.effects import Effect, effect_classes
from sea_ident.effects.drift import TrendEffect
from sea_ident.exceptions import EffectError

LEVEL = 1e-3
"""Probability of naming a trend where there is none."""

MOST_TRENDS = 2
"""Largest number of trends that are named."""

CARRIED_ON = 0.3
"""Share of what a trend would do after the first period that it must do there, or it was a settling start [-], ..."""

CHANCE = 4.0
"""... and what it must do there for each of its columns: more than two standard deviations."""

EQUALLY_GOOD = 13.8
"""Two trends between whose gains there is less than this (odds of a thousand) are not told apart."""

FEWEST_AFTER_START = 5
"""Periods from which on the first may be left out as start-up."""

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
    """

    effect: Effect
    values: FloatArray
    stds: FloatArray
    gain: float
    p_value: float
    torque_change: float
    alternatives: tuple[tuple[Effect, float], ...] = ()
    time_constant_std: float = 0.0


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


@dataclass(frozen=True, eq=False)
class _Direction:
    """A trend as columns: profile over the periods, whitened columns and a basis of them, which columns they are.

    A profile that is bent has its change with the logarithm of the time constant beside it.
    """

    effect: Effect
    profile: FloatArray
    columns: FloatArray
    basis: FloatArray
    used: tuple[int, ...]
    count: int
    bend: FloatArray | None = None

    def over(self, periods: slice) -> "_Direction":
        """The same in a part of the periods."""
        profile, bent = self.profile[periods], None if self.bend is None else self.bend[periods]
        return replace(self, profile=profile - profile.mean(), bend=None if bent is None else bent - bent.mean())


def compare_periods(bench: Bench, fit: Fit, noise: NoiseFloor, temperature: FloatArray | None = None) -> TrendTest:
    """Test the residuals of the periods for a trend, and name it.

    Args:
        bench: the recording.
        fit: the model.
        noise: its noise floor.
        temperature: (P, n) mean temperature of every period [degC], None where it was not measured.

    Returns:
        The trends.
    """
    periods = bench.data.periods
    if periods < 4:
        return TrendTest(1.0, (), False)
    residuals = bench.period_residuals(fit)
    whitener, free = bench.whitener(noise), bench.free_basis(noise)
    # whitened for the residual of one period: its variance is that of the mean times the number of periods
    flat = np.stack([whiten(whitener, residual) for residual in residuals]) / np.sqrt(periods)
    flat = flat - (flat @ free) @ free.T
    flat -= flat.mean(axis=0)
    middle: FloatArray = (np.arange(periods, dtype=np.float64) + 0.5) * bench.data.period
    directions = _directions(bench, fit, whitener / np.sqrt(periods), free, middle, temperature)
    omnibus = _omnibus(flat, middle, noise)
    notes: tuple[str, ...] = ()
    tests = max(len(directions), 1)
    if periods > FEWEST_AFTER_START:
        later_periods = flat[1:]
        later = later_periods - later_periods.mean(axis=0)
        settled = _omnibus(later, middle[1:], noise)
        started = omnibus < LEVEL < settled
        if not started and directions:
            best, p_value = _most_likely(flat, directions, [_gain(flat, d) for d in directions], tests, noise)
            differs = min(p_value, _apart(flat[0], later_periods)) < LEVEL
            started = differs and _only_in_the_first(flat, later, directions[best])
        if started:
            notes = (
                f"{bench.data.source}: the first period differs from the {periods - 1} later ones, which are "
                "alike: the motion was still settling. It was left out of the search for trends; start recording later",
            )
            flat, middle, omnibus, periods = later, middle[1:], settled, periods - 1
            directions = [d.over(slice(1, None)) for d in directions]
    named: list[tuple[_Direction, float, float]] = []
    left = flat
    while len(named) < MOST_TRENDS and directions:
        gains = [_gain(left, d) for d in directions]
        best, p_value = _most_likely(left, directions, gains, tests, noise)
        if p_value > LEVEL or _change(bench, left, directions[best], periods) < SMALLEST_CHANGE:
            break
        chosen = directions[best]
        named.append((chosen, gains[best], p_value))
        directions = [
            d for d in directions if (d.effect.name, d.effect.joint) != (chosen.effect.name, chosen.effect.joint)
        ]
        left = flat - _explained(flat, [d for d, _, _ in named])
    column_p = min((p for _, _, p in named), default=1.0)
    if not named and directions:
        column_p = _most_likely(flat, directions, [_gain(flat, d) for d in directions], tests, noise)[1]
    trends = tuple(
        _trend(bench, flat, d, gain, p, directions, [o for o, _, _ in named if o is not d]) for d, gain, p in named
    )
    unnamed = _omnibus(left, middle, noise) < LEVEL if named else omnibus < LEVEL
    return TrendTest(min(1.0, 2.0 * min(omnibus, column_p)), trends, unnamed, notes)


def within_periods(
    bench: Bench, fit: Fit, trends: Sequence[Trend], temperature: FloatArray | None = None
) -> FloatArray:
    """Torque of trends in the mean period, beyond what they do to all of its phases alike.

    What drifts from period to period drifts within a period too: its end comes later than its beginning, every time.

    Args:
        bench: the recording.
        fit: the model.
        trends: of its periods.
        temperature: (P, n) mean temperature of every period [degC], None where it was not measured.

    Returns:
        (N, E) torque [N m].
    """
    data, state = bench.data, bench.state(fit.effects)
    phase = (np.arange(data.samples) + 0.5) / data.samples
    time = (np.arange(data.periods)[:, None] + phase) * data.period
    total = np.zeros((data.samples, len(data.equations)))
    for trend in trends:
        if not isinstance(trend.effect, TrendEffect):
            continue
        own = None
        if temperature is not None and trend.effect.joint is not None:
            middle = (np.arange(data.periods) + 0.5) * data.period
            each = temperature[:, bench.robot.index(trend.effect.joint)]
            own = interp1d(middle, each, fill_value="extrapolate")(time.ravel())
        change = trend.effect.change(time.ravel(), own).reshape(time.shape)
        course = np.mean(change - np.mean(change, axis=1, keepdims=True), axis=0)
        total += course[:, None] * (data.rows(trend.effect.steady(state)) @ trend.values)
    return total


def trend_effects(bench: Bench) -> list[Effect]:
    """Every trend of the library at every joint."""
    found: list[Effect] = []
    for _, kind in sorted(effect_classes().items()):
        if issubclass(kind, TrendEffect):
            found.extend(kind.instances(bench.robot))
    return found


def _directions(
    bench: Bench,
    fit: Fit,
    whitener: ComplexArray,
    free: FloatArray,
    middle: FloatArray,
    temperature: FloatArray | None,
) -> list[_Direction]:
    state = bench.state(fit.effects)
    found: list[_Direction] = []
    for plain in trend_effects(bench):
        effect = bench.anchored((*fit.effects, plain), fit.parameters)[-1]
        if not isinstance(effect, TrendEffect):
            continue
        own = None
        if temperature is not None and effect.joint is not None:
            own = temperature[:, bench.robot.index(effect.joint)]
            own = own if np.all(np.isfinite(own)) else None
        try:
            spectra = bench.spectra_of(effect.steady(state), fit.effects) * fit.scale[:, None]
            variants = [replace(effect, time_constant=c) for c in time_constants(effect, middle)]  # type: ignore[call-arg]
            changes = [v.change(middle, own) for v in variants]
            bends = [bend(v, middle, own) if v is not variants[-1] else None for v in variants]
        except EffectError:
            continue
        columns = whiten(whitener, spectra)
        columns = columns - free @ (free.T @ columns)
        norms = np.linalg.norm(columns, axis=0)
        if not np.all(norms > 0.0):
            continue
        count = columns.shape[1]
        choices = [tuple(range(count)), *((k,) for k in range(count) if count > 1)]
        bases = [np.linalg.qr((columns / norms)[:, used])[0] for used in choices]
        for variant, change, bent in zip(variants, changes, bends, strict=True):
            profile = change - change.mean()
            if np.linalg.norm(profile) > 1e-12:
                found.extend(
                    _Direction(variant, profile, columns[:, used], basis, used, count, bent)
                    for used, basis in zip(choices, bases, strict=True)
                )
    return found


def _gain(flat: FloatArray, direction: _Direction) -> float:
    """Drop of the statistic; none where columns that change by one cause would have to change in opposite ways."""
    along = direction.profile @ (flat @ direction.basis) / np.linalg.norm(direction.profile)
    if len(direction.used) > 1:
        values = _values(flat, direction)[list(direction.used)]
        if np.any(values > 0.0) and np.any(values < 0.0):
            return 0.0
    return float(along @ along)


def _only_in_the_first(flat: FloatArray, later: FloatArray, direction: _Direction) -> bool:
    """Whether a trend is not seen without the first period."""
    rest = direction.over(slice(1, None))
    expected = _gain(flat, direction) * float(np.sum(rest.profile**2) / np.sum(direction.profile**2))
    return bool(_gain(later, rest) < max(CARRIED_ON * expected, CHANCE * direction.basis.shape[1]))


def _most_likely(
    flat: FloatArray, directions: list[_Direction], gains: list[float], tests: int, noise: NoiseFloor
) -> tuple[int, float]:
    """Of the trends that explain about as much as the best, the one that the scatter of the periods speaks for most."""
    close = [k for k, gain in enumerate(gains) if gain >= max(gains) - EQUALLY_GOOD]
    # directions of one effect at one joint are much alike; those of others are tests of their own
    families = len({(d.effect.name, d.effect.joint) for d in directions})
    p_values = [
        min(
            1.0,
            max(_p_value(gains[k], len(directions[k].used), tests, noise), families * _scatter_p(flat, directions[k])),
        )
        for k in close
    ]
    best = int(np.argmin(p_values))
    return close[best], p_values[best]


def _explained(flat: FloatArray, directions: list[_Direction]) -> FloatArray:
    """Part of the residuals (P, M) that several trends explain together."""
    columns = [np.outer(d.profile / np.linalg.norm(d.profile), b).ravel() for d in directions for b in d.basis.T]
    basis = np.linalg.qr(np.stack(columns, axis=1))[0]
    explained: FloatArray = (basis @ (basis.T @ flat.ravel())).reshape(flat.shape)
    return explained


def _p_value(gain: float, columns: int, tests: int, noise: NoiseFloor) -> float:
    return min(1.0, tests * float(stats.f.sf(gain / columns, columns, max(noise.total_freedom, 4.0))))


def _scatter_p(flat: FloatArray, direction: _Direction) -> float:
    """Probability of the trend by the scatter of the periods along its own columns.

    Noise that gathers where the columns are large (friction that differs from pass to pass) is larger there than the
    noise floor, which is one for all phases of the period, says.
    """
    profile = direction.profile / np.linalg.norm(direction.profile)
    along = flat @ direction.basis
    amount = profile @ along
    rest = along - np.outer(profile, amount)
    freedom, width = len(flat) - 2, direction.basis.shape[1]
    if freedom < width:
        return 0.0
    # Hotelling: every combination of the columns in its own scatter, that of one says nothing about another
    spread = rest.T @ rest / freedom
    distance = float(amount @ np.linalg.pinv(spread, hermitian=True) @ amount)
    ratio = distance * (freedom - width + 1) / (freedom * width)
    return float(stats.f.sf(ratio, width, freedom - width + 1))


def _omnibus(flat: FloatArray, middle: FloatArray, noise: NoiseFloor) -> float:
    """Probability of the linear trend in everything at once."""
    profile = middle - middle.mean()
    along = profile @ flat / np.linalg.norm(profile)
    dof = max(int(np.count_nonzero(np.abs(along) > 0.0)), 1)
    ratio = float(along @ along) / dof
    directions = min(noise_directions(flat), float(dof))
    return float(stats.f.sf(ratio, directions, directions * step_freedom(len(flat))))


def _apart(first: FloatArray, later: FloatArray) -> float:
    """Probability of the distance (M,) of the first period from the mean of the later ones (P - 1, M)."""
    difference = (first - later.mean(axis=0)) / np.sqrt(1.0 + 1.0 / len(later))
    dof = max(int(np.count_nonzero(np.abs(difference) > 0.0)), 1)
    directions = min(noise_directions(later), float(dof))
    spread = float(np.sum(np.diff(later, axis=0) ** 2)) / (2.0 * (len(later) - 1))
    ratio = float(difference @ difference) / max(spread, 1e-300)
    return float(stats.f.sf(ratio, directions, directions * step_freedom(len(later))))


def _change(bench: Bench, flat: FloatArray, direction: _Direction, periods: int) -> float:
    """Rms over the periods of the change of the torque, as a share of the torque of its equation."""
    values = _values(flat, direction)
    state = bench.state(())
    rows = bench.data.rows(direction.effect.steady(state)) @ values  # type: ignore[attr-defined]
    spread = np.sqrt(np.mean(direction.profile**2))
    return float(np.max(np.sqrt(np.mean(rows**2, axis=0)) * spread / np.maximum(bench.torque_rms, 1e-300)))


def _values(flat: FloatArray, direction: _Direction) -> FloatArray:
    """(k,) estimates of all columns of the effect; those that are not used are zero."""
    along = direction.profile @ flat / float(direction.profile @ direction.profile)
    out = np.zeros(direction.count)
    out[list(direction.used)] = np.linalg.lstsq(direction.columns, along, rcond=1e-10)[0]
    return out


def _trend(
    bench: Bench,
    flat: FloatArray,
    direction: _Direction,
    gain: float,
    p_value: float,
    directions: list[_Direction],
    others: list[_Direction],
) -> Trend:
    left = flat - _explained(flat, others) if others else flat
    own, *_ = course_values(flat, [Course(d.profile, d.columns, d.bend) for d in (direction, *others)])
    values, stds = np.zeros(direction.count), np.zeros(direction.count)
    values[list(direction.used)], stds[list(direction.used)] = own.values, own.stds
    alternatives: dict[tuple[str, str | None], tuple[Effect, float]] = {}
    explained = _explained(left, [direction])
    for other in directions:
        key = (other.effect.name, other.effect.joint)
        if key == (direction.effect.name, direction.effect.joint):
            continue
        if direction.effect.name == "temperature_friction" and key == ("friction_drift", direction.effect.joint):
            continue  # the same without its cause: a measured temperature says more than any time
        share = float(np.sum(_explained(explained, [other]) ** 2) / np.sum(explained**2))
        lost = gain - _gain(left, other)
        if lost < EQUALLY_GOOD and share > alternatives.get(key, (other.effect, 0.0))[1]:
            alternatives[key] = (other.effect, share)
    return Trend(
        effect=direction.effect,
        values=values,
        stds=stds,
        gain=gain,
        p_value=p_value,
        torque_change=_change(bench, left, direction, len(flat)),
        alternatives=tuple(sorted(alternatives.values(), key=lambda a: -a[1])),
        time_constant_std=getattr(direction.effect, "time_constant", 0.0) * own.bend_std,
    )
