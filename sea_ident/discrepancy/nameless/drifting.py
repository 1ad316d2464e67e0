"""What was found in the mean may be what drifts: then the library's own drift beside it is a part of that.

A torque constant that drifts, where no effect of the library does that, is found twice: in the mean as a torque
constant that is another one than taken, and over the periods as friction that drifts, which is the nearest that does.
So every trend is held against the drift of each effect that was found at its joint. An encoder whose zero wanders bends
the torque of other joints too: what was found in the chain of signals is held against the trends of all joints.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.fit import Fit
from sea_ident.discrepancy.bench.free_shapes import is_signal
from sea_ident.discrepancy.bench.settle import Settled
from sea_ident.discrepancy.measured.noise import ComplexArray
from sea_ident.discrepancy.nameless.unnamed import Unnamed
from sea_ident.discrepancy.trends.trend import UNEXPLAINED, Trend, TrendTest, trend_excess
from sea_ident.discrepancy.trends.trend_directions import Cause, Direction, PeriodColumns, courses, flat_periods
from sea_ident.discrepancy.trends.trend_scatter import column_space, gain, held_basis, scatter_whitener
from sea_ident.discrepancy.trends.trend_search import EQUALLY_GOOD
from sea_ident.effects import Column, Contribution, Effect, Side, State
from sea_ident.effects.drift import DriftEffect
from sea_ident.effects.external_force import ExternalForce
from sea_ident.effects.load import MotorLoadEffect
from sea_ident.effects.signal import SignalEffect
from sea_ident.robot import Robot

FORM = 0.02
"""Share of what a trend explains that another drift must explain beyond it: how columns change with what drifts is left
out here, and of a large trend that is more than noise [-]."""


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
    """A trend in the place of which the drift of what was found in the mean explains the periods much better.

    Attributes:
        drifts_at: joint of what drifts, None where it is that of the trend.
    """

    drifts_at: str | None = None

    @property
    def sentence(self) -> str:
        """What it explains."""
        where = self.drifts_at or self.joint
        what = f"That the {self.relative} at {where} drifts explains what changes from period to period"
        return f"{what}." if self.effect == self.relative else f"{what} better than {self.effect} does."


def drifting(
    bench: Bench, now: Settled, trends: TrendTest, temperature: FloatArray | None = None
) -> tuple[UnnamedDrift, ...]:
    """Trends in the place of which the drift of an effect that was found at their joint explains much more.

    Where what changes has no name, the drift of an effect that was found must explain most of it.

    Args:
        bench: the recording.
        now: the model with what was found, the last of its effects, and its noise floor.
        trends: of its periods.
        temperature: (P, n) mean temperature of every period [degC], None where it was not measured.

    Returns:
        One entry for every such trend.
    """
    fit, found = now.fit, []
    mean = [e for e in fit.effects[len(bench.effects) :] if is_signal(e) or e.columns(bench.robot)]
    sized = [e for e in mean if e.joint is not None and not isinstance(e, ExternalForce)]
    for k, trend in enumerate(trends.trends):
        others = [t for i, t in enumerate(trends.trends) if i != k]
        own = [e for e in sized if is_signal(e) or e.joint == trend.effect.joint]
        if not own:
            continue
        first, *gains = _Drifts(bench, now, temperature, own).gains(trend, others)
        best = int(np.argmax(gains))
        if gains[best] - first > max(EQUALLY_GOOD, FORM * first):
            named, drifts_at = trend.effect, own[best].joint
            found.append(UnnamedDrift(named.name, named.joint, own[best].name, 0.0, fit.solution, drifts_at=drifts_at))
    if trends.unnamed and not trends.trends and sized:
        drifts = _Drifts(bench, now, temperature, sized)
        _, *gains = drifts.gains()
        best = int(np.argmax(gains))
        if gains[best] > max(UNEXPLAINED * drifts.excess, EQUALLY_GOOD):
            found.append(UnnamedDrift(sized[best].name, sized[best].joint, sized[best].name, 0.0, fit.solution))
    return tuple(found)


class _Drifts:
    """Drifts of effects and the trends of the library, all in one scatter of the periods.

    Args:
        bench: the recording.
        now: the model and its noise floor.
        temperature: (P, n) mean temperature of every period [degC], None where it was not measured.
        effects: what may drift.

    Attributes:
        excess: what the linear trend in everything is beyond the scatter of the periods.
    """

    def __init__(self, bench: Bench, now: Settled, temperature: FloatArray | None, effects: Sequence[Effect]) -> None:
        fit = now.fit
        noise = bench.noise_of_cut(fit)
        flat = flat_periods(bench, fit, noise)
        self._middle: FloatArray = bench.data.starts + 0.5 * bench.data.period
        self.excess = trend_excess(flat, self._middle)
        columns = PeriodColumns(bench, fit, noise)
        known = columns.causes(temperature)
        self._known = {cause.name: cause for cause in known}
        self._drifts = []
        for effect in effects:
            drift = Drifting(effect.joint, effect=effect)
            if isinstance(effect, SignalEffect):
                spectra = _along_amounts(bench, fit, effect)
            else:
                spectra = bench.spectra_of(drift.steady(bench.state(fit.effects)), fit.effects) * fit.scale[:, None]
            self._drifts.append(Cause(drift, columns.flat(spectra), None))
        self._space = column_space([*known, *self._drifts])
        numbers = flat @ self._space
        self._scatter = scatter_whitener(numbers, self._middle)
        self._numbers = numbers @ self._scatter

    def gains(self, trend: Trend | None = None, others: Sequence[Trend] = ()) -> list[float]:
        """Drop of the statistic by a trend (0 without one), and by each drift in its place, beside other trends."""
        beside = [self._known[t.effect.name, t.effect.joint] for t in others]
        held = held_basis([self._best(cause)[1] for cause in beside])
        first = 0.0 if trend is None else self._best(self._known[trend.effect.name, trend.effect.joint], held)[0]
        return [first, *(self._best(cause, held)[0] for cause in self._drifts)]

    def _best(self, cause: Cause, held: FloatArray | None = None) -> tuple[float, Direction]:
        columns = self._scatter @ (self._space.T @ cause.columns)
        every = courses(cause, np.broadcast_to(columns, (len(self._numbers), *columns.shape)), self._middle)
        return max(((gain(self._numbers, d, held)[0], d) for d in every), key=lambda item: item[0])


def _along_amounts(bench: Bench, fit: Fit, signal: SignalEffect) -> ComplexArray:
    """(H + 1, E, k) scaled change of the torque with the amounts of an effect in the chain of signals."""
    shown = [bench.signal_tangent(signal, amount, fit.effects, fit.parameters) for amount in signal.amounts]
    torque, slopes = (np.stack(part, axis=-1) for part in zip(*shown, strict=True))
    return bench.scaled(torque, slopes, fit.residual, fit.scale, bench.stiffness_of(fit))
