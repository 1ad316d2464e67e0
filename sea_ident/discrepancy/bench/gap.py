"""How far model and data are apart beyond the noise."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.fit import Fit
from sea_ident.discrepancy.measured.check import Findings, torque_units
from sea_ident.discrepancy.measured.noise import ComplexArray, NoiseFloor

NOISE_FREE = 1e-6
"""Share of a gap below which noise is none that a gap could be measured in [-]."""


@dataclass(frozen=True)
class Gap:
    """Rms beyond the noise per joint [N m], [N] for a slide; of positions [rad] or [m].

    Attributes:
        before: of the model as it was, refitted.
        after: of the model with the effects.
        noise: rms of the noise of the mean.
        units: unit of the torque of each joint; none where all are alike.
    """

    before: Mapping[str, float]
    after: Mapping[str, float]
    noise: Mapping[str, float]
    units: Mapping[str, str] = field(default_factory=dict)

    @property
    def shrink(self) -> float:
        """1 - after / before over all joints, each in units of its noise where they differ; 0 where there was none."""
        before, after = (float(np.linalg.norm(self._comparable(part))) for part in (self.before, self.after))
        return 1.0 - after / before if before > 0.0 else 0.0

    @property
    def opens(self) -> bool:
        """Whether there was no gap in any joint, and there is one now: no share says how much it grew."""
        there = any(after > self.noise[joint] for joint, after in self.after.items())
        return there and not any(value > 0.0 for value in self.before.values())

    @property
    def largest(self) -> str:
        """The joint where the gap was largest, beside its noise where units differ."""
        return self.largest_of(list(self.before))

    def largest_of(self, joints: Sequence[str]) -> str:
        """The same among some joints."""
        sizes = dict(zip(self.before, self._comparable(self.before), strict=True))
        return max(joints, key=lambda joint: float(sizes[joint]))

    @property
    def mixed(self) -> bool:
        """Whether the units of joints differ."""
        return len({self.units.get(joint) for joint in self.before}) > 1

    def within_noise(self, times: float = 1.0) -> bool:
        """Whether what is left over all joints is less than some times the noise, each as for `shrink`."""
        left, noise = (float(np.linalg.norm(self._comparable(part))) for part in (self.after, self.noise))
        return left < times * noise

    def _comparable(self, sizes: Mapping[str, float]) -> FloatArray:
        """(n,) sizes of one unit."""
        if not self.mixed:
            return np.array(list(sizes.values()))
        # a recording without noise has gaps all the same
        units = {j: max(self.noise[j], NOISE_FREE * max(self.before[j], self.after[j]), 1e-300) for j in sizes}
        return np.array([size / units[joint] for joint, size in sizes.items()])

    def summary(self, units: Mapping[str, str] | None = None) -> str:
        """Before, after and noise per joint, with these units where they are not said elsewhere."""
        parts = []
        for joint, before in self.before.items():
            after, noise = self.after[joint], self.noise[joint]
            change = "within the noise" if before == after == 0.0 else f"{before:.3g} -> {after:.3g}"
            unit = "" if units is None else f" {units[joint]}"
            parts.append(f"{joint} {change} (noise {noise:.2g}{unit})")
        shrink = f"; shrink {self.shrink:.2f}" if any(value > 0.0 for value in self.before.values()) else ""
        return f"{', '.join(parts)}{shrink}"


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


def drowned(findings: Findings, gap: Gap, torque: Mapping[str, float], still: Collection[str] = ()) -> Findings:
    """Findings with the joints whose noise is larger than their torque: of them, and with them, nothing can be told.

    That happens where a joint hardly follows its motion, as one that friction holds: what its encoder then shows is
    not what the model can be compared with, and every size is absorbed by noise.

    Args:
        findings: what was found before.
        gap: of the recording.
        torque: rms torque by joint [N m] or [N].
        still: joints of which nothing is compared, for they stand; where all do, they count all the same.
    """
    compared = [name for name in gap.noise if name not in still] or list(gap.noise)
    lost = [name for name in compared if not gap.noise[name] < torque[name]]
    if not lost:
        return findings
    text = (
        f"the noise of {', '.join(lost)} comes out larger than the torque there: does the joint follow its motion in "
        "every period, or does friction hold it? Nothing can be told of this recording; move that joint faster and "
        "farther, or leave it out (joints, on the command line --joints)"
    )
    return replace(findings, warnings=(*findings.warnings, text), fatal=True)
