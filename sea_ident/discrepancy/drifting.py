"""What was found in the mean may be what drifts: then the library's own drift beside it is a part of that.

A torque constant that drifts, where no effect of the library does that, is found twice: in the mean as a torque
constant that is another one than taken, and over the periods as friction that drifts, which is the nearest that does.
So every trend is held against the drift of each effect that was found at its joint.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.bench import Bench
from sea_ident.discrepancy.fit import Fit
from sea_ident.discrepancy.free_shapes import is_signal
from sea_ident.discrepancy.judge import flat_periods
from sea_ident.discrepancy.linear import off, whiten
from sea_ident.discrepancy.relatives import Unnamed
from sea_ident.discrepancy.settle import Settled
from sea_ident.discrepancy.trend import EQUALLY_GOOD, Trend
from sea_ident.discrepancy.trend_directions import Cause, Direction, PeriodColumns, courses
from sea_ident.discrepancy.trend_scatter import column_space, gain, held_basis, scatter_whitener
from sea_ident.effects import Column, Contribution, Effect, Side, State
from sea_ident.effects.drift import DriftEffect
from sea_ident.effects.external_force import ExternalForce
from sea_ident.effects.load import MotorLoadEffect
from sea_ident.robot import Robot


@dataclass(frozen=True)
class Drifting(DriftEffect):
    """An effect whose size drifts, whatever it is.

    Attributes:
        effect: what drifts.
    """

    effect: Effect | None = None

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """Those of the effect."""
        return () if self.effect is None else self.effect.columns(robot)

    def local_columns(self, q: FloatArray, dq: FloatArray, theta: FloatArray, dtheta: FloatArray) -> FloatArray:
        """None: it has the rows of its effect."""
        return np.zeros((len(q), 0))

    def steady(self, state: State) -> Contribution:
        """The effect as it is; what follows the load follows all that the motor gives, with inertia and friction.

        In the mean these take up their part of it, from period to period they stay as they are.
        """
        effect = self.effect
        if isinstance(effect, MotorLoadEffect):
            i = state.robot.index(effect.at)
            return state.at(
                Side.MOTOR, effect.at, effect.column_of(effect.motor_torque(state), state.motion.dtheta[:, i])
            )
        return super().steady(state) if effect is None else effect.evaluate(state)


@dataclass(frozen=True)
class UnnamedDrift(Unnamed):
    """A trend in the place of which the drift of what was found in the mean explains the periods much better."""

    @property
    def sentence(self) -> str:
        """What it explains."""
        return (
            f"That the {self.relative} at {self.joint} drifts explains what changes from period to period better than "
            f"{self.effect} does."
        )


def drifting(
    bench: Bench, now: Settled, trends: Sequence[Trend], temperature: FloatArray | None = None
) -> tuple[UnnamedDrift, ...]:
    """Trends in the place of which the drift of an effect that was found at their joint explains much more.

    Args:
        bench: the recording.
        now: the model with what was found, the last of its effects, and its noise floor.
        trends: of its periods.
        temperature: (P, n) mean temperature of every period [degC], None where it was not measured.

    Returns:
        One entry for every such trend.
    """
    fit, found = now.fit, []
    for k, trend in enumerate(trends):
        others = [t for i, t in enumerate(trends) if i != k]
        own = _at_the_joint(bench, fit, trend)
        if not own:
            continue
        gains = _gains(bench, now, trend, others, own, temperature)
        best = int(np.argmax(gains[1:]))
        if gains[1 + best] - gains[0] > EQUALLY_GOOD:
            found.append(UnnamedDrift(trend.effect.name, trend.effect.joint, own[best].name, 0.0, fit))
    return tuple(found)


def _at_the_joint(bench: Bench, fit: Fit, trend: Trend) -> list[Effect]:
    """Effects that were found at the joint of a trend and have a size that could drift."""
    found = fit.effects[len(bench.effects) :]
    here = [e for e in found if e.joint == trend.effect.joint and not is_signal(e) and not isinstance(e, ExternalForce)]
    return [e for e in here if e.columns(bench.robot)]


def _gains(
    bench: Bench,
    now: Settled,
    trend: Trend,
    others: Sequence[Trend],
    effects: Sequence[Effect],
    temperature: FloatArray | None,
) -> list[float]:
    """Drop of the statistic by a trend and by the drift of each effect in its place, all in one scatter."""
    periods, fit = bench.data.periods, now.fit
    flat = flat_periods(bench, now) / np.sqrt(periods)
    flat -= flat.mean(axis=0)
    middle: FloatArray = bench.data.starts + 0.5 * bench.data.period
    whitener, free = bench.whitener(now.noise) / np.sqrt(periods), bench.free_basis(now.noise)
    known = PeriodColumns(bench, fit, whitener, free).causes(temperature)
    relatives = []
    for effect in effects:
        drift = Drifting(effect.joint, effect=effect)
        spectra = bench.spectra_of(drift.steady(bench.state(fit.effects)), fit.effects) * fit.scale[:, None]
        relatives.append(Cause(drift, off(free, whiten(whitener, spectra)), None))
    space = column_space([*known, *relatives])
    numbers = flat @ space
    scatter = scatter_whitener(numbers, middle)
    numbers = numbers @ scatter

    def directions(cause: Cause) -> list[Direction]:
        columns = scatter @ (space.T @ cause.columns)
        return courses(cause, np.broadcast_to(columns, (periods, *columns.shape)), middle)

    def best(cause: Cause, held: FloatArray | None = None) -> tuple[float, Direction]:
        return max(((gain(numbers, d, held)[0], d) for d in directions(cause)), key=lambda item: item[0])

    causes = {cause.name: cause for cause in known}
    beside = [causes[t.effect.name, t.effect.joint] for t in others]
    held = held_basis([best(cause)[1] for cause in beside])
    mine = causes[trend.effect.name, trend.effect.joint]
    return [best(cause, held)[0] for cause in (mine, *relatives)]
