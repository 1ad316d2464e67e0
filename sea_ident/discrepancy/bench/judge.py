"""What speaks for an effect in a fit, and what against it."""

from collections.abc import Sequence
from typing import TypeGuard

import numpy as np
from scipy import stats

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.fit import Fit
from sea_ident.discrepancy.bench.free_shapes import free_shapes, is_signal
from sea_ident.discrepancy.bench.linear import whiten
from sea_ident.discrepancy.bench.settle import Settled
from sea_ident.discrepancy.measured.data import scatter_of_passes
from sea_ident.discrepancy.measured.noise import NoiseFloor, closed_freedom
from sea_ident.effects import Effect, Shape
from sea_ident.effects.asymmetric_spring import AsymmetricSpring
from sea_ident.effects.backlash import Backlash
from sea_ident.effects.external_force import ExternalForce
from sea_ident.effects.link_friction import LinkFriction
from sea_ident.effects.nonlinear_viscous_friction import NonlinearViscousFriction
from sea_ident.effects.presliding_friction import PreslidingFriction
from sea_ident.effects.signal import SignalEffect
from sea_ident.robot import Robot

EQUALLY_GOOD = 13.8
"""Two effects between whose statistics there is less than this (odds of a thousand) are not told apart."""

SMALLEST_SHARE = 1e-3
"""An effect must change the torque of one of its equations by this share of the rms, or it does not matter."""

COMPLETE = 0.9
"""Share of the excess from which on an effect explains nearly all of it."""

BEHIND_LAWS = 0.5
"""Share of what a push explains from which on what acts by a law comes before it, unless the push explains nearly all:
a push fits whatever is left at certain times of a period."""

FEWEST_TO_SEARCH = 4
"""Periods below which it cannot be told how they scatter along what an effect does: then none is looked for.

Of three periods with nothing missing a fifth got a name."""

OF_THE_SCATTER = 0.3
"""Standard deviations of the position of a motor from pass to pass below which no friction is known to build up [-]."""

ALL_THE_TIME = 0.75
"""Share of a period from which on a push is none: what pauses now and then acts all the time [-]."""


def significance(gain: float, columns: int, tests: int, fit: Fit, noise: NoiseFloor) -> float:
    """Probability of such a drop of the statistic by chance, for the best of `tests` candidates.

    The noise floor is itself an estimate, so the drop follows an F rather than a chi-square distribution. Where the
    model leaves an excess, the drop is measured in units of it.
    """
    scale = max(fit.statistic - gain, 1.0) / max(fit.dof - columns, 1)
    ratio = gain / columns / max(scale, 1.0)
    single = float(stats.f.sf(ratio, columns, max(noise.total_freedom, 4.0)))
    return min(1.0, tests * single)


def own_torque(bench: Bench, fit: Fit, position: int) -> float:
    """Largest rms of the torque of an effect in an equation, as a share of the rms torque of the motor there [-]."""
    position %= len(fit.effects)
    effect = fit.effects[position]
    if is_signal(effect):
        others = [e for k, e in enumerate(fit.effects) if k != position]
        with_it, without = (bench.predicted(model, fit.parameters).residual for model in (fit.effects, others))
        torque = without - with_it
    else:
        own = np.array([fit.parameters[c.name] for c in effect.columns(bench.robot)])
        torque = bench.column_spectra(effect, fit.effects) @ own
    rms = np.sqrt(np.sum(np.abs(torque) ** 2, axis=0))
    return float(np.max(rms / np.maximum(bench.torque_rms, 1e-300)))


def flat_steps(bench: Bench, now: Settled) -> FloatArray:
    """(S, M) whitened steps between periods over the root of two, in units of the noise of the mean of all."""
    whitener = bench.whitener(now.noise) / np.sqrt(bench.data.averaged)
    flat = np.stack([whiten(whitener, step) for step in bench.period_steps(now.fit)], axis=1)
    return np.ascontiguousarray(bench.freed(now.noise).off(flat).T)


def scatter_p(steps: FloatArray, change: FloatArray) -> float:
    """Probability of a change of the mean by the scatter of the periods along that very change.

    Noise that gathers where the change is large (friction that differs from pass to pass) is larger there than the
    noise floor, which is one for all phases of a period, says.

    Args:
        steps: (S, M) whitened steps between periods, in units of the noise of the mean.
        change: (M,) change of the whitened mean residual.

    Returns:
        Probability by Student's t; 0 where there are too few periods to tell.
    """
    if len(steps) < FEWEST_TO_SEARCH - 1:
        return 0.0
    size = float(np.linalg.norm(change))
    return 2.0 * float(stats.t.sf(size / max(spread(steps, change), 1e-300), closed_freedom(len(steps))))


def spread(steps: FloatArray, change: FloatArray) -> float:
    """Standard deviation along a change (M,) by steps between periods (S, M), in the unit of the steps."""
    return float(np.sqrt(np.mean((steps @ change) ** 2)) / np.linalg.norm(change))


