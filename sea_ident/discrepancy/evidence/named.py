"""Effects that a search or a test of trends found, with the numbers that are told of them."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.fit import Fit
from sea_ident.discrepancy.bench.judge import own_torque
from sea_ident.discrepancy.bench.settle import Settled
from sea_ident.discrepancy.compared.heldout import HeldOut
from sea_ident.discrepancy.compared.resting import resting
from sea_ident.discrepancy.evidence.uncertainty import uncertainties
from sea_ident.discrepancy.evidence.unseen import beside_others
from sea_ident.discrepancy.measured.noise import ComplexArray
from sea_ident.discrepancy.result.findings import Alternative, MissingEffect, MissingParameter, Unseen
from sea_ident.discrepancy.search.edges import edge_stds
from sea_ident.discrepancy.search.powers import with_open_powers
from sea_ident.discrepancy.search.search import Selection
from sea_ident.discrepancy.trends.trend import Trend
from sea_ident.discrepancy.trends.trend_directions import steady_rows
from sea_ident.effects import Effect, Shape, Side
from sea_ident.effects.drift import TrendEffect
from sea_ident.effects.external_force import ExternalForce
from sea_ident.effects.memory import MemoryEffect
from sea_ident.estimation.spring_untold import told_by_rest, untold
from sea_ident.estimation.springs import spring_columns

WIDER = 5.0
"""Factor by which a standard deviation must be larger beside another effect for that to be told [-]."""


def named_effects(
    bench: Bench,
    selection: Selection,
    alternatives: dict[int, tuple[Alternative, ...]],
    held: HeldOut | None,
    trends: Sequence[Trend] = (),
) -> list[MissingEffect]:
    """What was added by a search, with the numbers that are told of it.

    Args:
        bench: the recording.
        selection: what was found.
        alternatives: what else it may be, by the position among the effects.
        held: how it did on data that was not used.
        trends: of the periods.
    """
    fit, open_ = selection.final.fit, with_open_powers(bench, selection.final)
    plain, free = uncertainties(bench, open_), open_.fit.free_shapes
    other_models = [_shift(open_.fit, alternative) for alike in alternatives.values() for alternative in alike]
    other_models.extend(_shift_by_the_mean(bench, open_, trend) for trend in trends)
    beside = {joint: tuple(beside_others(bench, open_, joint)) for joint in _joints(selection)}
    first = len(fit.effects) - selection.added
    out = []
    nameless = resting(selection, held)
    for k, position in enumerate(range(first, len(fit.effects))):
        if k in nameless:
            continue
        transfer = held.transfers[k] if held is not None and held.transfers else None
        others = alternatives.get(position, ())
        there = beside.get(fit.effects[position].joint or "", ())
        # what it may be instead is told by its name, and is not beside it
        instead = {(other.effect, other.joint) for other in others}
        besides = [each for each in there if (each.effect.name, each.effect.joint) not in instead]
        shifts = [*other_models, *(each.shift for each in besides if each.better)]
        stds = np.max([plain, *(np.hypot(plain, shift) for shift in shifts)], axis=0)
        pushes = isinstance(fit.effects[position], ExternalForce)
        edges = edge_stds(bench, fit, selection.final.noise, position) if pushes else {}
        found = named_effect(bench, fit, position, stds, selection.p_values[k], others, free, edges)
        wider = [
            (each.effect, named_effect(bench, fit, position, np.hypot(stds, each.stds), 1.0, (), free).parameters)
            for each in there
            if np.any(each.stds > WIDER * stds)
        ]
        found = replace(found, unseen=known_least_with(found.parameters, wider))
        out.append(replace(found, transfer=None if transfer is None or not transfer.tested else transfer.share))
    return out


def _shift(fit: Fit, alternative: Alternative) -> FloatArray:
    """(p + s,) by how much parameters are others in the model with what an effect may be as well in its place."""
    shift = np.zeros(len(fit.columns) + len(fit.free_shapes))
    if alternative.fit is None or not alternative.as_likely:
        return shift
    there = alternative.fit.parameters
    shift[: len(fit.columns)] = [there.get(name, value) - value for name, value in fit.parameters.items()]
    return shift


def _shift_by_the_mean(bench: Bench, now: Settled, trend: Trend) -> FloatArray:
    """(p + s,) by how much parameters are others where the mean of a trend, which nothing takes up, is beside them.

    A torque constant that drifts was as described before it did, or is so in the mean: nobody can tell.
    """
    fit, effect = now.fit, trend.effect
    if not isinstance(effect, TrendEffect) or effect.mean_is_free:
        return np.zeros(len(fit.columns) + len(fit.free_shapes))
    middle = bench.data.starts + 0.5 * bench.data.period
    mean = float(np.mean(effect.change(middle, None)))
    torque = mean * (bench.spectra_of(steady_rows(bench, fit, effect), fit.effects) @ trend.values)
    known = bench.whitening(now.noise).flat(torque * fit.scale)
    return np.asarray(fit.step_factor @ (fit.basis.T @ known), dtype=np.float64)


def _joints(selection: Selection) -> set[str]:
    """Joints at which effects were added."""
    return {effect.joint for effect in selection.effects if effect.joint is not None}


def known_least_with(
    parameters: Sequence[MissingParameter], wider: Sequence[tuple[Effect, Sequence[MissingParameter]]]
) -> Unseen | None:
    """What makes the parameters of an effect known least if it is there too; None where nothing makes much of that.

    Args:
        parameters: of the effect.
        wider: the same with the standard deviations that they have beside other effects.
    """
    found: tuple[float, Unseen] | None = None
    for other, beside in wider:
        pairs = [(p, p.std / own.std) for own, p in zip(parameters, beside, strict=True) if own.std > 0.0]
        most = max((ratio for _, ratio in pairs), default=0.0)
        if most > WIDER and (found is None or most > found[0]):
            affected = tuple(p for p, ratio in pairs if ratio > WIDER)
            found = most, Unseen(other.name, other.joint, affected)
    return None if found is None else found[1]


def named_effect(
    bench: Bench,
    fit: Fit,
    position: int,
    stds: FloatArray,
    p_value: float,
    alternatives: Sequence[Alternative],
    free: Sequence[tuple[int, Shape]] | None = None,
    edges: Mapping[str, float] | None = None,
) -> MissingEffect:
    """An effect that was found, with the numbers that are told of it.

    Args:
        bench: the recording.
        fit: the model with it.
        position: of it among the effects.
        stds: (p + s,) standard deviations of the parameters, and of the shapes that are free.
        p_value: probability of finding as much where nothing is missing.
        alternatives: what else it may be.
        free: (s,) shapes that are free; those of the fit by default.
        edges: standard deviations of when a push begins and ends, by name [s].
    """
    effect, counts = fit.effects[position], bench.counts(fit.effects)
    own = range(sum(counts[:position]), sum(counts[: position + 1]))
    spectra = bench.column_spectra(effect, fit.effects)
    seen = np.any(spectra, axis=(0, 1))  # of a column of zeros nothing is known
    values, unseen = _as_seen(effect, spectra, fit.values[own.start : own.stop])
    by_rest = _told_by_rest(bench, fit, effect, values)
    parameters = [
        MissingParameter(
            fit.columns[i].name, float(value), float(np.linalg.norm([stds[i], *more])), fit.columns[i].unit
        )
        for i, value, *more, shown in zip(own, values, by_rest, unseen, seen, strict=True)
        if shown
    ]
    at_rest = bool(len(values)) and bool(np.all(by_rest > 0.0))
    own_free = [(len(fit.columns) + k, s) for k, (owner, s) in enumerate(free or fit.free_shapes) if owner == position]
    stds_of = {shape.name: (float(stds[place]), shape) for place, shape in own_free}
    parameters.extend(_shape_parameters(bench, effect, stds_of, edges or {}, at_rest))
    return MissingEffect(
        effect=effect.name,
        joint=effect.joint,
        parameters=tuple(parameters),
        torque_share=own_torque(bench, fit, position),
        p_value=p_value,
        alternatives=tuple(replace(each, fit=None) for each in alternatives),
        detail=effect,
        values=tuple(map(float, values)),
    )


def _as_seen(effect: Effect, spectra: ComplexArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The smallest values (k,) that do the same, and by how much they may be off for what columns have in common.

    A force along the axis of the only joint that it could move is not seen, nor is its share in each component told.

    Args:
        effect: the effect.
        spectra: (H, E, k) its columns.
        values: (k,) of them.
    """
    flat = np.concatenate(spectra)
    norms = np.linalg.norm(flat, axis=0)
    shown = norms > 0.0
    if not np.any(shown):  # errors of sensors have no columns
        return values, np.zeros(len(values))
    unit = flat[:, shown] / norms[shown]
    alike = untold(str(effect.joint), np.real(unit.conj().T @ unit), [effect.name] * unit.shape[1])
    nothing = alike / norms[shown, None]
    least, unseen = values.copy(), np.zeros(len(values))
    if nothing.size:
        along = np.linalg.qr(nothing)[0]
        least[shown] -= along @ (along.T @ values[shown])
        unseen[shown] = np.linalg.norm(along, axis=1) * np.linalg.norm(least[shown])
    return least, unseen


