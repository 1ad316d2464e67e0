"""Torque channels that were computed from the deflection, and so prove nothing."""

from collections.abc import Sequence

import numpy as np

from sea_ident._typing import FloatArray

CIRCULAR = 1e-3
"""What may be left of a torque channel, as a share of it, after subtracting a multiple of the deflection."""


def circular_factor(deflections: Sequence[FloatArray], torques: Sequence[FloatArray]) -> float | None:
    """The factor between a torque channel and the deflection, where that channel was computed from it.

    Args:
        deflections: (N,) deflections of one joint: as measured, as fitted [rad].
        torques: (N,) torque channels of that joint [N m].

    Returns:
        The factor [N m/rad], None where no torque channel is an exact multiple of a deflection.
    """
    for deflection in deflections:
        if np.ptp(deflection) == 0.0:
            continue
        basis = np.column_stack([deflection - deflection.mean(), np.ones_like(deflection)])
        for torque in torques:
            if np.ptp(torque) == 0.0:
                continue
            solution, *_ = np.linalg.lstsq(basis, torque, rcond=None)
            left = torque - basis @ solution
            if left.std() < CIRCULAR * torque.std():
                return float(solution[0])
    return None


def circular_note(factor: float) -> str:
    """Why a fit would prove nothing."""
    return f"the torque channel is {factor:.6g} x the deflection: a fit returns that factor, whatever the spring is"