def at_a_bound(effect: Effect) -> bool:
    """Whether a width, a speed or a distance of an effect ended at the end of its range: then it is something else.

    So is dry friction that turns over as slowly as any may, friction that grows with as low a power as there is, and an
    error of a sensor that is as large as any may be.
    """
    if isinstance(effect, SignalEffect):
        return any(_at_an_end(float(getattr(effect, amount.name)), amount) for amount in effect.ranges)
    for shape in effect.ranges:
        value = float(getattr(effect, shape.name))
        least, most = value < 1.02 * shape.lower, value > 0.98 * shape.upper
        if shape.name == "smoothing":
            least = False  # as sharp as any is dry friction as it should be
        elif isinstance(effect, NonlinearViscousFriction):
            most = False  # friction that hardly grows with the speed is dry friction of another form
        elif not shape.logarithmic or shape.name in ("softness", "order", "time_constant"):
            continue
        if least or most:
            return True
    return False


def _at_an_end(amount: float, within: Shape) -> bool:
    """Whether an amount is as large as its range allows."""
    return amount > 0.98 * within.upper or (within.lower < 0.0 and amount < 0.98 * within.lower)


def is_push(effect: Effect) -> TypeGuard[ExternalForce]:
    """Whether an effect acts at certain times, and by no law."""
    return isinstance(effect, ExternalForce)


def comes_first(gain: float, by_law: float, fit: Fit) -> bool:
    """Whether a push may be named before what acts by a law.

    Args:
        gain: drop of the statistic with the push.
        by_law: drop with the other effect instead.
        fit: the model without either.
    """
    return gain > COMPLETE * fit.excess or BEHIND_LAWS * gain > by_law


def too_short(bench: Bench, effect: Effect) -> bool:
    """Whether an effect is over sooner than what is compared can show, or a push lasts nearly all the time.

    Then it only stands in for something sudden, or for what acts all the time. Friction that builds up over less than
    the passes of a motor differ by is another one in each, and its mean is none of this law.
    """
    if isinstance(effect, PreslidingFriction):
        passes = np.stack([motion.theta for motion in bench.data.period_motions])
        differ = scatter_of_passes(passes)[bench.robot.index(effect.required_joint)] if len(passes) > 2 else 0.0
        return bool(effect.displacement < OF_THE_SCATTER * differ)
    if not is_push(effect):
        return False
    return _length(bench, effect) < 0.5 / bench.data.harmonics or nearly_always(bench, effect)


def nearly_always(bench: Bench, effect: Effect) -> bool:
    """Whether a push lasts nearly all the time."""
    return is_push(effect) and _length(bench, effect) > ALL_THE_TIME


def _length(bench: Bench, push: ExternalForce) -> float:
    """Share of the period in which it pushes [-]."""
    return float(np.mod((push.stop - push.start) / bench.data.period, 1.0))


def torque_changes(bench: Bench, before: Fit, after: Fit) -> FloatArray:
    """(E,) change of the residual of every equation, as a share of the rms torque that it is about [-]."""
    change = np.sqrt(np.sum(np.abs(after.residual - before.residual) ** 2, axis=0))
    return np.asarray(change / np.maximum(bench.torque_rms, 1e-300), dtype=np.float64)


def torque_change(bench: Bench, before: Fit, after: Fit) -> float:
    """The largest of `torque_changes`."""
    return float(np.max(torque_changes(bench, before, after)))


def is_given(effect: Effect, robot: Robot) -> bool:
    """Whether the description of a robot gives an effect that no model has by itself."""
    return isinstance(effect, LinkFriction) and effect.is_described(robot)


def penalty(effect: Effect, bench: Bench) -> float:
    """Price of the parameters of an effect in units of the statistic, so that the simpler of two equals wins.

    A wave that is as long as any costs the odds of a thousand more: what is a constant is to be called one. What the
    description gives costs nothing: it was there before the recording was.
    """
    if is_given(effect, bench.robot):
        return 0.0
    # when a push begins and ends is found too, though not by refinement, and so is the centre of mass among all points,
    # and where a kink is; its sides are straight then
    found = len(effect.shapes) if is_push(effect) else 0
    found += isinstance(effect, AsymmetricSpring) and effect.kink != 0.0
    shapes = found + len(free_shapes((effect,)))
    count = len(effect.columns(bench.robot)) + shapes
    price = count * float(np.log(2.0 * len(bench.data.equations) * bench.data.harmonics))
    return price + (EQUALLY_GOOD if slowest(effect) else 0.0)


def slowest(effect: Effect) -> bool:
    """Whether a wave along a path ended as the longest that there is: then it only stands in for a constant."""
    return any(s.name == "order" and float(getattr(effect, s.name)) <= 1.02 * s.lower for s in effect.ranges)


def never_closed(bench: Bench, effects: Sequence[Effect], position: int) -> bool:
    """Whether a motion keeps a play open to one side: its torque is a constant then, whatever its width and ends."""
    play = effects[position]
    if not isinstance(play, Backlash):
        return False
    deflection = bench.state(effects).motion.deflection[:, bench.robot.index(play.required_joint)]
    one_side = bool(np.all(deflection > 0.0) or np.all(deflection < 0.0))
    return one_side and float(np.min(np.abs(deflection))) > (1.0 + play.softness) * play.half_width
