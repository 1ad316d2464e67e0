"""When a push begins and ends: every window of a period is compared, then its edges are moved to a part of a sample.

Where it meets the link is asked last: a point would bend to a window that is not yet right.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sea_ident._typing import FloatArray, IntArray
from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.fit import Fit
from sea_ident.discrepancy.bench.judge import nearly_always, penalty
from sea_ident.discrepancy.bench.linear import off, span, whiten
from sea_ident.discrepancy.measured.noise import NoiseFloor
from sea_ident.effects import Effect
from sea_ident.effects.external_force import POINT, WHEN, ExternalForce

INSTANTS = 160
"""Instants in a period between which every push is compared."""

BEYOND = 2.0
"""Distances between these up to which edges are looked for on either side of the best window."""

FINE_STEP = 1.0 / 8.0
"""Step by which edges are moved within a sample or beyond, in samples, ..."""

FINEST_STEP = 1.0 / 64.0
"""... and the last one, within one such step: between samples the statistic has one minimum."""

BESIDE = 1e-3
"""Distance from the centre of mass, along every axis of the link, from which its point begins to move [m]."""

POINT_ROUNDS = 4
"""Rounds in which the point of a push and its edges follow each other, ..."""

ENOUGH = 0.05
"""... or fewer, once the point takes less than this share of the excess."""

MOST_MOVES = 4
"""Times that edges are moved where the best of those within reach is the last of them."""

FAR_ABOVE = 4.0
"""Times the statistic of interest from which on, its edges known to a part of a sample and its point as good as it
gets, finer edges do not make a push the better one."""

COARSE_STEP = 1.0 / 4.0
"""That part: what a large push leaves by edges that are half a sample off is far above all noise."""

FARTHEST = 32.0
"""Samples within which it is asked how sure the edges of a push are, ..."""

TWO_DEVIATIONS = 4.0
"""... by what the statistic rises by two standard deviations away."""

NEARLY = 1e-12
"""Share of a period by which a push is shorter than all of it."""

AT_ONCE = 0.9
"""Share of the samples in which either of two pushes comes from which on they come at once [-]."""

ABSORBED = 1e-6
"""A component of a push of which the model leaves less than this share of its power is not looked at."""


def with_sharp_edges(bench: Bench, fit: Fit, noise: NoiseFloor, position: int, beat: float = np.inf) -> Fit:
    """A fit with the begin and the end of a push where they fit best, down to a part of a sample.

    The statistic bends at every sample and has minima of its own far from the best window, so there is no
    derivative to follow: all windows are compared first, then those near the best in smaller steps.

    Args:
        bench: the recording.
        fit: a model with a push.
        noise: noise floor.
        position: of the push among the effects.
        beat: statistic that is of interest; what stays far above with any point of the link is left so.

    Returns:
        The fit.
    """
    push = fit.effects[position]
    if not isinstance(push, ExternalForce):
        return fit
    stride = max(bench.data.samples // INSTANTS, 1)
    wide = _with(fit, position, *_best_window(bench, fit, noise, position, stride), bench, noise)
    fit = min(fit, wide, key=lambda each: each.statistic)
    # what pushes all the time but then is nearly the same as what pushes then, for a model takes up a constant force
    start, stop = (getattr(fit.effects[position], name) for name in WHEN)
    both = fit, _with(fit, position, stop, start, bench, noise)
    fit = min(both, key=lambda each: (nearly_always(bench, each.effects[position]), each.statistic))
    if stride > 1:
        # a large push leaves much by edges that are a little off, so a window says little of what it may come to;
        # and where samples were left out near an edge, the best of the windows may be on the wrong side of these
        fit = _sharpened(bench, fit, noise, position, BEYOND * stride, 1.0)
    if fit.statistic > FAR_ABOVE * beat:
        fit = _sharpened(bench, fit, noise, position, 2.0 * COARSE_STEP, COARSE_STEP)
    if fit.statistic > FAR_ABOVE * beat:
        # and a link may be pushed far from its centre of mass
        fit = _moved_point(bench, fit, noise, position, FAR_ABOVE * beat)
        if fit.statistic > FAR_ABOVE * beat:
            return fit
    return _with_point(bench, _finely_sharpened(bench, fit, noise, position), noise, position)


def sharpened(bench: Bench, fit: Fit, noise: NoiseFloor, first: int) -> Fit:
    """A fit with the edges of all pushes from a position on moved a little: what was found since bent them before."""
    for position in range(first, len(fit.effects)):
        if isinstance(fit.effects[position], ExternalForce):
            fit = _with_point(bench, _finely_sharpened(bench, fit, noise, position), noise, position)
    return fit


def at_centre(bench: Bench, fit: Fit, noise: NoiseFloor, position: int) -> Fit:
    """A fit with a push on the centre of mass of its link; the same where it is one."""
    push = fit.effects[position]
    centred = replace(push, **dict.fromkeys(POINT, 0.0))  # type: ignore[arg-type]
    if centred == push:
        return fit
    effects = [centred if k == position else effect for k, effect in enumerate(fit.effects)]
    centre = bench.fit(effects, noise, start=fit.parameters, tangents=False)
    return _finely_sharpened(bench, centre, noise, position)


def stays_on_the_centre(bench: Bench, fit: Fit, position: int) -> bool:
    """Whether an effect is a push on the centre of mass of its link, though another point would make a difference."""
    push = fit.effects[position]
    if not isinstance(push, ExternalForce) or any(getattr(push, name) for name in POINT):
        return False
    beside = replace(push, **dict.fromkeys(POINT, BESIDE))  # type: ignore[arg-type]
    return not np.array_equal(bench.column_spectra(push, fit.effects), bench.column_spectra(beside, fit.effects))


def without_another(bench: Bench, fit: Fit, noise: NoiseFloor, push: ExternalForce, first: int) -> Fit:
    """A fit without a push, where those from a position on that come when it did may meet their links elsewhere.

    Two pushes at once on the centres of mass of two links stand in for one that is a little off that of its own.

    Args:
        bench: the recording.
        fit: without it.
        noise: noise floor.
        push: what was taken out.
        first: position from which on effects were added.
    """
    time = bench.data.motion.time
    for position in range(first, len(fit.effects)):
        other = fit.effects[position]
        if isinstance(other, ExternalForce) and at_once(push.pushes(time), other.pushes(time)):
            fit = min(fit, _moved_point(bench, fit, noise, position), key=lambda each: each.statistic)
    return fit


def at_once(one: NDArray[np.bool_], other: NDArray[np.bool_]) -> bool:
    """Whether two pushes come in mostly the same samples (N,)."""
    return int(np.sum(one & other)) > AT_ONCE * max(int(np.sum(one)), int(np.sum(other)))


def _with_point(bench: Bench, fit: Fit, noise: NoiseFloor, position: int) -> Fit:
    """A fit with the point of a push refined, and its edges once more, for these are held where it was wrong.

    A point that is not worth the price of its coordinates stays the centre of mass: one on a link farther out, near the
    axis of its joint, would do the same as a push on this one.
    """
    centre = at_centre(bench, fit, noise, position)
    for _ in range(POINT_ROUNDS):
        before = fit.statistic
        fit = _moved_point(bench, fit, noise, position)
        if before - fit.statistic < ENOUGH * fit.excess:
            break
        fit = _finely_sharpened(bench, fit, noise, position)
    price = penalty(fit.effects[position], bench) - penalty(centre.effects[position], bench)
    if centre.statistic < fit.statistic + price * fit.unit:
        fit = centre
    return bench.fit(fit.effects, noise, start=fit.parameters)


def _moved_point(bench: Bench, fit: Fit, noise: NoiseFloor, position: int, beat: float = np.inf) -> Fit:
    """A fit with the point of a push where it fits best, from the centre of mass too."""
    effects, push = list(fit.effects), fit.effects[position]
    if not any(getattr(push, name) for name in POINT):
        effects[position] = replace(push, **dict.fromkeys(POINT, BESIDE))  # type: ignore[arg-type]
    return bench.refine(effects, noise, start=fit.parameters, only=position, beat=beat)


def _finely_sharpened(bench: Bench, fit: Fit, noise: NoiseFloor, position: int) -> Fit:
    """A fit with the edges of a push where they fit best, to a small part of a sample."""
    fit = _sharpened(bench, fit, noise, position, 1.0, FINE_STEP)
    return _sharpened(bench, fit, noise, position, FINE_STEP, FINEST_STEP)


def _sharpened(bench: Bench, fit: Fit, noise: NoiseFloor, position: int, reach: float, step: float) -> Fit:
    """A fit with the edges of a push moved by whole steps to where they fit best, within reach or beyond it [samples].

    Every pair of edges is compared with the rest of the model free; only the best is fitted.
    """
    interval = bench.data.period / bench.data.samples
    moves: FloatArray = interval * step * np.arange(-round(reach / step), round(reach / step) + 1.0)
    for _ in range(MOST_MOVES):
        push = fit.effects[position]
        firsts, lasts = (float(getattr(push, name)) + moves for name in WHEN)
        start, stop, at_an_end = _best_edges(bench, fit, noise, position, firsts, lasts)
        new = _with(fit, position, start, stop, bench, noise)
        if new.statistic >= fit.statistic:
            break
        fit = new
        if not at_an_end:
            break
    return fit


def _with(fit: Fit, position: int, start: float, stop: float, bench: Bench, noise: NoiseFloor) -> Fit:
    effects = list(fit.effects)
    effects[position] = replace(effects[position], start=start, stop=stop, period=bench.data.period)  # type: ignore[call-arg]
    return bench.fit(effects, noise, start=fit.parameters, tangents=False)


def _best_window(bench: Bench, fit: Fit, noise: NoiseFloor, position: int, stride: int) -> tuple[float, float]:
    """Begin and end [s] of the push that would bring the statistic down most, the rest of the model free."""
    samples, period = bench.data.samples, bench.data.period
    # each sample stands for half an interval to either side
    edges = (np.arange(stride, samples + 1.0, stride) - 0.5) * (period / samples)
    others = [e for k, e in enumerate(fit.effects) if k != position]
    without = bench.fit(others, noise, start=fit.parameters)
    rest = _Rest(fit.effects[position], others, without.scale, without.off(without.whitened), without.off)
    instants, columns = _windows(bench, rest, noise, edges, kept=True)
    every = np.arange(len(instants))
    gains = _window_gains(columns, rest.left, every, every)
    i, j = np.unravel_index(int(np.argmax(gains)), gains.shape)
    first, last = float(instants[i]), float(instants[j])
    return float(np.mod(first, period)), float(np.mod(last, period))


def _best_edges(
    bench: Bench, fit: Fit, noise: NoiseFloor, position: int, firsts: FloatArray, lasts: FloatArray
) -> tuple[float, float, bool]:
    """The best of some begins and ends [s] of a push, and whether one of them is the first or the last of its kind."""
    wanted = _gains_with_edges(bench, fit, noise, position, firsts, lasts)
    a, b = np.unravel_index(int(np.argmax(wanted)), wanted.shape)
    at_an_end = a in (0, len(firsts) - 1) or b in (0, len(lasts) - 1)
    period = bench.data.period
    return float(np.mod(firsts[a], period)), float(np.mod(lasts[b], period)), bool(at_an_end)


def edge_stds(bench: Bench, fit: Fit, noise: NoiseFloor, position: int) -> dict[str, float]:
    """Standard deviations of when a push begins and ends, by name [s].

    Half of how far it may be while the fit stays as good but for two standard deviations. Where samples are left out,
    as around a reversal of the only joint that it moves, it may be anywhere in these.

    Args:
        bench: the recording.
        fit: the model.
        noise: noise floor.
        position: of the push among its effects.
    """
    push, sample = fit.effects[position], bench.data.period / bench.data.samples
    moves: FloatArray = sample * FINE_STEP * np.arange(-round(FARTHEST / FINE_STEP), round(FARTHEST / FINE_STEP) + 1.0)
    found = {}
    for k, name in enumerate(WHEN):
        edges = [np.array([float(getattr(push, each))]) for each in WHEN]
        edges[k] = edges[k] + moves
        gains = _gains_with_edges(bench, fit, noise, position, edges[0], edges[1]).ravel()
        good = gains > gains[len(moves) // 2] - TWO_DEVIATIONS * fit.unit
        found[name] = max(0.5 * float(np.max(np.abs(moves[good]))), sample * FINEST_STEP)
    return found


def _gains_with_edges(
    bench: Bench, fit: Fit, noise: NoiseFloor, position: int, firsts: FloatArray, lasts: FloatArray
) -> FloatArray:
    """(a, b) drop of the statistic by a push with each of some begins (a,) and ends (b,) [s]; of none it is -inf.

    Compared beside the rest of the model as it is with the push: without it that may bend far.
    """
    counts = bench.counts(fit.effects)
    own = fit.slice_of(position, counts)
    rest_columns = np.delete(fit.flat[:, : len(fit.values)], np.arange(own.start, own.stop), axis=1)
    basis = span(rest_columns)

    def across(columns: FloatArray) -> FloatArray:
        return off(basis, fit.free.off(columns))

    left = across(fit.whitened + fit.flat[:, own] @ fit.values[own])
    others = [e for k, e in enumerate(fit.effects) if k != position]
    rest = _Rest(fit.effects[position], others, fit.scale, left, across)
    period, half = bench.data.period, 0.5 * bench.data.period / bench.data.samples
    times = [np.mod(each + half, period) - half for each in (firsts, lasts)]
    instants, columns = _windows(bench, rest, noise, np.unique(np.concatenate(times)))
    i, j = (np.argmin(np.abs(instants[:, None] - each), axis=0) for each in times)
    return np.where(i[:, None] == j, -np.inf, _window_gains(columns, rest.left, i, j))


@dataclass(frozen=True, eq=False)
class _Rest:
    """A model without its push.

    Attributes:
        push: the push, whose edges are to be found.
        effects: the model.
        scale: (E,) factor of the residual of each equation.
        left: (M,) whitened residual without the push, across all that is free.
        across: whitened columns (M, k) without what the model could take up of them.
    """

    push: Effect
    effects: list[Effect]
    scale: FloatArray
    left: FloatArray
    across: Callable[[FloatArray], FloatArray]


def _windows(
    bench: Bench, rest: _Rest, noise: NoiseFloor, instants: FloatArray, *, kept: bool = False
) -> tuple[FloatArray, FloatArray]:
    """Instants (T,) [s] and whitened columns (M, T, k) of pushes from the beginning of the period to every one.

    A push during any window is the difference of two of these.

    Args:
        bench: the recording.
        rest: the model without the push.
        noise: noise floor.
        instants: (t,) between half a sample before the first and half a sample before the end of the period, in order
            [s]; the begin and the end of the period are added.
        kept: whether these instants will be asked for again.
    """
    period, samples = bench.data.period, bench.data.samples
    begin = -0.5 * period / samples
    instants = instants[(instants > begin + NEARLY * period) & (instants < begin + (1.0 - NEARLY) * period)]
    instants = np.concatenate([[begin], instants, [begin + period]])
    # within a sample the share of it that is pushed in, and so all that a push does, grows in a straight line
    place = np.round((instants - begin) * (samples / period), 9)
    below, above = np.floor(place), np.ceil(place)
    knots = np.unique(np.concatenate([below, above]))
    # a push of a whole period would be none
    stops = [begin + float(knot) * (period / samples) - NEARLY * period for knot in knots[1:]]
    begun = [replace(rest.push, start=begin, stop=stop, period=period) for stop in stops]  # type: ignore[call-arg]
    touched, spectra = (bench.variant_spectra if kept else bench.spectra_of_variants)(begun, rest.effects)
    harmonics, equations, count, width = spectra.shape
    whole = np.zeros((harmonics, len(rest.scale), count * width), dtype=np.complex128)
    whole[:, touched] = spectra.reshape(harmonics, equations, count * width)
    scaled = np.asarray(whole * rest.scale[:, None], dtype=np.complex128)
    columns = rest.across(whiten(bench.whitener(noise), scaled)).reshape(-1, count, width)
    # nothing pushes before the begin
    columns = np.concatenate([np.zeros((len(columns), 1, width)), columns], axis=1)
    one, other = (columns[:, np.searchsorted(knots, each - 0.5)] for each in (below, above))
    return instants, one + (place - below)[:, None] * (other - one)


def _window_gains(columns: FloatArray, left: FloatArray, begins: IntArray, ends: IntArray) -> FloatArray:
    """(a, b) drop of the statistic by a push from one instant to another, where that is earlier round the end.

    The rest of the model is free.

    Args:
        columns: (M, T, k) of pushes from the beginning of the period to every instant, what the model takes up left
            out.
        left: (M,) whitened residual.
        begins: (a,) which instants a push may begin at.
        ends: (b,) which it may end at.
    """
    size, count, width = columns.shape
    flat = columns.reshape(size, count * width)
    gram = (flat.T @ flat).reshape(count, width, count, width).transpose(0, 2, 1, 3)
    score = (left @ flat).reshape(count, width)
    own = gram[np.arange(count), np.arange(count)]
    # from i to j is C_j - C_i, and where j is earlier the whole period comes on top
    i, j = begins[:, None], ends[None, :]
    normal = own[j] + own[i] - _both(gram[i, j])
    along = score[j] - score[i]
    round_the_end = j < i
    wrapped = normal + gram[-1, -1] + _both(gram[j, -1] - gram[i, -1])
    normal = np.where(round_the_end[:, :, None, None], wrapped, normal)
    along = np.where(round_the_end[:, :, None], along + score[-1], along)
    power = np.sqrt(np.maximum(np.einsum("ijkk->ijk", normal), 0.0))
    visible = power > np.sqrt(ABSORBED) * np.max(power)
    scale = np.where(visible, power, 1.0)
    seen = visible[..., :, None] & visible[..., None, :]
    normal = np.where(seen, normal / (scale[..., :, None] * scale[..., None, :]), 0.0)
    along = np.where(visible, along / scale, 0.0)
    values = np.einsum("ijkl,ijl->ijk", np.linalg.pinv(normal, rcond=ABSORBED, hermitian=True), along)
    return np.asarray(np.einsum("ijk,ijk->ij", values, along))


def _both(blocks: FloatArray) -> FloatArray:
    """Blocks and their transposes together."""
    return blocks + blocks.transpose(0, 1, 3, 2)
