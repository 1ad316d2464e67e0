"""Derivatives of the columns of effects that act at a single joint."""

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects import JointEffect
from sea_ident.effects.coulomb_friction import CoulombFriction
from sea_ident.effects.link_friction import LinkFriction
from sea_ident.effects.spring_damping import SpringDamping
from sea_ident.effects.spring_stiffness import SpringStiffness
from sea_ident.effects.viscous_friction import ViscousFriction

_STEP = 1e-5


def local_slopes(
    effect: JointEffect, q: FloatArray, dq: FloatArray, theta: FloatArray, dtheta: FloatArray
) -> tuple[FloatArray | None, FloatArray | None, FloatArray | None, FloatArray | None]:
    """Derivatives of the columns of an effect by the state of its joint.

    Known effects are differentiated by hand, others by a difference of fourth order.

    Args:
        effect: the effect.
        q: (N,) link positions.
        dq: (N,) link velocities.
        theta: (N,) motor positions.
        dtheta: (N,) motor velocities.

    Returns:
        (N, k) derivatives by q, q', theta and theta'; None where there is none.
    """
    one = np.ones((len(q), 1))
    if isinstance(effect, ViscousFriction):
        return None, None, None, one
    if isinstance(effect, CoulombFriction):
        return None, None, None, _sign_slope(dtheta, effect.smoothing)
    if isinstance(effect, LinkFriction):
        return None, np.concatenate([one, _sign_slope(dq, effect.smoothing)], axis=1), None, None
    if isinstance(effect, SpringStiffness):
        return -one, None, one, None
    if isinstance(effect, SpringDamping):
        return None, -one, None, one
    state = (q, dq, theta, dtheta)
    first, second, third, fourth = (_difference(effect, state, k) for k in range(4))
    return first, second, third, fourth


def _sign_slope(velocity: FloatArray, smoothing: float) -> FloatArray:
    slope: FloatArray = ((1.0 - np.tanh(velocity / smoothing) ** 2) / smoothing)[:, None]
    return slope


def _difference(effect: JointEffect, state: tuple[FloatArray, ...], which: int) -> FloatArray:
    def moved(steps: int) -> FloatArray:
        there = [value + steps * _STEP if k == which else value for k, value in enumerate(state)]
        return effect.local_columns(*there)

    return (8.0 * (moved(1) - moved(-1)) - (moved(2) - moved(-2))) / (12.0 * _STEP)
