"""What may be beside an effect at its joint and would not show, and how well the effect is known then.

Another zero of an encoder is nearly the same as a constant torque in its spring. Where one of them is named, its amount
is known to a fraction of a percent if the other is not there, and hardly at all if it may be.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.judge import penalty
from sea_ident.discrepancy.bench.lacking import candidate_effects
from sea_ident.discrepancy.bench.settle import Settled
from sea_ident.effects import Effect
from sea_ident.effects.motor_encoder_offset import MotorEncoderOffset
from sea_ident.effects.signal import SignalEffect
from sea_ident.effects.spring_offset import SpringOffset
from sea_ident.exceptions import EffectError

TAKEN_UP = 1e-4
"""Share of the size of a column that a model must leave to say anything of it [-]: less is rounding."""


@dataclass(frozen=True, eq=False)
class Beside:
    """A model to which another effect was added, to first order.

    Attributes:
        effect: the other effect.
        stds: (p + s,) standard deviations of parameters and shapes beside it, as it may be anything.
        shift: (p + s,) by how much they are others where it is as large as fits best.
        better: whether it is worth its parameters: by the information criterion, though that names nothing.
    """

    effect: Effect
    stds: FloatArray
    shift: FloatArray
    better: bool


def beside_others(bench: Bench, now: Settled, joint: str) -> Iterator[Beside]:
    """A model beside every effect without shapes that it may have at a joint.

    Args:
        bench: the recording.
        now: the model.
        joint: the joint.
    """
    fit = now.fit
    constant = any(isinstance(effect, SpringOffset) and effect.joint == joint for effect in fit.effects)
    for effect in candidate_effects(bench, fit.effects):
        if effect.joint != joint or effect.shapes:
            continue
        if constant and isinstance(effect, MotorEncoderOffset):
            continue  # the constant stands for it
        try:
            directions = _directions(bench, now, bench.anchored((*fit.effects, effect), fit.parameters)[-1])
        except EffectError:
            continue
        sizes = np.linalg.norm(directions, axis=0)
        shown = directions[:, sizes > 0.0] / sizes[sizes > 0.0]
        left = fit.off(shown)
        if not left.size or np.any(np.sum(left**2, axis=0) < TAKEN_UP**2):
            continue
        moves = -fit.step_factor @ (fit.basis.T @ shown)
        inverse = np.linalg.pinv(left.T @ left, hermitian=True)
        amounts = inverse @ (left.T @ fit.whitened)
        gain = float(amounts @ (left.T @ fit.whitened)) / fit.unit
        variance = np.einsum("pk,kl,pl->p", moves, inverse, moves) * fit.unit
        yield Beside(effect, np.sqrt(variance), moves @ amounts, gain > penalty(effect, bench))


def _directions(bench: Bench, now: Settled, effect: Effect) -> FloatArray:
    """(M, k) whitened columns of an effect, or tangents of its amounts."""
    fit = now.fit
    if isinstance(effect, SignalEffect):
        shown = [bench.signal_tangent(effect, amount, fit.effects, fit.parameters) for amount in effect.ranges]
        torque = np.stack([part for part, _ in shown], axis=-1)
        slopes = np.stack([slope for _, slope in shown], axis=-1)
    else:
        torque = bench.column_spectra(effect, fit.effects)
        slopes = np.zeros(torque.shape[1:])  # what has a slope is a term of the law, and that is in the model
    scaled = bench.scaled(torque, slopes, fit.residual, fit.scale, bench.stiffness_of(fit))
    return bench.whitening(now.noise).flat(scaled)
