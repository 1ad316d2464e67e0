"""When a push begins and ends: every window of a period is compared, then its edges are moved to a part of a sample.

Where it meets the link is asked last: a point would bend to a window that is not yet right.
"""

from dataclasses import replace

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.bench import Bench
from sea_ident.discrepancy.fit import Fit
from sea_ident.discrepancy.linear import whiten
from sea_ident.discrepancy.noise import NoiseFloor
from sea_ident.effects.external_force import ExternalForce

INSTANTS = 160
"""Instants in a period between which every push is compared."""

FINEST_STEP = 1.0 / 16.0
"""Last step by which edges are moved, in samples."""

POINT_ROUNDS = 4
"""Rounds in which the point of a push and its edges follow each other, ..."""

ENOUGH = 0.05
"""... or fewer, once the point takes less than this share of the excess."""

FIRST_PART = 0.5
"""Step in samples from which on edges are moved to less than a sample."""

FAR_ABOVE = 4.0
"""Times the statistic of interest from which on neither less than a sample nor a point makes a push the better one."""

NEARLY = 1e-12
"""Share of a period by which a push is shorter than all of it."""

ABSORBED = 1e-6
"""A component of a push of which the model leaves less than this share of its power is not looked at."""


def with_sharp_edges(bench: Bench, fit: Fit, noise: NoiseFloor, position: int, beat: float = np.inf) -> Fit:
    """A fit with the begin and the end of a push where they fit best, down to a part of a sample.

    The statistic bends at every sample and has minima of its own far from the best window, so there is no
    derivative to follow: all windows are compared first, then the edges of the best are moved by smaller and smaller
    steps.

    Args:
        bench: the recording.
        fit: a model with a push.
        noise: noise floor.
        position: of the push among the effects.
        beat: statistic that is of interest; what is far above with edges to the sample is left so.

    Returns:
        The fit.
    """
    push = fit.effects[position]
    if not isinstance(push, ExternalForce):
        return fit
    stride = max(bench.data.samples // INSTANTS, 1)
    wide = _with(fit, position, *_best_window(bench, fit, noise, position, stride), bench, noise)
    fit = _sharpened(bench, min(fit, wide, key=lambda each: each.statistic), noise, position, stride, 1.0)
    # what pushes all the time but then is nearly the same as what pushes then, for a model takes up a constant force
    start, stop = (getattr(fit.effects[position], name) for name in ("start", "stop"))
    fit = min(fit, _with(fit, position, stop, start, bench, noise), key=lambda each: each.statistic)
    fit = _sharpened(bench, fit, noise, position, 1, 1.0)
    if fit.statistic > FAR_ABOVE * beat:
        return bench.fit(fit.effects, noise, start=fit.parameters)
    return _with_point(bench, _sharpened(bench, fit, noise, position, FIRST_PART), noise, position)


def sharpened(bench: Bench, fit: Fit, noise: NoiseFloor, first: int) -> Fit:
    """A fit with the edges of all pushes from a position on moved a little: what was found since bent them before."""
    for position in range(first, len(fit.effects)):
        if isinstance(fit.effects[position], ExternalForce):
            fit = _with_point(bench, _sharpened(bench, fit, noise, position, 1), noise, position)
    return fit


def _with_point(bench: Bench, fit: Fit, noise: NoiseFloor, position: int) -> Fit:
    """A fit with the point of a push refined, and its edges once more, for these are held where it was wrong."""
    for _ in range(POINT_ROUNDS):
        before = fit.statistic
        fit = bench.refine(fit.effects, noise, start=fit.parameters, only=position)
        if before - fit.statistic < ENOUGH * fit.excess:
            return fit
        fit = _sharpened(bench, fit, noise, position, 1)
    return bench.fit(fit.effects, noise, start=fit.parameters)


def _sharpened(
    bench: Bench, fit: Fit, noise: NoiseFloor, position: int, step: float, finest: float = FINEST_STEP
) -> Fit:
    """A fit with the edges of a push moved by smaller and smaller steps, from so many samples to the finest."""
    period = bench.data.period
    interval = period / bench.data.samples
    while step >= finest:
        better = fit
        for moves in ((1, 0), (0, 1), (1, 1)):
            for sign in (-1, 1):
                own = better.effects[position]
                start, stop = (
                    float(np.mod(getattr(own, name) + sign * move * step * interval, period))
                    for name, move in zip(("start", "stop"), moves, strict=True)
                )
                new = _with(better, position, start, stop, bench, noise)
                if new.statistic < better.statistic:
                    better = new
        if better is fit:
            step = float(step // 2) if step > 1.0 else step / 2.0
        fit = better
    return fit


def _with(fit: Fit, position: int, start: float, stop: float, bench: Bench, noise: NoiseFloor) -> Fit:
    effects = list(fit.effects)
    effects[position] = replace(effects[position], start=start, stop=stop, period=bench.data.period)  # type: ignore[call-arg]
    return bench.fit(effects, noise, start=fit.parameters, tangents=False)


def _best_window(bench: Bench, fit: Fit, noise: NoiseFloor, position: int, stride: int) -> tuple[float, float]:
    """Begin and end [s] of the push that would bring the statistic down most, the rest of the model free.

    A push during any window is the difference of two that begin with the period.
    """
    push, period, samples = fit.effects[position], bench.data.period, bench.data.samples
    interval = period / samples
    others = [e for k, e in enumerate(fit.effects) if k != position]
    rest = bench.fit(others, noise, start=fit.parameters)
    left = rest.off(rest.whitened)
    ends = np.arange(stride, samples + 1, stride)
    # each sample stands for half an interval to either side; a push of a whole period would be none
    stops = [(float(end) - 0.5) * interval - NEARLY * period for end in ends]
    begun = [replace(push, start=-0.5 * interval, stop=stop, period=period) for stop in stops]  # type: ignore[call-arg]
    touched, spectra = bench.variant_spectra(begun, others)
    harmonics, equations, count, width = spectra.shape
    whole = np.zeros((harmonics, len(rest.scale), count * width), dtype=np.complex128)
    whole[:, touched] = spectra.reshape(harmonics, equations, count * width)
    scaled = np.asarray(whole * rest.scale[:, None], dtype=np.complex128)
    columns = rest.off(whiten(bench.whitener(noise), scaled)).reshape(-1, count, width)
    # nothing pushes before the first instant
    columns = np.concatenate([np.zeros((len(columns), 1, width)), columns], axis=1)
    gains = _window_gains(columns, left)
    i, j = np.unravel_index(int(np.argmax(gains)), gains.shape)
    first, last = ((float(int(k) * stride) - 0.5) * interval for k in (i, j))
    return float(np.mod(first, period)), float(np.mod(last, period))


def _window_gains(columns: FloatArray, left: FloatArray) -> FloatArray:
    """(T, T) drop of the statistic by a push from one instant to another, where that is earlier round the end.

    Args:
        columns: (M, T, k) of pushes from the beginning of the period to every instant.
        left: (M,) whitened residual.
    """
    size, count, width = columns.shape
    flat = columns.reshape(size, count * width)
    gram = (flat.T @ flat).reshape(count, width, count, width).transpose(0, 2, 1, 3)
    score = (left @ flat).reshape(count, width)
    own = gram[np.arange(count), np.arange(count)]
    # from i to j is C_j - C_i, and where j is earlier the whole period comes on top
    normal = own[None, :] + own[:, None] - _both(gram)
    along = score[None, :] - score[:, None]
    round_the_end = np.tril(np.ones((count, count), dtype=bool), -1)
    wrapped = normal + gram[-1, -1] + _both(gram[None, :, -1] - gram[:, None, -1])
    normal = np.where(round_the_end[:, :, None, None], wrapped, normal)
    along = np.where(round_the_end[:, :, None], along + score[-1], along)
    power = np.sqrt(np.maximum(np.einsum("ijkk->ijk", normal), 0.0))
    visible = power > np.sqrt(ABSORBED) * np.max(power)
    scale = np.where(visible, power, 1.0)
    seen = visible[..., :, None] & visible[..., None, :]
    normal = np.where(seen, normal / (scale[..., :, None] * scale[..., None, :]), 0.0)
    along = np.where(visible, along / scale, 0.0)
    values = np.einsum("ijkl,ijl->ijk", np.linalg.pinv(normal, rcond=1e-3, hermitian=True), along)
    return np.asarray(np.einsum("ijk,ijk->ij", values, along))


def _both(blocks: FloatArray) -> FloatArray:
    """Blocks and their transposes together."""
    return blocks + blocks.transpose(0, 1, 3, 2)
