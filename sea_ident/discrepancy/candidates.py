"""Candidates: every effect of the library at every place that the model does not have yet."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.bench import Bench, Fit, is_signal
from sea_ident.discrepancy.noise import NoiseFloor, stacked
from sea_ident.effects import Effect, effect_classes
from sea_ident.effects.drift import DriftEffect
from sea_ident.effects.signal import SignalEffect
from sea_ident.exceptions import EffectError

NOT_IN_THE_MEAN = ("external_force", "payload", "temperature_friction", "torque_constant_drift")
"""Effects that other comparisons look for: in single periods, or against a reference."""

ABSORBED = 1e-5
"""A column of which the model leaves less than this share of its power is absorbed."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """An effect as a direction in which the residual may go.

    Attributes:
        effect: the effect with its best shape on the grid.
        gain: drop of the statistic when it is added, its shape held.
        columns: number of its columns.
        tests: number of shapes tried.
        values: (k,) estimates of its columns, or of its amounts.
        directions: (M, k) whitened columns after projection off the model.
        raw_power: (k,) squared norms of the whitened columns before it.
    """

    effect: Effect
    gain: float
    columns: int
    tests: int
    values: FloatArray
    directions: FloatArray
    raw_power: FloatArray

    @property
    def key(self) -> tuple[str, str | None, str]:
        """What makes it this candidate, whatever its shape."""
        return effect_key(self.effect)

    @property
    def absorbed(self) -> float:
        """Share of its power that the model absorbs [-]."""
        total = float(self.raw_power.sum())
        return 1.0 - float(np.sum(self.directions**2)) / total if total > 0.0 else 1.0


def effect_key(effect: Effect) -> tuple[str, str | None, str]:
    """Name, joint, and the other joint where there is one."""
    return effect.name, effect.joint, str(getattr(effect, "other", "") or "")


def candidate_effects(bench: Bench, effects: Sequence[Effect]) -> tuple[Effect, ...]:
    """Every effect of the library at every place that the model does not have yet, and that shows in the mean."""
    present = {effect_key(effect) for effect in effects}
    present_columns = {column.name for column in bench.labels(effects)}
    found = []
    for name, kind in sorted(effect_classes().items()):
        if name in NOT_IN_THE_MEAN or issubclass(kind, DriftEffect):
            continue
        for effect in kind.instances(bench.robot):
            if effect_key(effect) in present:
                continue
            if {column.name for column in effect.columns(bench.robot)} & present_columns:
                continue
            found.append(effect)
    return tuple(found)


def scan(bench: Bench, fit: Fit, noise: NoiseFloor, effects: Sequence[Effect] | None = None) -> list[Candidate]:
    """How far every candidate would bring the statistic down, best first."""
    whitener = bench.whitener(noise)
    left = fit.whitened - fit.basis @ (fit.basis.T @ fit.whitened)
    found = []
    for effect in candidate_effects(bench, fit.effects) if effects is None else effects:
        candidate = examine(bench, fit, whitener, left, effect)
        if candidate is not None:
            found.append(candidate)
    return sorted(found, key=lambda c: -c.gain)


def examine(
    bench: Bench,
    fit: Fit,
    whitener: np.typing.NDArray[np.complex128],
    left: FloatArray,
    effect: Effect,
) -> Candidate | None:
    """One candidate with its best shape, None where it cannot act on this robot or in this motion."""
    try:
        anchored = bench.anchored((*fit.effects, effect), fit.parameters)[-1]
        if isinstance(anchored, SignalEffect):
            shown = [bench.signal_tangent(anchored, amount, fit.effects, fit.parameters) for amount in anchored.amounts]
            variants: tuple[Effect, ...] = (anchored,)
            spectra = np.stack(shown, axis=-1)[:, :, None, :]
        else:
            variants = anchored.variants(bench.state(fit.effects))
            spectra = bench.variant_spectra(variants, fit.effects)
    except EffectError:
        return None
    harmonics, equations, count, width = spectra.shape
    if width == 0 or not np.any(spectra):
        return None
    flat = stacked(np.matmul(whitener, spectra.reshape(harmonics, equations, count * width)))
    power = np.sum(flat**2, axis=0)
    across = flat - fit.basis @ (fit.basis.T @ flat)
    across_power = np.sum(across**2, axis=0)
    across[:, across_power <= ABSORBED * power] = 0.0
    shaped = across.reshape(len(flat), count, width)
    gram = np.einsum("mvk,mvl->vkl", shaped, shaped)
    score = np.einsum("mvk,m->vk", shaped, left)
    scale = np.sqrt(np.einsum("vkk->vk", gram))
    scale = np.where(scale > 0.0, scale, 1.0)
    gram = gram / (scale[:, :, None] * scale[:, None, :])
    inverse = np.linalg.pinv(gram, rcond=1e-8, hermitian=True)
    values = np.einsum("vkl,vl->vk", inverse, score / scale) / scale
    gains = np.einsum("vk,vk->v", score, values)
    allowed = np.array([_allowed(bench, variant, value) for variant, value in zip(variants, values, strict=True)])
    gains = np.where(allowed, gains, 0.0)
    best = int(np.argmax(gains))
    chosen = variants[best]
    if is_signal(chosen):
        amounts = chosen.amounts  # type: ignore[attr-defined]
        held = {
            a.name: float(np.clip(v, a.lower, a.upper)) for a, v in zip(amounts, values[best], strict=True)
        }
        chosen = replace(chosen, **held)  # type: ignore[arg-type]
    return Candidate(
        effect=chosen,
        gain=float(gains[best]),
        columns=width,
        tests=count,
        values=values[best],
        directions=shaped[:, best],
        raw_power=power.reshape(count, width)[best],
    )


def _allowed(bench: Bench, effect: Effect, values: FloatArray) -> bool:
    """Whether estimates respect the signs that physics demands."""
    columns = effect.columns(bench.robot)
    return all(not column.nonnegative or value >= 0.0 for column, value in zip(columns, values, strict=False))
