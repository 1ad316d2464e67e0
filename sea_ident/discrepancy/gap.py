"""How far model and data are apart beyond the noise."""

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.bench import Bench
from sea_ident.discrepancy.check import torque_units
from sea_ident.discrepancy.findings import Gap
from sea_ident.discrepancy.fit import Fit
from sea_ident.discrepancy.noise import NoiseFloor


def excess_power(bench: Bench, fit: Fit, noise: NoiseFloor) -> FloatArray:
    """(E,) mean square of the mean residual beyond that of its noise, at least zero [(N m)^2]."""
    clean = bench.clean_residual(fit)
    power = np.sum(np.abs(clean) ** 2, axis=0)
    freedom = fit.dof / max(len(fit.whitened), 1)
    return np.asarray(np.maximum(power - freedom * noise.std**2, 0.0), dtype=np.float64)


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
        per_joint(bench, noise.std**2),
        torque_units(bench.robot),
    )


def torque_by_joint(bench: Bench) -> dict[str, float]:
    """Largest rms torque of the equations of each joint [N m] or [N]."""
    found: dict[str, float] = {}
    for equation, rms in zip(bench.data.equations, bench.torque_rms, strict=True):
        found[equation.joint] = max(found.get(equation.joint, 0.0), float(rms))
    return found
