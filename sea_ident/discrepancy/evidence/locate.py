"""Where model and data disagree: by joint, equation and part of the motion."""

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.fit import Fit
from sea_ident.discrepancy.bench.gap import noise_of_residual
from sea_ident.discrepancy.measured.data import EquationKind, waveform
from sea_ident.discrepancy.measured.noise import (
    NoiseFloor,
    closed_directions,
    closed_freedom_of_many,
    stacked,
    unstacked,
)
from sea_ident.discrepancy.result.findings import Location

SIGNIFICANT = 5.0
"""Locations below this z-score are not told."""

MOST = 60
"""Largest number of locations told."""


def locate(bench: Bench, fit: Fit, noise: NoiseFloor) -> tuple[Location, ...]:
    """Excess energy of the mean residual by joint, equation and regime, the strongest first.

    The noise of a regime is that of the noise floor, or what the periods scatter by in this very regime, whichever is
    more; friction that differs from pass to pass scatters more at reversals, and in a few directions only.
    """
    data = bench.data
    residual = waveform(bench.clean_residual(fit), data.samples)
    scatter, size = _scatter(bench, fit, noise), noise_of_residual(fit, noise)
    found = []
    numbers = 2 * data.harmonics + 1
    for e, equation in enumerate(data.equations):
        keep = ~data.left_out[:, e]
        share = _filled(scatter[:, keep, e], numbers * float(np.mean(keep)))
        for regime, chosen in regimes(bench, equation.index).items():
            part = chosen & keep
            count = numbers * float(np.count_nonzero(part)) / data.samples
            if count < 4.0:
                continue
            variance, own = float(size[e] ** 2), scatter[:, part, e]
            if len(own):
                variance = max(variance, float(np.mean(own**2)) / data.averaged)
            power = float(np.mean(residual[part, e] ** 2))
            z = (power / variance - 1.0) * np.sqrt(share * count / 2.0)
            # of few directions the energy has a long tail: as rare as the z-score would be of many
            directions = min(share, _filled(own, count)) * count
            chance = stats.f.sf(power / variance, directions, directions * closed_freedom_of_many(len(own)))
            if z > SIGNIFICANT and chance < stats.norm.sf(SIGNIFICANT):
                label = _label(bench, residual, e, part)
                found.append(Location(equation.joint, label, regime, float(np.sqrt(power - variance)), float(z)))
    return tuple(sorted(found, key=lambda x: -x.z)[:MOST])


def _filled(scatter: FloatArray, count: float) -> float:
    """Share of the directions of this many numbers that the steps between periods (S, ...) fill evenly [-]."""
    return min(closed_directions(scatter), count) / count if len(scatter) and count > 0.0 else 1.0


def _scatter(bench: Bench, fit: Fit, noise: NoiseFloor) -> FloatArray:
    """(S, N, E) steps between the periods, without what the samples that are left out put into them [N m]."""
    count = len(bench.data.equations)
    flat = np.stack([stacked(residual / fit.scale) for residual in bench.period_steps(fit)])
    free = bench.freed(noise)
    if free.count:
        # the same span, not whitened: as in the residual of the mean
        plain = np.matmul(np.linalg.inv(bench.whitener(noise)), unstacked(free.basis, count))
        basis = np.linalg.qr(stacked(plain))[0]
        flat = flat - (flat @ basis) @ basis.T
    return np.stack([waveform(unstacked(values, count), bench.data.samples) for values in flat])


def regimes(bench: Bench, joint: int) -> dict[str, NDArray[np.bool_]]:
    """(N,) samples of each part of the motion of a joint."""
    motion = bench.data.motion
    speed, q = motion.dtheta[:, joint], motion.q[:, joint]
    torque = bench.data.tau_motor[:, joint]
    fast = float(np.max(np.abs(speed)))
    out: dict[str, NDArray[np.bool_]] = {
        "all": np.ones(len(motion), dtype=np.bool_),
        "near reversal": np.abs(speed) < 0.1 * fast,
        "slow": np.abs(speed) < 0.3 * fast,
        "fast": np.abs(speed) > 0.6 * fast,
        "forwards": speed > 0.0,
        "backwards": speed < 0.0,
        "low load": np.abs(torque) < np.quantile(np.abs(torque), 1 / 3),
        "high load": np.abs(torque) > np.quantile(np.abs(torque), 2 / 3),
        "low position": q < np.quantile(q, 1 / 3),
        "middle position": (q >= np.quantile(q, 1 / 3)) & (q <= np.quantile(q, 2 / 3)),
        "high position": q > np.quantile(q, 2 / 3),
    }
    if bench.robot.elastic[joint]:
        deflection = np.abs(motion.deflection[:, joint])
        out["small deflection"] = deflection < np.quantile(deflection, 1 / 3)
        out["large deflection"] = deflection > np.quantile(deflection, 2 / 3)
    eighth = (np.arange(len(motion)) * 8) // len(motion)
    period = bench.data.period
    for k in range(8):
        out[f"time {k * period / 8:.3g} to {(k + 1) * period / 8:.3g} s"] = eighth == k
    return out


def _label(bench: Bench, residual: FloatArray, equation: int, part: NDArray[np.bool_]) -> str:
    """`spring` where the other equation of the joint shows the same with the opposite sign."""
    own = bench.data.equations[equation]
    for e, other in enumerate(bench.data.equations):
        if other.joint == own.joint and other.kind is not own.kind and EquationKind.SUM not in (own.kind, other.kind):
            a, b = residual[part, equation], residual[part, e]
            size = float(np.linalg.norm(a) * np.linalg.norm(b))
            if size > 0.0 and float(a @ b) / size < -0.8:
                return "spring"
    return str(own.kind)
