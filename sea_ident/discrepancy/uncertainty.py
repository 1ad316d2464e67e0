"""Standard deviations of what a diagnosis tells of an effect."""

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.bench import Bench
from sea_ident.discrepancy.judge import flat_steps
from sea_ident.discrepancy.settle import Settled

FEWEST_STEPS = 5
"""Steps between periods from which on their own scatter says something."""


def uncertainties(bench: Bench, now: Settled) -> FloatArray:
    """(p + s,) standard deviations of the parameters of a model, and of its shapes in the order of `free_shapes`.

    By the noise floor, which is one for all phases of a period, or by how the periods themselves scatter along a
    parameter, where that is more: friction that differs from pass to pass gathers at reversals, and there is friction
    found. What the model leaves beyond noise makes both larger in proportion (Birge, The calculation of errors by the
    method of least squares, Physical Review 40, 1932).

    Args:
        bench: the recording.
        now: the model.
    """
    fit, steps = now.fit, flat_steps(bench, now)
    stds = np.linalg.norm(fit.covariance_factor, axis=1)
    if len(steps) >= FEWEST_STEPS:
        scatter = np.sqrt(np.mean((steps @ fit.basis @ fit.step_factor.T) ** 2, axis=0))
        noise = np.linalg.norm(fit.step_factor, axis=1)
        stds *= np.maximum(np.divide(scatter, noise, out=np.ones_like(noise), where=noise > 0.0), 1.0)
    return np.asarray(np.sqrt(fit.unit) * stds, dtype=np.float64)
