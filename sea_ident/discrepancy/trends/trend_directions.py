"""Every trend of the library as columns times a course over the periods."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import interp1d

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.fit import Fit
from sea_ident.discrepancy.bench.free_shapes import moving, signal_effects
from sea_ident.discrepancy.bench.linear import whiten
from sea_ident.discrepancy.measured.data import spectrum, waveform
from sea_ident.discrepancy.measured.noise import ComplexArray, NoiseFloor
from sea_ident.discrepancy.trends.trend_values import Course, CourseValues, bend, time_constants
from sea_ident.effects import Contribution, Effect, corrected_motion, effect_classes
from sea_ident.effects.drift import TrendEffect
from sea_ident.effects.load import LoadEffect
from sea_ident.effects.stiffness_drift import StiffnessDrift
from sea_ident.exceptions import EffectError

Name = tuple[str, str | None]

SAME_COLUMN = 1e-6
"""Combinations of the columns of a trend weaker than this share of the strongest are none [-]."""

LOAD_STEP = 1e-4
"""Share of a stiffness by which the change of a load with it is told."""


@dataclass(frozen=True, eq=False)
class Cause:
    """A trend without a course.

    Attributes:
        effect: the effect.
        columns: (M, k) its whitened columns in the mean period.
        temperature: (P,) of its joint [degC], None where it was not measured or does not matter.
    """

    effect: Effect
    columns: FloatArray
    temperature: FloatArray | None

    @property
    def name(self) -> Name:
        """Effect and joint."""
        return self.effect.name, self.effect.joint


@dataclass(frozen=True, eq=False)
class Direction:
    """A trend with one course.

    Attributes:
        effect: the effect, with the time constant of the course.
        profile: (P,) course, without mean.
        columns: (P, M, k) whitened columns of every period.
        bend: (P,) change of the course with the logarithm of its time constant, None where it has none.
        bent: whether a time constant was chosen, against a straight course.
        level: mean of the course.
    """

    effect: Effect
    profile: FloatArray
    columns: FloatArray
    bend: FloatArray | None = None
    bent: bool = False
    level: float = 0.0

    @property
    def name(self) -> Name:
        """Effect and joint."""
        return self.effect.name, self.effect.joint

    @property
    def course(self) -> Course:
        """Its columns with its course, which bends if that was chosen."""
        return Course(self.profile, self.columns, self.bend if self.bent else None)

    def only(self, used: tuple[int, ...]) -> "Direction":
        """The same with some of its columns."""
        return replace(self, columns=self.columns[:, :, list(used)])

    def over(self, periods: slice) -> "Direction":
        """The same in a part of the periods."""
        profile, bent = self.profile[periods], None if self.bend is None else self.bend[periods]
        return replace(
            self,
            profile=profile - profile.mean(),
            level=self.level + float(profile.mean()),
            columns=self.columns[periods],
            bend=None if bent is None else bent - bent.mean(),
        )


def trend_effects(bench: Bench) -> list[Effect]:
    """Every trend of the library at every joint."""
    found: list[Effect] = []
    for _, kind in sorted(effect_classes().items()):
        if issubclass(kind, TrendEffect):
            found.extend(kind.instances(bench.robot))
    return found


def steady_rows(bench: Bench, fit: Fit, effect: TrendEffect, period: int | None = None) -> Contribution:
    """Link and motor rows (N, n, k) of a trend for a change of one; torques of motors are those that were measured.

    In the mean motion, or in that of one of the periods.
    """
    data, state = bench.data, bench.state(fit.effects)
    torque = data.tau_motor if period is None else data.period_tau_motor[period]
    if period is not None:
        signals = moving(signal_effects(fit.effects))
        state = replace(state, motion=corrected_motion(data.robot, signals, data.period_motions[period]))
    state = replace(state, channels={**(state.channels or {}), "tau_motor": torque})
    rows = effect.steady(state)
    if not isinstance(effect, StiffnessDrift):
        return rows
    # what depends on the load takes it from the stiffness of the model, which is not that of every period
    motor, counts = rows.motor.copy(), bench.counts(fit.effects)
    for position, other in enumerate(fit.effects):
        if isinstance(other, LoadEffect) and other.joint == effect.joint and other.stiffness:
            step = LOAD_STEP * other.stiffness
            values = fit.values[sum(counts[:position]) : sum(counts[: position + 1])]
            stiffer = replace(other, stiffness=other.stiffness + step).evaluate(state)
            motor += ((stiffer.motor - other.evaluate(state).motor) @ values / step)[:, :, None]
    return replace(rows, motor=motor)


def flat_periods(bench: Bench, fit: Fit, noise: NoiseFloor) -> FloatArray:
    """(P, M) residuals of periods as they are cut, whitened by the noise of one of them, without their mean."""
    return _flat(bench, bench.period_residuals(fit), noise)


def inside_of_periods(bench: Bench, fit: Fit, noise: NoiseFloor) -> FloatArray:
    """The same, faded out at both ends of every period.

    What came before the first sample of a recording is not known, nor what follows its last one: accelerations there
    are off by what was assumed, in the first and the last period alone.
    """
    residuals, samples = bench.period_residuals(fit), bench.data.samples
    width = min(-(-samples // bench.data.harmonics), samples // 4)
    ramp = np.sin(0.5 * np.pi * (np.arange(width) + 0.5) / width) ** 2
    fade = np.concatenate([ramp, np.ones(samples - 2 * width), ramp[::-1]])[:, None]
    beyond = residuals - residuals.mean(axis=0)
    faded = np.stack([spectrum(waveform(each, samples) * fade, bench.data.harmonics) for each in beyond])
    return _flat(bench, faded, noise)


def _flat(bench: Bench, residuals: ComplexArray, noise: NoiseFloor) -> FloatArray:
    whitener = bench.whitener(noise) / np.sqrt(bench.data.periods)
    flat = np.stack([whiten(whitener, residual) for residual in residuals], axis=1)
    flat = bench.freed(noise).off(flat).T
    return np.asarray(flat - flat.mean(axis=0), dtype=np.float64)


class PeriodColumns:
    """Columns of trends in the periods of a recording.

    Args:
        bench: the recording.
        fit: the model.
        noise: noise floor of periods as they are cut.
    """

    def __init__(self, bench: Bench, fit: Fit, noise: NoiseFloor) -> None:
        self._bench, self._fit = bench, fit
        self._whitener = bench.whitener(noise) / np.sqrt(bench.data.periods)
        self._freed = bench.freed(noise)

    def flat(self, spectra: ComplexArray) -> FloatArray:
        """(M, k) whitened columns of one period from scaled spectra (H + 1, E, k)."""
        return self._freed.off(whiten(self._whitener, spectra))

    def causes(self, temperature: FloatArray | None) -> list[Cause]:
        """Every trend of the library that shows in anything.

        Args:
            temperature: (P, n) mean temperature of every period [degC], None where it was not measured.

        Returns:
            The trends.
        """
        bench, fit = self._bench, self._fit
        found: list[Cause] = []
        for plain in trend_effects(bench):
            effect = bench.anchored((*fit.effects, plain), fit.parameters)[-1]
            if not isinstance(effect, TrendEffect):
                continue
            own = None
            if temperature is not None and effect.joint is not None:
                own = temperature[:, bench.robot.index(effect.joint)]
                own = own if np.all(np.isfinite(own)) else None
            try:
                effect.change(np.zeros(bench.data.periods), own)
                spectra = bench.spectra_of(steady_rows(bench, fit, effect), fit.effects) * fit.scale[:, None]
            except EffectError:
                continue
            columns = self.flat(spectra)
            if np.all(np.linalg.norm(columns, axis=0) > 0.0):
                found.append(Cause(effect, columns, own))
        return found

    def inside(
        self, direction: Direction, found: CourseValues, middle: FloatArray, temperature: FloatArray | None
    ) -> CourseValues:
        """Values of a trend whose course goes on within the periods, from those by a course of their middles.

        What bends changes faster in one half of a period than in the other: where its torque is large in the first
        half, it was seen earlier than in the middle, and where one column is large before another, as friction at a
        slow turn before a fast one, what changes of the one looks like a change of the other. A straight course makes
        every period differ by as much from its middle.

        Args:
            direction: the trend in its course.
            found: values by that course.
            middle: (P,) middles of the periods [s].
            temperature: of its joint in these periods, and perhaps in some before them [degC]; None where it was not
                measured or does not matter.
        """
        effect, bench, fit = direction.effect, self._bench, self._fit
        if not isinstance(effect, TrendEffect):
            raise TypeError(f"{effect.name} is no trend")
        phase = (np.arange(bench.data.samples) + 0.5) / bench.data.samples - 0.5
        time = middle[:, None] + bench.data.period * phase
        own = None
        if temperature is not None:
            own = interp1d(middle, temperature[-len(middle) :], fill_value="extrapolate")(time.ravel())
        change = effect.change(time.ravel(), own).reshape(time.shape)
        course = direction.profile @ change / float(direction.profile @ direction.profile)
        rows = steady_rows(bench, fit, effect)
        weighted = replace(rows, link=rows.link * course[:, None, None], motor=rows.motor * course[:, None, None])
        seen, taken = (self.flat(bench.spectra_of(part, fit.effects) * fit.scale[:, None]) for part in (weighted, rows))
        shown, torque = seen @ found.values, taken @ found.values
        if not float(torque @ shown) > 0.0:
            return found
        # columns times their course, in those that they were taken for
        mixed = np.linalg.lstsq(taken, seen, rcond=SAME_COLUMN)[0]
        values = np.linalg.lstsq(mixed, found.values, rcond=SAME_COLUMN)[0]
        factor = float(torque @ shown) / float(torque @ torque)
        return replace(found, values=values, stds=found.stds / factor)

    def within(self, cause: Cause, space: FloatArray | None = None) -> FloatArray:
        """(P, K, k) columns of a trend in every period, in an orthonormal basis (M, K) or as they are."""
        if not isinstance(cause.effect, TrendEffect):
            raise TypeError(f"{cause.effect.name} is no trend")
        changes = np.moveaxis(self._bench.period_column_changes(cause.effect, self._fit), 0, 2)
        # those of all periods at once, for what is done to one column costs little more for many
        flat = self.flat(changes.reshape(*changes.shape[:2], -1)).reshape(-1, *changes.shape[2:])
        each = np.moveaxis(cause.columns[:, None] + flat, 1, 0)
        return np.asarray(each if space is None else space.T @ each, dtype=np.float64)


def courses(cause: Cause, columns: FloatArray, middle: FloatArray) -> list[Direction]:
    """A trend in every course that is tried.

    Args:
        cause: the trend.
        columns: (P, M, k) its columns in every period.
        middle: (P,) middles of the periods [s].

    Returns:
        The trend with each of its time constants; without those in which nothing changes.
    """
    effects: list[Effect] = [cause.effect]
    if isinstance(cause.effect, TrendEffect):
        constants = time_constants(cause.effect, middle)
        if len(constants) > 1:
            effects = [replace(cause.effect, time_constant=c) for c in constants]  # type: ignore[call-arg]
    found = [with_course(effect, columns, middle, cause.temperature) for effect in effects]
    return [d for d in found if np.linalg.norm(d.profile) > 1e-12]


def with_course(
    effect: Effect, columns: FloatArray, middle: FloatArray, temperature: FloatArray | None = None
) -> Direction:
    """A trend in the course that its time constant gives it.

    Args:
        effect: the trend.
        columns: (P, M, k) whitened columns of every period.
        middle: (P,) middles of the periods [s].
        temperature: (P,) of its joint [degC], None where it was not measured.

    Returns:
        The direction.

    Raises:
        TypeError: the effect is no trend.
    """
    if not isinstance(effect, TrendEffect):
        raise TypeError(f"{effect.name} is no trend")
    change, constants = effect.change(middle, temperature), time_constants(effect, middle)
    level = float(change.mean())
    if len(constants) == 1:
        return Direction(effect, change - level, columns, level=level)
    bent = effect.time_constant < constants[-1]  # type: ignore[attr-defined]
    return Direction(effect, change - level, columns, bend(effect, middle, temperature), bent, level)
