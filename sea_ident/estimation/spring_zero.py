"""Whether a spring fits badly because the encoders on its two sides have different zeros."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects import corrected_motion
from sea_ident.estimation.observations import Observations
from sea_ident.estimation.spring_result import SpringResult, Verdict
from sea_ident.estimation.springs import fit_zero, spring_columns
from sea_ident.motion import Motion

TAKES = 0.3
"""Residual with zeros of their own, over that without, up to which they are the reason [-]."""

BENT = 5.0
"""Times the largest torque of its motor that a spring of the described stiffness would carry in the mean, from which on
nothing but different zeros bends it so [-]."""

EXPLAINS = 0.3
"""Share of the change of the torque of a spring that its law may leave then [-]."""


@dataclass(frozen=True)
class OtherZero:
    """A spring whose misfit goes with a difference of the zeros of theta and q.

    Attributes:
        joint: its joint.
        zero: the difference [rad] or [m].
        text: what to tell a user.
    """

    joint: str
    zero: float
    text: str


def other_zeros(observations: Observations, values: FloatArray, springs: Sequence[SpringResult]) -> list[str]:
    """Sentences about springs whose misfit goes with a difference of the zeros of theta and q.

    Args:
        observations: the recording.
        values: (b,) base parameters.
        springs: what was identified.

    Returns:
        One for each such spring; none where the difference was fitted already.
    """
    doubted = [s for s in springs if s.zero == 0.0 and s.verdict is not Verdict.CIRCULAR and not s.terms]
    doubted = [
        s
        for s in doubted
        if s.doubt() is not None or s.stiffness < 0.0 or _beyond_its_motor(observations, s.joint) is not None
    ]
    return [zero.text for zero in _zeros_of(observations, values, [s.joint for s in doubted])]


def zeros_apart(observations: Observations, known: Collection[str]) -> tuple[OtherZero, ...]:
    """Springs of a recording whose misfit goes with a difference of the zeros of theta and q, whatever model there is.

    Args:
        observations: the recording.
        known: joints of which the difference is known.
    """
    robot = observations.robot
    names = [name for name in (robot.joint_names[i] for i in robot.elastic_indices) if name not in known]
    if not names:
        return ()
    rows = observations.rows
    values = np.linalg.lstsq(rows.reshape(-1, rows.shape[2]), observations.torque.ravel(), rcond=None)[0]
    return tuple(_zeros_of(observations, values.astype(np.float64), names))


def _zeros_of(observations: Observations, values: FloatArray, joints: Sequence[str]) -> list[OtherZero]:
    """The springs of some joints whose misfit goes with a difference of zeros, by base parameters (b,)."""
    # what follows from a wrong period or a column that is doubted is no fault of a zero
    if not joints or observations.processed.doubts:
        return []
    robot, processed = observations.robot, observations.processed
    torque = observations.spring_torque(observations.mean, processed.tau_motor, values)
    motion = corrected_motion(robot, observations.effects, processed.motion)
    found = []
    for name in joints:
        joint = robot.index(name)
        tau = torque[:, robot.elastic_indices.tolist().index(joint)]
        zero = fit_zero(motion, joint, tau)
        (law, left), (without, whole) = (_law(motion, joint, tau, at) for at in (zero, 0.0))
        # a spring that is none may fit as well
        most = TAKES if without[0] > 0.0 else 1.0
        if not (left < min(most * whole, EXPLAINS * float(np.std(tau))) and law[0] > 0.0):
            bent = _beyond_its_motor(observations, name)
            if bent is not None:
                found.append(bent if abs(zero - bent.zero) > 0.5 * abs(bent.zero) else replace(bent, zero=zero))
            continue
        unit = robot.joints[joint].position_unit
        text = (
            f"spring of {name}: zeros of theta_{name} and q_{name} that differ by {zero:.4g} {unit} would explain it: "
            f"beside them its law leaves {left:.3g} instead of {whole:.3g}, and its stiffness is {law[0]:.4g}. Unless "
            "a constant torque acts there, have the difference fitted (unknown_zero, on the command line "
            f"--unknown-zero {name}), or correct the zero of one encoder"
        )
        found.append(OtherZero(name, zero, text))
    return found


def _beyond_its_motor(observations: Observations, name: str) -> OtherZero | None:
    """A spring of described stiffness that would carry more in the mean than its motor ever gives, None if it is not.

    Another zero of a link encoder moves all that lies behind it, and a model without leaves nothing by which the law of
    the spring could be told.
    """
    robot, processed = observations.robot, observations.processed
    joint, stiffness = robot.index(name), robot.spring(name).stiffness
    if stiffness is None:
        return None
    apart, most = float(np.mean(processed.motion.deflection[:, joint])), np.abs(processed.tau_motor[:, joint]).max()
    if stiffness * abs(apart) <= BENT * most:
        return None
    unit, torque = robot.joints[joint].position_unit, robot.joints[joint].torque_unit
    text = (
        f"spring of {name}: theta_{name} and q_{name} are {apart:.4g} {unit} apart in the mean, for which a spring of "
        f"{stiffness:.4g} {torque}/{unit}, as it is described, takes {stiffness * abs(apart):.4g} {torque}, and the "
        f"motor gives {most:.3g} at most: their zeros differ. Have the difference fitted (unknown_zero, on the command "
        f"line --unknown-zero {name}), or correct the zero of one encoder"
    )
    return OtherZero(name, apart, text)


def _law(motion: Motion, joint: int, tau: FloatArray, zero: float) -> tuple[FloatArray, float]:
    """(3,) law of a spring about a zero, and the rms of what it leaves of a torque (N,)."""
    columns = spring_columns(motion, joint, zero)
    law = np.linalg.lstsq(columns, tau, rcond=None)[0].astype(np.float64)
    return law, float(np.sqrt(np.mean((tau - columns @ law) ** 2)))
