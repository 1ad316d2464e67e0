"""Effects that a search or a test of trends found, with the numbers that are told of them."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.bench import Bench
from sea_ident.discrepancy.findings import Alternative, MissingEffect, MissingParameter
from sea_ident.discrepancy.fit import Fit
from sea_ident.discrepancy.heldout import HeldOut
from sea_ident.discrepancy.judge import own_torque
from sea_ident.discrepancy.noise import ComplexArray
from sea_ident.discrepancy.powers import with_open_powers
from sea_ident.discrepancy.resting import resting
from sea_ident.discrepancy.search import Selection
from sea_ident.discrepancy.trend import Trend
from sea_ident.discrepancy.uncertainty import uncertainties
from sea_ident.effects import Effect, Shape, Side
from sea_ident.effects.memory import MemoryEffect
from sea_ident.estimation.spring_untold import told_by_rest, untold
from sea_ident.estimation.springs import spring_columns


def named_effects(
    bench: Bench,
    selection: Selection,
    alternatives: dict[int, tuple[Alternative, ...]],
    held: HeldOut | None,
) -> list[MissingEffect]:
    """What was added by a search, with the numbers that are told of it.

    Args:
        bench: the recording.
        selection: what was found.
        alternatives: what else it may be, by the position among the effects.
        held: how it did on data that was not used.
    """
    fit, open_ = selection.final.fit, with_open_powers(bench, selection.final)
    stds, free = uncertainties(bench, open_), open_.fit.free_shapes
    first = len(fit.effects) - selection.added
    out = []
    nameless = resting(selection, held)
    for k, position in enumerate(range(first, len(fit.effects))):
        if k in nameless:
            continue
        transfer = held.transfers[k] if held is not None and held.transfers else None
        others = alternatives.get(position, ())
        found = named_effect(bench, fit, position, stds, selection.p_values[k], others, free)
        out.append(replace(found, transfer=None if transfer is None or not transfer.tested else transfer.share))
    return out


def named_effect(
    bench: Bench,
    fit: Fit,
    position: int,
    stds: FloatArray,
    p_value: float,
    alternatives: Sequence[Alternative],
    free: Sequence[tuple[int, Shape]] | None = None,
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
    parameters.extend(_shape_parameters(bench, effect, stds_of, at_rest))
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
    bench: Bench, effect: Effect, stds: Mapping[str, tuple[float, Shape]], at_rest: bool
) -> list[MissingParameter]:
    """The shapes of an effect; what is at rest all the time does not show where it would not be."""
    out = []
    for shape in effect.ranges:
        value = float(getattr(effect, shape.name))
        std = 0.0
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
