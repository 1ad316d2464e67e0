"""Where a motor stands: of the samples near a reversal, those whose speed is no more than noise."""

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sea_ident.discrepancy.measured.data import MOST_LEFT_OUT, EquationKind, PeriodData
from sea_ident.effects import Side
from sea_ident.estimation.observations import NEARLY_ALWAYS
from sea_ident.reversals import UNCERTAIN_SIGN

BESIDE_REVERSALS = 0
"""Caution of periods of which only that is left out around a reversal in which a motor stands."""

LIVE_BESIDE_REVERSALS = ("stribeck_friction", "presliding_friction")
"""Effects that may act beside reversals only."""


@dataclass(frozen=True)
class Standing:
    """What is not compared beside the reversals of a joint.

    Attributes:
        joint: the joint.
        share: of the samples of a period [-].
        speed: up to which samples are not compared [rad/s] or [m/s].
    """

    joint: str
    share: float
    speed: float


def longest_standing(data: PeriodData) -> Standing:
    """The joint of which most is not compared."""
    motors = [e for e, equation in enumerate(data.equations) if equation.kind is not EquationKind.LINK]
    worst = max(motors, key=lambda e: float(np.mean(data.left_out[:, e])))
    equation, rows = data.equations[worst], data.left_out[:, worst]
    speed = np.abs(data.motion.dtheta[rows, equation.index])
    return Standing(equation.joint, float(np.mean(rows)), float(np.max(speed, initial=0.0)))


def held_still(data: PeriodData) -> tuple[str, ...]:
    """Joints whose motors stand nearly always, as where friction holds them: nothing is told of what acts there."""
    motors = (e for e, equation in enumerate(data.equations) if equation.kind is not EquationKind.LINK)
    return tuple(data.equations[e].joint for e in motors if np.mean(data.left_out[:, e]) > NEARLY_ALWAYS)


def not_compared_at(data: PeriodData, joints: Collection[str]) -> PeriodData:
    """The same periods with nothing compared at some joints."""
    if not joints:
        return data
    left_out = data.left_out.copy()
    left_out[:, [equation.joint in joints for equation in data.equations]] = True
    return replace(data, left_out=left_out)


def no_slower_than(data: PeriodData, other: PeriodData) -> PeriodData:
    """The same periods without samples in which a motor is slower than in all that are compared of another recording.

    At which speed friction turns over, the other does not tell then, and a model of it may have it wrong by any factor:
    what that leaves where a motor lingers at such a speed says nothing of what was found.

    Args:
        data: the periods.
        other: the recording that the model is from.

    Returns:
        The periods; equations of motors that hardly ever go faster keep what they leave out.
    """
    left_out = data.left_out.copy()
    for e, equation in enumerate(data.equations):
        if equation.kind is not EquationKind.LINK:
            slow = np.abs(data.motion.dtheta[:, equation.index]) < other.slowest[equation.joint, Side.MOTOR]
            if np.mean(slow | left_out[:, e]) <= MOST_LEFT_OUT:
                left_out[:, e] |= slow
    return replace(data, left_out=left_out)


def compared_beside_reversals(data: PeriodData) -> PeriodData:
    """The same periods with less left out: what is slow beside a reversal is compared, what stands is not.

    The usual leaves out what is slower than its own scatter from period to period. Where friction lets go at another
    instant in every pass that is much more than the noise of a speed, and all that a motor does between standing and
    sliding. A friction that acts only there shows in the mean nevertheless: its scatter is known, and the mean of many
    passes small beside it.

    Args:
        data: the periods.

    Returns:
        The periods; link equations, where friction of the motor is not, keep what they leave out.
    """
    left_out = data.left_out.copy()
    for e, equation in enumerate(data.equations):
        if equation.kind is not EquationKind.LINK:
            left_out[:, e] &= _stands(data, equation.index)
    return replace(data, left_out=left_out, caution=BESIDE_REVERSALS)


def _stands(data: PeriodData, joint: int) -> NDArray[np.bool_]:
    """(N,) samples whose mean speed is not known to its sign by the noise of the encoder, or beside a change of it."""
    speed = data.motion.dtheta[:, joint]
    turned = np.sign(speed) != np.sign(np.roll(speed, 1))
    noisy = np.abs(speed) < known_speed(data, joint)
    return np.asarray(noisy | turned | np.roll(turned, -1))


def known_speed(data: PeriodData, joint: int) -> float:
    """Speed of a motor above which its sign is known by the noise of the encoder [rad/s] or [m/s]."""
    scatter = np.std([period.dtheta[:, joint] for period in data.period_motions], axis=0, ddof=1)
    return UNCERTAIN_SIGN * float(np.median(scatter))
