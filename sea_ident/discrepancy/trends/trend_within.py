"""What trends do to the mean of the periods."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.interpolate import interp1d

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.fit import Fit
from sea_ident.discrepancy.bench.free_shapes import moving, signal_effects
from sea_ident.discrepancy.bench.linear import span
from sea_ident.discrepancy.bench.periods import BODIES, add_torque, torques_of
from sea_ident.discrepancy.measured.closing import SIGNALS, closing_weights
from sea_ident.discrepancy.measured.data import PeriodData
from sea_ident.discrepancy.trends.trend import Trend
from sea_ident.discrepancy.trends.trend_directions import steady_rows
from sea_ident.effects import Contribution, corrected_motion
from sea_ident.effects.drift import TrendEffect
from sea_ident.motion import Motion

BEND = 2
"""Degree of the polynomial of a course by which the motion goes with it: a motor that turns later because of friction
does not do so in proportion."""


def within_periods(
    bench: Bench, fit: Fit, trends: Sequence[Trend], temperature: FloatArray | None = None
) -> FloatArray:
    """Torque of trends in the mean period, beyond what their mean does to the mean motion.

    What drifts from period to period drifts within a period too: its end comes later than its beginning, every time. A
    mean that closes has little of that left, for towards its end it leads over into the periods before. And where the
    motion drifts with the torque, the mean of their product is not the product of their means: friction that grows
    turns a motor later and later, and its mean beside a reversal looks like friction that builds up over a distance, or
    like a torque that is late. So does the mean of the friction that does not drift, on a motion that does.

    Args:
        bench: the recording.
        fit: the model.
        trends: of its periods.
        temperature: (P, n) mean temperature of every period [degC], None where it was not measured.

    Returns:
        (N, E) torque [N m].
    """
    data = bench.data
    middle = data.starts + 0.5 * data.period
    weights = closing_weights(data.places or range(data.periods), data.samples)
    total, courses = np.zeros((data.samples, len(data.equations))), []
    for trend in trends:
        if not isinstance(trend.effect, TrendEffect):
            continue
        change = changes(data, trend.effect, temperature)
        course = mean_course(data, trend.effect, temperature)
        values = trend.effect.referred(trend.values, -float(np.mean(change)))
        for p in range(data.periods):
            beyond = weights[:, p] * (change[p] - course.mean())
            total += beyond[:, None] * (data.rows(steady_rows(bench, fit, trend.effect, p)) @ values)
        courses.append(trend.effect.change(middle, of_joint(data, trend.effect, temperature)))
    return total + _on_a_motion_that_drifts(bench, fit, courses, weights)


def changes(data: PeriodData, effect: TrendEffect, temperature: FloatArray | None) -> FloatArray:
    """(P, N) change of a trend at every sample of every period.

    Args:
        data: the recording.
        effect: the trend.
        temperature: (P, n) mean temperature of every period [degC], None where it was not measured.
    """
    phase = (np.arange(data.samples) + 0.5) / data.samples
    time = (data.starts[:, None] + phase * data.period).ravel()
    own = of_joint(data, effect, temperature)
    if own is not None:
        own = interp1d(data.starts + 0.5 * data.period, own, fill_value="extrapolate")(time)
    return effect.change(time, own).reshape(data.periods, data.samples)


def mean_course(data: PeriodData, effect: TrendEffect, temperature: FloatArray | None) -> FloatArray:
    """(N,) change of a trend in the mean period, which closes: towards its end it leads over into those before."""
    weights = closing_weights(data.places or range(data.periods), data.samples)
    return np.asarray(np.einsum("tp,pt->t", weights, changes(data, effect, temperature)), dtype=np.float64)


def of_joint(data: PeriodData, effect: TrendEffect, temperature: FloatArray | None) -> FloatArray | None:
    """(P,) temperature of the joint of a trend [degC], None where it was not measured or does not matter."""
    if temperature is None or effect.joint is None:
        return None
    return temperature[:, data.robot.index(effect.joint)]


def _on_a_motion_that_drifts(bench: Bench, fit: Fit, courses: Sequence[FloatArray], weights: FloatArray) -> FloatArray:
    """(N, E) mean of the torque of a model over the periods beyond that on their mean, as far as the motion drifts.

    Bodies are left out: in so small a motion their torque is straight.

    Args:
        bench: the recording.
        fit: the model.
        courses: (P,) of the trends.
        weights: (N, P) of the periods in their mean.
    """
    data, state = bench.data, bench.state(fit.effects)
    acting = torques_of([e for e in fit.effects if e.name not in BODIES], fit.parameters, bench.robot)
    signals = moving(signal_effects(fit.effects))

    def torque(motion: Motion) -> FloatArray:
        total = Contribution(np.zeros_like(motion.q), np.zeros_like(motion.q))
        moved = replace(state, motion=corrected_motion(bench.robot, signals, motion))
        for effect, values in acting:
            add_torque(effect, values, moved, total.link, total.motor)
        return data.rows(total)

    mean, total = torque(data.motion), np.zeros((data.samples, len(data.equations)))
    for p, motion in enumerate(_drifted(data, courses, weights)):
        total += weights[:, p, None] * (torque(motion) - mean)
    return total


def _drifted(data: PeriodData, courses: Sequence[FloatArray], weights: FloatArray) -> list[Motion]:
    """The mean as far from itself in every period as goes with what drifts: what goes by chance is in no model."""
    terms = [course**degree for course in courses for degree in range(1, BEND + 1)]
    basis = span(np.stack([np.ones(data.periods), *terms], axis=1))
    parts = []
    for name in SIGNALS:
        smooth = np.einsum("pk,rk,rtn->ptn", basis, basis, np.stack([getattr(m, name) for m in data.period_motions]))
        parts.append(getattr(data.motion, name) + smooth - np.einsum("tp,ptn->tn", weights, smooth))
    return [Motion(data.motion.time, *each) for each in zip(*parts, strict=True)]
