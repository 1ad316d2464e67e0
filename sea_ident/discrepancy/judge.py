"""What speaks for an effect in a fit, and what against it."""

from collections.abc import Sequence
from typing import TypeGuard

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from sea_ident._typing import FloatArray, IntArray
from sea_ident.discrepancy.bench import Bench
from sea_ident.discrepancy.fit import Fit
from sea_ident.discrepancy.free_shapes import free_shapes, is_signal
from sea_ident.discrepancy.linear import whiten
from sea_ident.discrepancy.noise import NoiseFloor, closed_freedom
from sea_ident.discrepancy.settle import Settled
from sea_ident.effects import Effect
from sea_ident.effects.asymmetric_spring import AsymmetricSpring
from sea_ident.effects.backlash import Backlash
from sea_ident.effects.coulomb_friction import CoulombFriction
from sea_ident.effects.external_force import ExternalForce
from sea_ident.effects.nonlinear_viscous_friction import NonlinearViscousFriction
from sea_ident.effects.presliding_friction import PreslidingFriction
from sea_ident.effects.spring_hysteresis import SpringHysteresis
from sea_ident.effects.spring_stiffening import CUBIC, SpringStiffening
from sea_ident.effects.stribeck_friction import StribeckFriction
from sea_ident.effects.viscous_friction import ViscousFriction

LARGEST_TIMES_TORQUE = 1.5
"""No effect is larger than this many times the torque of the motor (rms)."""

EQUALLY_GOOD = 13.8
"""Two effects between whose statistics there is less than this (odds of a thousand) are not told apart."""

COMPLETE = 0.9
"""Share of the excess from which on an effect explains nearly all of it."""

BEHIND_LAWS = 0.5
"""Share of what a push explains from which on what acts by a law comes before it, unless the push explains nearly all:
a push fits whatever is left at certain times of a period."""

SLIPPING = 0.1
"""Share of the torque of dry friction in a spring that must be in elements that slip to and fro [-]."""

FEWEST_TO_SEARCH = 4
"""Periods below which it cannot be told how they scatter along what an effect does: then none is looked for.

Of three periods with nothing missing a fifth got a name."""

OF_THE_SCATTER = 0.3
"""Standard deviations of the position of a motor from pass to pass below which no friction is known to build up [-]."""

ALL_THE_TIME = 0.75
"""Share of a period from which on a push is none: what pauses now and then acts all the time [-]."""

SMALL_BESIDE = 0.05
"""Share of the stiffness of a spring that may be in an element of dry friction that sticks all the time [-]."""

SPRING_LAW = ("spring_stiffness", "spring_stiffening")
"""Parameters of the law of a spring with two equal sides."""

ALIKE = (("stribeck_friction", "nonlinear_viscous_friction"), ("torque_ripple",))
"""Frictions that are a function of nothing but the speed of their motor, and waves over its position, ..."""

OWN_AMOUNT = 7.0
"""... and standard deviations that each must have of its own where there are two of one motor."""

DRIVES = 0.1
"""Share of the largest torque of a friction by which dry friction beside it may be below zero, as noise may do [-]."""

BUILDS_UP = (0.2, 2.0)
"""Friction that builds up over a distance, in units of the dry friction beside it, at least and at most [-]. Static
friction is larger than that in which a motor slides, but what is many times as large over a shorter way is a jump of
another form; and where nearly all friction turns at once, it is not the contact that is late."""

EXCUSED = 0.02
"""Share of the power of an effect that may be in a column of the wrong sign."""

