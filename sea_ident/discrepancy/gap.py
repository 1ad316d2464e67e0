"""How far model and data are apart beyond the noise."""

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.bench import Bench
from sea_ident.discrepancy.check import torque_units
from sea_ident.discrepancy.findings import Gap
from sea_ident.discrepancy.fit import Fit
from sea_ident.discrepancy.noise import ComplexArray, NoiseFloor


def noise_of_residual(fit: Fit, noise: NoiseFloor) -> FloatArray:
    """(E,) rms of the noise of the mean residual of a fit [N m].

    A floor is that of the residual as it is whitened, where a link has the stiffness of the first fit. With its own it
    may have a small part of that.
    """
    return np.asarray(noise.std / fit.scale, dtype=np.float64)


def excess_power(bench: Bench, fit: Fit, noise: NoiseFloor) -> FloatArray:
    """(E,) mean square of the mean residual beyond that of its noise, at least zero [(N m)^2]."""
    return _beyond(fit, bench.clean_residual(fit), noise_of_residual(fit, noise))


def excess_power_of_sums(bench: Bench, fit: Fit, noise: NoiseFloor) -> FloatArray:
    """(E,) the same of the sum of all equations of the joint that each belongs to [(N m)^2].

    The noise of a deflection is in both with opposite signs, and hides in each of them what their sum shows.
    """
    joints = np.array([equation.joint for equation in bench.data.equations])
    together = (joints[:, None] == joints).astype(np.float64)
    parts = together / fit.scale
    covariance = np.einsum("je,kef,jf->kj", parts, noise.covariance, parts, optimize=True).real
    # every harmonic but the constant has two components
    size = np.sqrt(covariance[0] + 2.0 * np.sum(covariance[1:], axis=0))
    return _beyond(fit, bench.clean_residual(fit) @ together, np.asarray(size, dtype=np.float64))


def _beyond(fit: Fit, residual: ComplexArray, noise: FloatArray) -> FloatArray:
    """(E,) power of residuals (H + 1, E) beyond that of noise of this rms (E,), at least zero [(N m)^2]."""
    power = np.sum(np.abs(residual) ** 2, axis=0)
    freedom = fit.dof / max(len(fit.whitened), 1)
    return np.asarray(np.maximum(power - freedom * noise**2, 0.0), dtype=np.float64)


def per_joint(bench: Bench, power: FloatArray) -> dict[str, float]:
    """Root of the powers (E,) of all equations of each joint, summed [N m]."""
    out = dict.fromkeys(bench.robot.joint_names, 0.0)
    for equation, value in zip(bench.data.equations, power, strict=True):
        out[equation.joint] += float(value)
    return {joint: float(np.sqrt(value)) for joint, value in out.items()}


def gap_of(bench: Bench, before: Fit, after: Fit, noise: NoiseFloor) -> Gap:
    """Gap of two fits on one recording, with the noise floor of the second."""
    return Gap(
        per_joint(bench, excess_power(bench, before, noise)),
        per_joint(bench, excess_power(bench, after, noise)),
        per_joint(bench, noise_of_residual(after, noise) ** 2),
        torque_units(bench.robot),
    )


def torque_by_joint(bench: Bench) -> dict[str, float]:
    """Largest rms torque of the equations of each joint [N m] or [N]."""
    found: dict[str, float] = {}
    for equation, rms in zip(bench.data.equations, bench.torque_rms, strict=True):
        found[equation.joint] = max(found.get(equation.joint, 0.0), float(rms))
    return found