def _told_by_rest(bench: Bench, fit: Fit, effect: Effect, values: FloatArray) -> FloatArray:
    """(k,) by how much values (k,) of an effect may be off where only its rest tells it from the law of its spring."""
    if effect.side is not Side.SPRING or not isinstance(effect, MemoryEffect):
        return np.zeros(len(values))
    columns = spring_columns(bench.state(fit.effects).motion, bench.robot.index(effect.required_joint), 0.0, (effect,))
    off = told_by_rest(columns, np.concatenate([np.zeros(3), values]))
    return np.asarray(np.linalg.norm(off[3:], axis=1), dtype=np.float64)


def _shape_parameters(
    bench: Bench,
    effect: Effect,
    stds: Mapping[str, tuple[float, Shape]],
    edges: Mapping[str, float],
    at_rest: bool,
) -> list[MissingParameter]:
    """The shapes of an effect; what is at rest all the time does not show where it would not be."""
    out = []
    for shape in effect.ranges:
        value = float(getattr(effect, shape.name))
        std = edges.get(shape.name, 0.0)
        if shape.name in stds:
            step, free = stds[shape.name]
            std = step * abs(value) if free.logarithmic else step * (free.upper - free.lower)
            std = float(np.hypot(std, value)) if at_rest else std
        out.append(
            MissingParameter(effect.parameter_name(shape.name), value, std, effect.shape_unit(shape, bench.robot))
        )
    return out


def named_trend(bench: Bench, trend: Trend) -> MissingEffect:
    """What changes over a recording, with the numbers that are told of it."""
    effect = trend.effect
    parameters = [
        MissingParameter(c.name, float(v), float(s), c.unit)
        for c, v, s in zip(effect.columns(bench.robot), trend.values, trend.stds, strict=True)
    ]
    parameters.extend(
        MissingParameter(
            effect.parameter_name(s.name),
            float(getattr(effect, s.name)),
            trend.time_constant_std if s.name == "time_constant" else 0.0,
            s.unit,
        )
        for s in effect.shapes
    )
    others = tuple(Alternative(e.name, e.joint, share) for e, share in trend.alternatives)
    return MissingEffect(
        effect=effect.name,
        joint=effect.joint,
        parameters=tuple(parameters),
        torque_share=trend.torque_change,
        p_value=trend.p_value,
        alternatives=others,
        detail=effect,
        values=tuple(float(v) for v in trend.values),
    )
