"""Every trend of the library as columns times a course over the periods."""

from dataclasses import dataclass, replace

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.bench import Bench
from sea_ident.discrepancy.fit import Fit
from sea_ident.discrepancy.linear import off, whiten
from sea_ident.discrepancy.noise import ComplexArray
from sea_ident.discrepancy.trend_values import bend, time_constants
from sea_ident.effects import Contribution, Effect, effect_classes
from sea_ident.effects.drift import TrendEffect
from sea_ident.exceptions import EffectError

Name = tuple[str, str | None]


@dataclass(frozen=True, eq=False)
class Direction:
    """A trend with one course.

    Attributes:
        effect: the effect, with the time constant of the course.
        profile: (P,) course, without mean.
        columns: (M, k) whitened columns.
        bend: (P,) change of the course with the logarithm of its time constant, None where it has none.
        bent: whether a time constant was chosen, against a straight course.
    """

    effect: Effect
    profile: FloatArray
    columns: FloatArray
    bend: FloatArray | None = None
    bent: bool = False

    @property
    def name(self) -> Name:
        """Effect and joint."""
        return self.effect.name, self.effect.joint

    def only(self, used: tuple[int, ...]) -> "Direction":
        """The same with some of its columns."""
        return replace(self, columns=self.columns[:, list(used)])

    def over(self, periods: slice) -> "Direction":
        """The same in a part of the periods."""
        profile, bent = self.profile[periods], None if self.bend is None else self.bend[periods]
        return replace(self, profile=profile - profile.mean(), bend=None if bent is None else bent - bent.mean())


def trend_effects(bench: Bench) -> list[Effect]:
    """Every trend of the library at every joint."""
    found: list[Effect] = []
    for _, kind in sorted(effect_classes().items()):
        if issubclass(kind, TrendEffect):
            found.extend(kind.instances(bench.robot))
    return found


def steady_rows(bench: Bench, fit: Fit, effect: TrendEffect) -> Contribution:
    """Link and motor rows (N, n, k) of a trend for a change of one; torques of motors are those that were measured."""
    state = bench.state(fit.effects)
    channels = {**(state.channels or {}), "tau_motor": bench.data.tau_motor}
    return effect.steady(replace(state, channels=channels))


def trend_directions(
    bench: Bench,
    fit: Fit,
    whitener: ComplexArray,
    free: FloatArray,
    middle: FloatArray,
    temperature: FloatArray | None,
) -> list[Direction]:
    """Every trend in every course that is tried.

    Args:
        bench: the recording.
        fit: the model.
        whitener: (H + 1, E, E) of one period.
        free: (M, m) orthonormal basis of the samples that are left out, whitened.
        middle: (P,) middles of the periods [s].
        temperature: (P, n) mean temperature of every period [degC], None where it was not measured.

    Returns:
        The trends; those that show in nothing are left out.
    """
    found: list[Direction] = []
    for plain in trend_effects(bench):
        effect = bench.anchored((*fit.effects, plain), fit.parameters)[-1]
        if not isinstance(effect, TrendEffect):
            continue
        own = None
        if temperature is not None and effect.joint is not None:
            own = temperature[:, bench.robot.index(effect.joint)]
            own = own if np.all(np.isfinite(own)) else None
        try:
            spectra = bench.spectra_of(steady_rows(bench, fit, effect), fit.effects) * fit.scale[:, None]
            columns = off(free, whiten(whitener, spectra))
            variants = [replace(effect, time_constant=c) for c in time_constants(effect, middle)]  # type: ignore[call-arg]
            courses = [with_course(variant, columns, middle, own) for variant in variants]
        except EffectError:
            continue
        if np.all(np.linalg.norm(columns, axis=0) > 0.0):
            found.extend(d for d in courses if np.linalg.norm(d.profile) > 1e-12)
    return found


def with_course(
    effect: Effect, columns: FloatArray, middle: FloatArray, temperature: FloatArray | None = None
) -> Direction:
    """A trend in the course that its time constant gives it.

    Args:
        effect: the trend.
        columns: (M, k) whitened columns.
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
    if len(constants) == 1:
        return Direction(effect, change - change.mean(), columns)
    bent = effect.time_constant < constants[-1]  # type: ignore[attr-defined]
    return Direction(effect, change - change.mean(), columns, bend(effect, middle, temperature), bent)