WRONG_PART = 0.2
"""Share of what an effect explains that columns of the wrong sign may be worth, as long as others are missing [-]."""


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

    So is dry friction that turns over as slowly as any may, and friction that grows with as low a power as there is.
    """
    for shape in effect.shapes:
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
        i = bench.robot.index(effect.required_joint)
        passes = np.stack([motion.theta[:, i] for motion in bench.data.period_motions])
        differ = float(np.median(np.std(np.diff(passes, axis=0), axis=0))) / np.sqrt(2.0) if len(passes) > 2 else 0.0
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


def penalty(effect: Effect, bench: Bench) -> float:
    """Price of the parameters of an effect in units of the statistic, so that the simpler of two equals wins.

    A wave that is as long as any costs the odds of a thousand more: what is a constant is to be called one.
    """
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
    return any(s.name == "order" and float(getattr(effect, s.name)) <= 1.02 * s.lower for s in effect.shapes)


def never_closed(bench: Bench, effects: Sequence[Effect], position: int) -> bool:
    """Whether a motion keeps a play open to one side: its torque is a constant then, whatever its width and ends."""
    play = effects[position]
    if not isinstance(play, Backlash):
        return False
    deflection = bench.state(effects).motion.deflection[:, bench.robot.index(play.required_joint)]
    one_side = bool(np.all(deflection > 0.0) or np.all(deflection < 0.0))
    return one_side and float(np.min(np.abs(deflection))) > (1.0 + play.softness) * play.half_width


def dissipates(bench: Bench, effect: Effect, values: FloatArray) -> bool:
    """Whether a spring with dry friction is one on this motion: what never slips to and fro is elastic, and an offset.

    Args:
        bench: the recording.
        effect: any effect.
        values: (k,) of its columns.
    """
    if not isinstance(effect, SpringHysteresis):
        return True
    slipping = slips_here(bench, effect)
    return float(np.sum(np.abs(values[slipping]))) > SLIPPING * float(np.sum(np.abs(values)))


def slips_here(bench: Bench, effect: SpringHysteresis) -> NDArray[np.bool_]:
    """(2,) which elements of a spring with dry friction slip to and fro on this motion."""
    travel = float(np.ptp(bench.data.motion.deflection[:, bench.robot.index(effect.required_joint)]))
    return np.asarray(2.0 * effect.slips < travel)


def only_elastic(bench: Bench, fit: Fit, position: int) -> NDArray[np.bool_]:
    """(k,) columns that are a part of the elastic law of their spring on this motion: they take from it, or give to it.

    An element that sticks all the time has no sign of its own, for the rest of the law is not that of a mere spring
    either; but it must stay small beside it.
    """
    effect = fit.effects[position]
    values = np.array([fit.parameters[c.name] for c in effect.columns(bench.robot)])
    if not isinstance(effect, SpringHysteresis):
        return np.zeros(len(values), dtype=np.bool_)
    stiffness = fit.parameters.get(f"{effect.joint}.spring_stiffness", 0.0)
    small = np.abs(values) / effect.slips < SMALL_BESIDE * stiffness
    return np.asarray(small & ~slips_here(bench, effect))


def pushes_back(bench: Bench, fit: Fit, position: int) -> bool:
    """Whether a spring of another law is stiff, and not the opposite, as far as this motion deflects it.

    To either side: a spring that is always loaded one way is a spring all the same, and not by the other side alone.
    """
    effect = fit.effects[position]
    if not is_of_a_law(effect):
        return True
    deflection = bench.state(fit.effects).motion.deflection[:, bench.robot.index(effect.required_joint)]
    deflection = np.concatenate([deflection, -deflection])
    linear, cubic = (fit.parameters.get(f"{effect.joint}.{name}", 0.0) for name in SPRING_LAW)
    (column,) = effect.columns(bench.robot)
    slope = linear + 3.0 * cubic * deflection**2 + fit.parameters[column.name] * effect.slope(deflection)
    return bool(np.min(slope) > 0.0)


def is_of_a_law(effect: Effect) -> TypeGuard[AsymmetricSpring | SpringStiffening]:
    """Whether an effect is a term more in the law of a spring, beside the linear and the cubic one."""
    return isinstance(effect, AsymmetricSpring) or (isinstance(effect, SpringStiffening) and effect.exponent != CUBIC)


def is_term(effect: Effect) -> bool:
    """Whether an effect is a term more in a law that the model has: of a spring, or of viscous friction."""
    return is_of_a_law(effect) or isinstance(effect, NonlinearViscousFriction)


def brakes(bench: Bench, fit: Fit, position: int) -> bool:
    """Whether the friction of a motor still brakes beside friction of another law, at any speed of this motion.

    The law may bend like the sum of a larger one and a dry friction that drives. Viscous friction that a power beside
    it cancels in part is no such thing: friction that grows ever slower is that sum, whatever the two come to.
    """
    effect = fit.effects[position]
    if not isinstance(effect, StribeckFriction | NonlinearViscousFriction):
        return True
    motion, i = bench.state(fit.effects).motion, bench.robot.index(effect.required_joint)
    state = motion.q[:, i], motion.dq[:, i], motion.theta[:, i], motion.dtheta[:, i]
    own = effect.local_columns(*state)[:, 0] * fit.parameters[effect.parameter_name()]
    if isinstance(effect, NonlinearViscousFriction):
        usual = (e for e in fit.effects if isinstance(e, CoulombFriction | ViscousFriction) and e.joint == effect.joint)
        for other in usual:
            own += other.local_columns(*state)[:, 0] * fit.parameters[other.parameter_name()]
        braking = own * np.sign(motion.dtheta[:, i])
        return bool(np.min(braking) > -DRIVES * np.max(braking))
    dry = fit.parameters.get(f"{effect.joint}.coulomb_friction", 0.0)
    return bool(-dry < DRIVES * float(np.max(np.abs(own))))


def builds_up(fit: Fit, position: int) -> bool:
    """Whether friction that builds up over a distance is about the dry friction in the place of which it stands.

    Asked of a fit with both: without the one, the other is any.
    """
    effect = fit.effects[position]
    dry = fit.parameters.get(f"{effect.joint}.coulomb_friction")
    if not isinstance(effect, PreslidingFriction) or dry is None:
        return True
    least, most = BUILDS_UP
    return bool(least * dry <= fit.parameters[effect.parameter_name()] <= most * dry)


def bends_another(bench: Bench, fit: Fit, position: int) -> bool:
    """Whether an effect only bends the form of another one like it: its own amount is not known.

    Two friction laws over the same speed together take the form of any curve, and two waves of nearly the same length
    that of one that grows and fades. Where what is there has neither form, they do so by large amounts that nearly
    cancel, and none is an effect of its own.
    """
    position %= len(fit.effects)
    effect = fit.effects[position]
    family = next((names for names in ALIKE if effect.name in names), ())
    if sum(e.name in family and e.joint == effect.joint for e in fit.effects) < 2:
        return False
    own = _own(bench, fit, position)
    factor, values = fit.covariance_factor[own], fit.values[own]
    return bool(values @ np.linalg.lstsq(factor @ factor.T, values, rcond=None)[0] < OWN_AMOUNT**2)


def physical(bench: Bench, fit: Fit, position: int) -> bool:
    """Whether an effect of a model is possible.

    A column that must not be negative is not, but for what its uncertainty or a small share of the effect excuses; and
    the effect is not larger than all the torque there is, which only two effects that cancel each other could be.
    """
    return _but_for_signs(bench, fit, position) and not len(_wrong_signs(bench, fit, position))


def possible(bench: Bench, fit: Fit, noise: NoiseFloor, position: int) -> bool:
    """Whether an effect is physical, or would be beside others that the model lacks yet.

    These bend a part of it that is small to the wrong sign. With that part held at zero it explains nearly as much.
    """
    if not _but_for_signs(bench, fit, position):
        return False
    wrong = _wrong_signs(bench, fit, position)
    if not len(wrong):
        return True
    factor = fit.covariance_factor[wrong]
    cost = float(fit.values[wrong] @ np.linalg.lstsq(factor @ factor.T, fit.values[wrong], rcond=None)[0])
    others = [e for k, e in enumerate(fit.effects) if k != position % len(fit.effects)]
    less = bench.fit(others, noise, start=fit.parameters, tangents=False)
    return cost < WRONG_PART * (less.statistic - fit.statistic)


def _but_for_signs(bench: Bench, fit: Fit, position: int) -> bool:
    """Whether an effect is possible, whatever the signs of its columns."""
    position %= len(fit.effects)
    effect = fit.effects[position]
    columns, values = effect.columns(bench.robot), fit.values[_own(bench, fit, position)]
    if not columns:
        return True
    if not effect.plausible(values, fit.parameters) or not dissipates(bench, effect, values):
        return False
    if isinstance(effect, NonlinearViscousFriction) and at_a_bound(effect):
        return False  # where it ends beside what came after it, too
    if not pushes_back(bench, fit, position) or not brakes(bench, fit, position) or not builds_up(fit, position):
        return False
    if is_term(effect):
        return True  # terms of one law cancel in part, and what they come to is asked above
    total = np.sqrt(np.sum(np.abs(bench.column_spectra(effect, fit.effects) @ values) ** 2, axis=0))
    return not np.any(total > LARGEST_TIMES_TORQUE * bench.torque_rms)


def _wrong_signs(bench: Bench, fit: Fit, position: int) -> IntArray:
    """(w,) columns of a fit that belong to an effect, must not be negative and are, beyond what is excused."""
    position %= len(fit.effects)
    effect, own = fit.effects[position], _own(bench, fit, position)
    signed = [column.nonnegative for column in effect.columns(bench.robot)]
    if not any(signed) or not np.any(fit.values[own] < 0.0):
        return np.zeros(0, dtype=np.intp)
    values, stds = fit.values[own], np.array([fit.std(k) for k in own])
    power = np.sum(np.abs(bench.column_spectra(effect, fit.effects) * values) ** 2, axis=(0, 1))
    wrong = np.array(signed) & (values < -2.0 * stds) & (power > EXCUSED * float(power.sum()))
    return np.asarray(own[wrong & ~only_elastic(bench, fit, position)], dtype=np.intp)


def _own(bench: Bench, fit: Fit, position: int) -> IntArray:
    """Columns of an effect in a fit."""
    counts = bench.counts(fit.effects)
    start = sum(counts[:position])
    return np.arange(start, start + counts[position])
