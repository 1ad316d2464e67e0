"""What would take most of what the law of a spring leaves, and how far off the law is without it."""

from collections.abc import Mapping

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects.base import smooth_sign
from sea_ident.effects.encoder_eccentricity import EncoderEccentricity
from sea_ident.effects.encoder_offset import EncoderOffset
from sea_ident.effects.link_friction import LinkFriction
from sea_ident.effects.spring_hysteresis import SpringHysteresis
from sea_ident.effects.spring_offset import SpringOffset
from sea_ident.estimation.spring_result import SpringLack
from sea_ident.estimation.spring_verdict import SLIPS, hysteresis_column
from sea_ident.motion import Motion
from sea_ident.processing.harmonics import within

TAKES = 0.1
"""Share of what is left, in energy, that columns must take to count as what may be missing [-]."""

PLAIN = 2.0
"""What the best leaves, times this, is what fewer columns may leave to be preferred, in energy [-]."""

TURN = 0.03
"""Share of the rms speed within which dry friction turns over, where it is no more than a possibility [-]."""

OWN = 1e-6
"""Part of a column beyond the law, in energy, below which the two are the same [-]."""


def beside_the_law(motion: Motion, joint: int, zero: float, unit: str = "rad") -> dict[str, FloatArray]:
    """(N, k) columns of what a spring may have beside its law, by the name of the effect.

    Args:
        motion: (N, n), as the bodies and the motor move.
        joint: number of the joint.
        zero: difference of the zeros of theta and q [rad] or [m].
        unit: of both; what slides has no eccentric encoder.
    """
    deflection, q, dq = motion.deflection[:, joint] - zero, motion.q[:, joint], motion.dq[:, joint]
    slips = [hysteresis_column(deflection, max(slip * float(np.std(deflection)), 1e-300)) for slip in SLIPS]
    turn = max(TURN * float(np.std(dq)), 1e-300)
    found = {
        SpringOffset.name: np.ones((len(dq), 1)),
        # a cubic law about another zero
        EncoderOffset.name: np.column_stack([np.ones(len(dq)), deflection**2]),
        LinkFriction.name: np.column_stack([dq, smooth_sign(dq, turn)]),
        SpringHysteresis.name: np.column_stack(slips),
    }
    if unit == "rad":
        found[EncoderEccentricity.name] = np.column_stack([np.cos(q), np.sin(q)])
    return found


def spring_lack(
    values: FloatArray,
    mean: FloatArray,
    inverse: FloatArray,
    columns: FloatArray,
    candidates: Mapping[str, FloatArray],
    noise: float,
    harmonics: int = 0,
) -> tuple[SpringLack, FloatArray] | None:
    """Find what takes most of what a law leaves.

    What a law lacks is orthogonal to it only in what is left: a constant torque in a spring that is bent to one side
    is mostly taken for stiffness, and how little of it is left says nothing of how much the law took. What would make
    the stiffness negative explains nothing.

    Args:
        values: (c,) of the law, the stiffness first.
        mean: (N,) mean torque of the spring less its law [N m] or [N].
        inverse: (c, N) by which the mean torque changes the values of the law.
        columns: (N, c) of the law.
        candidates: (N, k) columns of what a spring may have beside its law, by the name of the effect.
        noise: rms of the noise of the mean torque less the law [N m] or [N].
        harmonics: of a period that count; all where 0.

    Returns:
        The lack, and (c,) by how much the values of the law are others beside it; None where none of the candidates
        takes much.
    """
    target = within(mean, harmonics)
    beyond = {}
    for name, candidate in candidates.items():
        own = within(candidate - columns @ (inverse @ candidate), harmonics)
        if np.all(np.sum(own**2, axis=0) > OWN * np.sum(candidate**2, axis=0)):
            beyond[name] = own
    chosen: tuple[str, ...] = ()
    left, shift = target, np.zeros(len(values))
    while len(chosen) < len(beyond) and float(left @ left) > len(left) * noise**2:
        trials = {
            name: _beside(target, inverse, candidates, beyond, (*chosen, name)) for name in beyond.keys() - chosen
        }
        energy = {name: float(trial @ trial) for name, (trial, move) in trials.items() if values[0] + move[0] > 0.0}
        reach = min((1.0 - TAKES) * float(left @ left), PLAIN * min(energy.values(), default=0.0))
        good = [name for name in beyond if energy.get(name, np.inf) <= reach]
        if not good:
            break
        best = min(good, key=lambda name: beyond[name].shape[1])
        chosen, (left, shift) = (*chosen, best), trials[best]
    if not chosen:
        return None
    return SpringLack(chosen, float(np.sqrt(np.mean(left**2))), float(values[0] + shift[0])), shift


def _beside(
    target: FloatArray,
    inverse: FloatArray,
    candidates: Mapping[str, FloatArray],
    beyond: Mapping[str, FloatArray],
    names: tuple[str, ...],
) -> tuple[FloatArray, FloatArray]:
    """What a law leaves (N,) beside some candidates, and by how much its values (c,) are others."""
    table = np.hstack([beyond[name] for name in names])
    amounts = np.linalg.lstsq(table, target, rcond=None)[0]
    shift = -inverse @ (np.hstack([candidates[name] for name in names]) @ amounts)
    return np.asarray(target - table @ amounts, dtype=np.float64), np.asarray(shift, dtype=np.float64)
