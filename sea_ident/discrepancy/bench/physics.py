"""What physics allows: whether an effect of a fit can be, whatever it explains."""

from typing import TypeGuard

import numpy as np
from numpy.typing import NDArray

from sea_ident._typing import FloatArray, IntArray
from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.fit import Fit
from sea_ident.discrepancy.bench.judge import at_a_bound, own_torque
from sea_ident.discrepancy.measured.noise import NoiseFloor
from sea_ident.effects import Effect
from sea_ident.effects.asymmetric_spring import AsymmetricSpring
from sea_ident.effects.coulomb_friction import CoulombFriction
from sea_ident.effects.encoder_offset import EncoderOffset
from sea_ident.effects.motor_encoder_offset import MotorEncoderOffset
from sea_ident.effects.nonlinear_viscous_friction import NonlinearViscousFriction
from sea_ident.effects.presliding_friction import PreslidingFriction
from sea_ident.effects.spring_hysteresis import SpringHysteresis
from sea_ident.effects.spring_stiffening import CUBIC, SpringStiffening
from sea_ident.effects.stribeck_friction import StribeckFriction
from sea_ident.effects.viscous_friction import ViscousFriction
from sea_ident.robot import SeriesElasticActuator

LARGEST_OF_A_SENSOR = 20.0
"""Times the torque that an error of a sensor may change it by: more it does only through a spring that hardly moves,
whose stiffness comes out as anything [-]."""

ABOUT = 2.0
"""Times as stiff as it is described, or as soft, that a spring may be to be that one [-]."""

LARGEST_TIMES_TORQUE = 1.5
"""No effect is larger than this many times the torque of the motor, or what the described bodies need (rms)."""

SLIPPING = 0.1
"""Share of the torque of dry friction in a spring that must be in elements that slip to and fro [-]."""

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
    """(k,) which elements of a spring with dry friction slip to and fro on this motion."""
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
    return fit.lost_by(own, fit.values[own]) < OWN_AMOUNT**2


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
    cost = fit.lost_by(wrong, fit.values[wrong])
    others = [e for k, e in enumerate(fit.effects) if k != position % len(fit.effects)]
    less = bench.fit(others, noise, start=fit.parameters, tangents=False)
    return cost < WRONG_PART * (less.statistic - fit.statistic)


def _but_for_signs(bench: Bench, fit: Fit, position: int) -> bool:
    """Whether an effect is possible, whatever the signs of its columns."""
    position %= len(fit.effects)
    effect = fit.effects[position]
    columns, values = effect.columns(bench.robot), fit.values[_own(bench, fit, position)]
    if isinstance(effect, EncoderOffset) and _as_stiff_as_described(bench, fit, effect):
        return True
    if isinstance(effect, MotorEncoderOffset):
        # one that counts from where it was switched on is off by anything; what is left is a spring, or it is not
        return fit.parameters.get(f"{effect.joint}.{SPRING_LAW[0]}", 0.0) > 0.0
    if not columns:
        return own_torque(bench, fit, position) < LARGEST_OF_A_SENSOR
    if not effect.plausible(values, fit.parameters) or not dissipates(bench, effect, values):
        return False
    if isinstance(effect, NonlinearViscousFriction) and at_a_bound(effect):
        return False  # where it ends beside what came after it, too
    if not pushes_back(bench, fit, position) or not brakes(bench, fit, position) or not builds_up(fit, position):
        return False
    if is_term(effect):
        return True  # terms of one law cancel in part, and what they come to is asked above
    total = np.sqrt(np.sum(np.abs(bench.column_spectra(effect, fit.effects) @ values) ** 2, axis=0))
    return not np.any(total > LARGEST_TIMES_TORQUE * np.maximum(bench.torque_rms, bench.described_rms))


def _as_stiff_as_described(bench: Bench, fit: Fit, effect: EncoderOffset) -> bool:
    """Whether the spring of its joint is about the one that is described: then its zero may be off by anything."""
    actuator = bench.robot.joints[effect.required_index(bench.robot)].actuator
    if not isinstance(actuator, SeriesElasticActuator) or actuator.stiffness is None:
        return False
    share = fit.parameters.get(f"{effect.joint}.{SPRING_LAW[0]}", 0.0) / actuator.stiffness
    return 1.0 / ABOUT < share < ABOUT


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
