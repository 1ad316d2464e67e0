"""Candidates: how far every effect that a model does not have yet would bring the statistic down."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from sea_ident._typing import FloatArray, IntArray
from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.columns import Key, Places, effect_key
from sea_ident.discrepancy.bench.fit import Fit
from sea_ident.discrepancy.bench.free_shapes import nearly
from sea_ident.discrepancy.bench.judge import penalty
from sea_ident.discrepancy.bench.lacking import candidate_effects
from sea_ident.discrepancy.bench.linear import whiten
from sea_ident.discrepancy.measured.noise import NoiseFloor
from sea_ident.effects import Effect, JointEffect, Side
from sea_ident.effects.load import LoadEffect
from sea_ident.effects.signal import SignalEffect
from sea_ident.exceptions import EffectError
from sea_ident.side_by_side import side_by_side

SINGLE_PRECISION = 1e-4
"""Share of the power of a column that single precision does not tell from nothing."""

FEW_SHAPES = 48
"""Shapes of one effect up to which those that single precision leaves in doubt are looked at one by one."""

LARGEST_OF_MANY = 0.5
"""Torque of a shape, as a share of the torque of the motor, beyond which another shape is taken where there is one."""

COLUMNS_AT_ONCE = 200
"""Columns of candidates that are compared with the model at a time, or a few more."""

AMOUNT_DIGITS = 2
"""Digits of errors in the chain of signals that the columns of other candidates are evaluated behind: more make no
difference to which of them promises most, and every one of them would be evaluated again whenever a fit moves, ..."""

ELSEWHERE_DIGITS = 1
"""... and those for what depends on where the links are, not on how much a spring gives."""

ROUGHLY = 1e-4
"""Share of the gain of the best shape that single precision does not tell from nothing, ..."""

EXACTLY = 1e-9
"""... and that double precision does not."""

ABSORBED = 1e-8
"""A column of which the model leaves less than this share of its power is absorbed."""

ELSEWHERE = 0.05
"""Share of what is to be explained that must be in the equations of an effect for it to be looked at: what a refit of
the model smears into others is less [-]."""


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
    def key(self) -> Key:
        """What makes it this candidate, whatever its shape."""
        return effect_key(self.effect)

    @property
    def size(self) -> float:
        """Of what it does to the model, in units of the noise, a part of which the model takes up [-]."""
        return float(np.sqrt(np.sum(self.values**2 * self.raw_power)))

    @property
    def absorbed(self) -> float:
        """Share of its power that the model absorbs [-]."""
        total = float(self.raw_power.sum())
        return 1.0 - float(np.sum(self.directions**2)) / total if total > 0.0 else 1.0


def scan(
    bench: Bench,
    fit: Fit,
    noise: NoiseFloor,
    effects: Sequence[Effect] | None = None,
    instead_of: "Sought | None" = None,
) -> list[Candidate]:
    """How far every candidate would bring the statistic down, best first, and of those that do the same the simplest.

    On a motion that does not tell two effects apart, their gains differ by rounding alone.

    Args:
        bench: the recording.
        fit: the model.
        noise: its noise floor.
        effects: what is compared; all of the library by default.
        instead_of: what a candidate is to explain, where only those matter that may do so; anything by default.
    """
    left = fit.off(fit.whitened)
    # single precision is plenty for a comparison of normalised columns, and half the work
    basis = np.concatenate([fit.free.basis, fit.basis], axis=1).astype(np.float32)
    model = _Model(fit, bench.whitener(noise), left, basis)
    effects = candidate_effects(bench, fit.effects) if effects is None else effects
    if instead_of is not None:
        effects = [effect for effect in effects if instead_of.concerns(bench.equations_of(effect))]
    found: list[Candidate] = []
    for part, places in side_by_side(_Compared(bench, model), bench.in_two(effects)):
        bench.remember(places)
        found.extend(part)
    return sorted(found, key=lambda c: (-float(f"{c.gain:.9g}"), penalty(c.effect, bench)))


@dataclass(frozen=True, eq=False)
class Sought:
    """What an effect explains, which another is to explain in its place.

    Attributes:
        shares: (E,) of it in every equation, in units of the noise there [-].
    """

    shares: FloatArray

    def concerns(self, equations: IntArray | None) -> bool:
        """Whether an effect that acts in these equations may explain it; None where that is not known."""
        return equations is None or float(np.sum(self.shares[equations])) > ELSEWHERE


def sought(without: Fit, with_it: Fit, noise: NoiseFloor) -> Sought:
    """What is explained by the effect that two models differ by."""
    change = np.abs(without.residual * without.scale[None] - with_it.residual * with_it.scale[None]) ** 2
    power = np.sum(change / np.maximum(np.real(np.einsum("kee->ke", noise.covariance)), 1e-300), axis=0)
    return Sought(power / max(float(np.sum(power)), 1e-300))


@dataclass(frozen=True, eq=False)
class _Model:
    """What candidates are held against: a fit, its whitener, what it leaves (M,), all that is free (M, r)."""

    fit: Fit
    whitener: NDArray[np.complex128]
    left: FloatArray
    basis: NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class _Compared:
    """Compares effects with a model.

    Attributes:
        bench: the recording.
        model: the model.
    """

    bench: Bench
    model: _Model

    def __call__(self, effects: Sequence[Effect]) -> tuple[list[Candidate], Places]:
        """Those that can act here, each with its best shape, and where they act."""
        bench, fit, left = self.bench, self.model.fit, self.model.left
        tried = [shown for effect in effects if (shown := _promising(bench, self.model, effect)) is not None]
        found: list[Candidate] = []
        for some in _chunks(tried):
            # all together, for the basis is much larger than the columns of one
            columns = np.concatenate([columns for each in some for columns in each.columns], axis=1)
            across = fit.off(fit.off(columns))
            begin = 0
            for each in some:
                shaped: list[Candidate] = []
                for effect, norms in zip(each.variants, each.norms, strict=True):
                    own = across[:, begin : begin + len(norms)].copy()
                    begin += len(norms)
                    shaped.append(_exactly(bench, fit, left, effect, own, norms, each.tests))
                if shaped:
                    order = _best_last(np.array([c.gain for c in shaped]), np.array([c.size for c in shaped]), EXACTLY)
                    best = shaped[order[-1]]
                    found.append(replace(best, effect=_with_smoothing_of(each.effect, best.effect)))
        return found, bench.places_of(effects)


@dataclass(frozen=True, eq=False)
class _Promising:
    """The most promising shapes of an effect.

    Attributes:
        effect: anchored in the model.
        variants: the effect with each of these shapes.
        columns: of each, whitened and normalised (M, k).
        norms: (k,) of each.
        tests: number of shapes looked at.
    """

    effect: Effect
    variants: tuple[Effect, ...]
    columns: tuple[FloatArray, ...]
    norms: tuple[FloatArray, ...]
    tests: int


def _chunks(tried: Sequence[_Promising]) -> Iterator[list[_Promising]]:
    """The same in portions of not many more than `COLUMNS_AT_ONCE` columns."""
    portion: list[_Promising] = []
    width = 0
    for each in tried:
        portion.append(each)
        width += sum(len(norms) for norms in each.norms)
        if width >= COLUMNS_AT_ONCE:
            yield portion
            portion, width = [], 0
    if portion:
        yield portion


def _promising(bench: Bench, model: _Model, effect: Effect) -> _Promising | None:
    """The shapes of an effect worth a closer look, None where it cannot act on this robot or in this motion."""
    fit, left = model.fit, model.left
    slopes = np.zeros((len(fit.scale), 0))
    try:
        anchored = bench.anchored((*fit.effects, effect), fit.parameters)[-1]
        if isinstance(anchored, SignalEffect):
            shown = [bench.signal_tangent(anchored, amount, fit.effects, fit.parameters) for amount in anchored.ranges]
            variants: tuple[Effect, ...] = (anchored,)
            touched = np.arange(len(bench.data.equations))
            spectra = np.stack([torque for torque, _ in shown], axis=-1)[:, :, None, :]
            slopes = np.stack([slope for _, slope in shown], axis=-1)
        else:
            around = nearly(fit.effects, AMOUNT_DIGITS if isinstance(anchored, JointEffect) else ELSEWHERE_DIGITS)
            variants = _coarse(anchored).variants(bench.state(around))
            touched, spectra = bench.variant_spectra(variants, around)
    except EffectError:
        return None
    harmonics, equations, count, width = spectra.shape
    if width == 0 or not np.any(spectra):
        return None
    if anchored.side is Side.SPRING or slopes.size:
        whole = np.zeros((harmonics, len(fit.scale), count * width), dtype=np.complex128)
        whole[:, touched] = spectra.reshape(harmonics, equations, count * width)
        slopes = slopes if slopes.size else bench.slopes_of(whole, bench.links_of(anchored), fit.effects)
        if np.any(slopes):
            whole = bench.scaled(whole, slopes, fit.residual, fit.scale, bench.stiffness_of(fit))
        else:
            whole *= fit.scale[:, None]
        # what makes a spring stiffer changes the scale of the residual of its link, wherever else it acts
        changed = np.union1d(touched, np.flatnonzero(np.any(slopes != 0.0, axis=1)))
        flat = whiten(model.whitener[:, :, changed], whole[:, changed])
    else:
        scaled = spectra.reshape(harmonics, equations, count * width) * fit.scale[touched, None]
        flat = whiten(model.whitener[:, :, touched], scaled)
    norms = np.sqrt(np.sum(flat**2, axis=0))
    flat /= np.where(norms > 0.0, norms, 1.0)
    shadow = model.basis.T @ flat.astype(np.float32)
    shaped = flat.reshape(len(flat), count, width)
    gram = _inner_products(flat, width) - _inner_products(shadow, width)
    score = (left @ flat).reshape(count, width)
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
    if count > 1 and not _bounded(bench, anchored):
        # a wave that is much longer than the path bends like what is there already, and is as large as you like
        own = np.einsum("hevk,vk->hev", spectra, values)
        usual = np.maximum(bench.torque_rms, bench.described_rms)[touched, None]
        sizes = np.sqrt(np.sum(np.abs(own) ** 2, axis=0)) / np.maximum(usual, 1e-300)
        modest = np.max(sizes, axis=0, initial=0.0) <= LARGEST_OF_MANY
        if np.any(allowed & modest):
            gains = np.where(modest, gains, -1.0)
    # those that single precision leaves in doubt are looked at one by one, as are the best
    doubtful = {int(v) for v in np.flatnonzero(~visible.all(axis=1))} if count <= FEW_SHAPES else set()
    strengths = np.sqrt(np.sum((values * norms.reshape(count, width)) ** 2, axis=1))
    tries = doubtful | {int(v) for v in _best_last(np.where(allowed, gains, -1.0), strengths, ROUGHLY)[-2:]}
    if width > 1:
        tries |= {int(v) for v in _best_last(gains, strengths, ROUGHLY)[-2:]}
    return _Promising(
        effect=anchored,
        variants=tuple(variants[v] for v in tries),
        columns=tuple(shaped[:, v].copy() for v in tries),
        norms=tuple(norms.reshape(count, width)[v] for v in tries),
        tests=count,
    )


def _best_last(gains: FloatArray, sizes: FloatArray, same: float) -> IntArray:
    """Order of shapes by their gains, the smallest last of those that do the same but for this share of the largest.

    Rounding would choose among them, and not in the same way on every machine.
    """
    return np.lexsort((-sizes, np.round(gains / max(float(np.max(np.abs(gains))), 1e-300) / same)))


def _inner_products(columns: NDArray[np.floating], width: int) -> FloatArray:
    """(v, k, k) inner products of the columns (M, v k) of each of several shapes with one another."""
    if width == 1:
        return np.asarray(np.sum(columns**2, axis=0)[:, None, None], dtype=np.float64)
    each = columns.reshape(len(columns), -1, width).transpose(1, 0, 2)
    return np.asarray(each.transpose(0, 2, 1) @ each, dtype=np.float64)


def _exactly(
    bench: Bench, fit: Fit, left: FloatArray, effect: Effect, across: FloatArray, norms: FloatArray, tests: int
) -> Candidate:
    """A candidate with one shape, from its normalised whitened columns (M, k) across all that is free."""
    strength = np.sum(across**2, axis=0)
    across[:, strength <= ABSORBED] = 0.0
    size = np.where(norms > 0.0, norms, 1.0)
    values = _estimates(across, left) / size
    if not _allowed(bench, fit, effect, values):
        values = _allowed_part(bench, effect, across, left) / size
    gain = float((across * size * values).sum(axis=1) @ left)
    amounts = effect.ranges if isinstance(effect, SignalEffect) else ()
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


def _estimates(across: FloatArray, left: FloatArray) -> FloatArray:
    """(k,) least squares with columns (M, k) that may depend on each other."""
    if across.shape[1] == 1:
        power = float(across[:, 0] @ across[:, 0])
        return np.array([float(across[:, 0] @ left) / power if power > 0.0 else 0.0])
    return np.asarray(np.linalg.pinv(across, rcond=1e-4) @ left, dtype=np.float64)


def _allowed_part(bench: Bench, effect: Effect, across: FloatArray, left: FloatArray) -> FloatArray:
    """(k,) estimates with as many columns as physics allows: those of the wrong sign are held at zero."""
    lower = [0.0 if c.nonnegative else -np.inf for c in effect.columns(bench.robot)]
    scale = np.linalg.norm(across, axis=0)
    usable = scale > 0.0
    values = np.zeros(across.shape[1])
    if len(values) == 1:
        return np.maximum(_estimates(across, left), lower)
    if np.any(usable):
        bounds = (np.array(lower)[usable], np.full(int(usable.sum()), np.inf))
        basis, triangle = np.linalg.qr(across[:, usable])
        values[usable] = lsq_linear(triangle, basis.T @ left, bounds, method="bvls").x
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


def _bounded(bench: Bench, effect: Effect) -> bool:
    """Whether physics bounds the size of an effect on both sides, however large it is beside the torque of a motor."""
    own = type(effect).plausible is not Effect.plausible
    return own and all(column.nonnegative for column in effect.columns(bench.robot))


def _allowed(bench: Bench, fit: Fit, effect: Effect, values: FloatArray) -> bool:
    """Whether estimates respect the signs that physics demands, and make sense beside the other parameters."""
    columns = effect.columns(bench.robot)
    signs = all(not column.nonnegative or value >= 0.0 for column, value in zip(columns, values, strict=False))
    return signs and (not columns or effect.plausible(values, fit.parameters))
