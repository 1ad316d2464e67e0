"""Whether a spring fits badly because the encoders on its two sides have different zeros."""

from collections.abc import Sequence

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects import corrected_motion
from sea_ident.estimation.observations import Observations
from sea_ident.estimation.spring_result import SpringResult, Verdict
from sea_ident.estimation.springs import fit_zero, spring_columns

TAKES = 0.3
"""Residual with zeros of their own, over that without, up to which they are the reason [-]."""


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
    doubted = [s for s in doubted if s.doubt() is not None or s.stiffness < 0.0]
    # what follows from a wrong period or a column that is doubted is no fault of a zero
    if not doubted or observations.processed.doubts:
        return []
    robot, processed = observations.robot, observations.processed
    torque = observations.spring_torque(observations.mean, processed.tau_motor, values)
    motion = corrected_motion(robot, observations.effects, processed.motion)
    found = []
    for spring in doubted:
        joint = robot.index(spring.joint)
        tau = torque[:, robot.elastic_indices.tolist().index(joint)]
        zero = fit_zero(motion, joint, tau)
        columns = spring_columns(motion, joint, zero)
        law = np.linalg.lstsq(columns, tau, rcond=None)[0]
        left = float(np.sqrt(np.mean((tau - columns @ law) ** 2)))
        if not (left < TAKES * spring.rms_residual and law[0] > 0.0):
            continue
        unit, name = robot.joints[joint].position_unit, spring.joint
        found.append(
            f"spring of {name}: zeros of theta_{name} and q_{name} that differ by {zero:.4g} {unit} would explain it: "
            f"beside them its law leaves {left:.3g} instead of {spring.rms_residual:.3g}, and its stiffness is "
            f"{law[0]:.4g}. Unless a constant torque acts there, have the difference fitted (unknown_zero, on the "
            f"command line --unknown-zero {name}), or correct the zero of one encoder"
        )
    return found
