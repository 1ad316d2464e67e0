"""Candidates: every effect of the library at every place that the model does not have yet."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.bench import Bench
from sea_ident.discrepancy.fit import Fit
from sea_ident.discrepancy.noise import NoiseFloor, stacked
from sea_ident.effects import Effect, Side, effect_classes
from sea_ident.effects.drift import TrendEffect
from sea_ident.effects.load import LoadEffect
from sea_ident.effects.signal import SignalEffect
from sea_ident.exceptions import EffectError

ONLY_AGAINST_REFERENCE = ("payload",)
"""Effects that a fit of all parameters absorbs altogether."""

SINGLE_PRECISION = 1e-4
"""Share of the power of a column that single precision does not tell from nothing."""

LARGEST_OF_MANY = 0.5
"""Torque of a shape, as a share of the torque of the motor, beyond which another shape is taken where there is one."""

ABSORBED = 1e-8
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
        if name in ONLY_AGAINST_REFERENCE or issubclass(kind, TrendEffect):
            continue
        for place in kind.instances(bench.robot):
            effect = place.beside() if effect_key(place) in present else place
            if effect is None:
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
    whitener: NDArray[np.complex128],
    left: FloatArray,
    effect: Effect,
) -> Candidate | None:
    """One candidate with its best shape, None where it cannot act on this robot or in this motion."""
    slopes: FloatArray
    try:
        anchored = bench.anchored((*fit.effects, effect), fit.parameters)[-1]
        if isinstance(anchored, SignalEffect):
            shown = [bench.signal_tangent(anchored, amount, fit.effects, fit.parameters) for amount in anchored.amounts]
            variants: tuple[Effect, ...] = (anchored,)
            touched = np.arange(len(bench.data.equations))
            spectra = np.stack([torque for torque, _ in shown], axis=-1)[:, :, None, :]
            slopes = np.stack([slope for _, slope in shown], axis=-1)
        else:
            variants = _coarse(anchored).variants(bench.state(fit.effects))
            touched, spectra = bench.variant_spectra(variants, fit.effects)
            slopes = np.zeros((len(touched), 0))
    except EffectError:
        return None
    harmonics, equations, count, width = spectra.shape
    if width == 0 or not np.any(spectra):
        return None
    whole = np.zeros((harmonics, len(fit.scale), count * width), dtype=np.complex128)
    whole[:, touched] = spectra.reshape(harmonics, equations, count * width)
    if anchored.side is Side.SPRING and not isinstance(anchored, SignalEffect):
        slopes = bench.slopes_of(whole, bench.links_of(anchored))
    if np.any(slopes):
        scaled = bench.scaled(whole, slopes, fit.residual, fit.scale, bench.stiffness_of(fit))
    else:
        scaled = np.asarray(whole * fit.scale[:, None], dtype=np.complex128)
        slopes = np.zeros((len(fit.scale), count * width))
    touched = np.union1d(touched, np.flatnonzero(np.any(slopes != 0.0, axis=1)))
    flat = stacked(np.matmul(whitener[:, :, touched], scaled[:, touched]))
    norms = np.sqrt(np.sum(flat**2, axis=0))
    flat /= np.where(norms > 0.0, norms, 1.0)
    # single precision is plenty for a comparison of normalised columns, and half the work
    shadow = (fit.basis.astype(np.float32).T @ flat.astype(np.float32)).astype(np.float64).reshape(-1, count, width)
    shaped = flat.reshape(len(flat), count, width)
    gram = np.einsum("mvk,mvl->vkl", shaped, shaped) - np.einsum("mvk,mvl->vkl", shadow, shadow)
    score = np.einsum("mvk,m->vk", shaped, left)
    scale = np.sqrt(np.maximum(np.einsum("vkk->vk", gram), 0.0))
    visible = scale**2 > SINGLE_PRECISION
    score = np.where(visible, score, 0.0)
    scale = np.where(visible, scale, 1.0)
    gram = np.where(visible[:, :, None] & visible[:, None, :], gram / (scale[:, :, None] * scale[:, None, :]), 0.0)
    inverse = np.linalg.pinv(gram, rcond=1e-3, hermitian=True)
    values = np.einsum("vkl,vl->vk", inverse, score / scale) / scale
    values = values / np.where(norms > 0.0, norms, 1.0).reshape(count, width)
    gains = np.einsum("vk,vk->v", score * norms.reshape(count, width), values)
    allowed = np.array([_allowed(bench, fit, variant, value) for variant, value in zip(variants, values, strict=True)])
    if count > 1:
        # a wave that is much longer than the path bends like what is there already, and is as large as you like
        own = np.einsum("hevk,vk->hev", whole.reshape(harmonics, -1, count, width)[:, touched], values)
        sizes = np.sqrt(np.sum(np.abs(own) ** 2, axis=0)) / np.maximum(bench.torque_rms[touched, None], 1e-300)
        modest = np.max(sizes, axis=0, initial=0.0) <= LARGEST_OF_MANY
        if np.any(allowed & modest):
            gains = np.where(modest, gains, -1.0)
    # those that single precision leaves in doubt are looked at one by one, as are the best
    doubtful = {int(v) for v in np.flatnonzero(~visible.all(axis=1))} if count <= 10 else set()
    tries = doubtful | {int(v) for v in np.argsort(np.where(allowed, gains, -1.0))[-2:]}
    if width > 1:
        tries |= {int(v) for v in np.argsort(gains)[-2:]}
    best: Candidate | None = None
    for v in tries:
        found = _exactly(bench, fit, left, variants[v], shaped[:, v], norms.reshape(count, width)[v], count)
        if best is None or found.gain > best.gain:
            best = found
    if best is None:
        return None
    return replace(best, effect=_with_smoothing_of(anchored, best.effect))


def _exactly(
    bench: Bench, fit: Fit, left: FloatArray, effect: Effect, columns: FloatArray, norms: FloatArray, tests: int
) -> Candidate:
    """A candidate with one shape, from its normalised whitened columns (M, k)."""
    across = columns - fit.basis @ (fit.basis.T @ columns)
    across -= fit.basis @ (fit.basis.T @ across)
    strength = np.sum(across**2, axis=0)
    across[:, strength <= ABSORBED] = 0.0
    size = np.where(norms > 0.0, norms, 1.0)
    values = np.linalg.pinv(across, rcond=1e-4) @ left / size
    if not _allowed(bench, fit, effect, values):
        values = _allowed_part(bench, effect, across, left) / size
    gain = float((across * size * values).sum(axis=1) @ left)
    amounts = effect.amounts if isinstance(effect, SignalEffect) else ()
    if amounts:
        held = {a.name: float(np.clip(v, a.lower, a.upper)) for a, v in zip(amounts, values, strict=True)}
        effect = replace(effect, **held)  # type: ignore[arg-type]
    return Candidate(
        effect=effect,
        gain=gain if _allowed(bench, fit, effect, values) else 0.0,
        columns=len(values),
        tests=tests,
        values=values,
        directions=across * size,
        raw_power=size**2,
    )


def _allowed_part(bench: Bench, effect: Effect, across: FloatArray, left: FloatArray) -> FloatArray:
    """(k,) estimates with as many columns as physics allows: those of the wrong sign are held at zero."""
    lower = [0.0 if c.nonnegative else -np.inf for c in effect.columns(bench.robot)]
    scale = np.linalg.norm(across, axis=0)
    usable = scale > 0.0
    values = np.zeros(across.shape[1])
    if np.any(usable):
        bounds = (np.array(lower)[usable], np.full(int(usable.sum()), np.inf))
        values[usable] = lsq_linear(across[:, usable], left, bounds).x
    return values


def _coarse(effect: Effect) -> Effect:
    """The effect with its smoothing rounded, so that columns are found again in the next search."""
    smoothing = getattr(effect, "smoothing", None)
    if smoothing is None or isinstance(effect, LoadEffect):
        return effect
    return replace(effect, smoothing=float(2.0 ** (round(2.0 * np.log2(smoothing)) / 2.0)))  # type: ignore[call-arg]


def _with_smoothing_of(exact: Effect, effect: Effect) -> Effect:
    if any(shape.name == "smoothing" for shape in effect.shapes) or not hasattr(exact, "smoothing"):
        return effect
    return replace(effect, smoothing=exact.smoothing)  # type: ignore[call-arg]


def _allowed(bench: Bench, fit: Fit, effect: Effect, values: FloatArray) -> bool:
    """Whether estimates respect the signs that physics demands, and make sense beside the other parameters."""
    columns = effect.columns(bench.robot)
    signs = all(not column.nonnegative or value >= 0.0 for column, value in zip(columns, values, strict=False))
    return signs and (not columns or effect.plausible(values, fit.parameters))
