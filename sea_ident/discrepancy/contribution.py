"""Torque of single effects of a fit, also on another motion than the one that it was fitted to."""

from collections.abc import Sequence

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.bench import Bench
from sea_ident.discrepancy.data import waveform
from sea_ident.discrepancy.fit import Fit, Known
from sea_ident.discrepancy.noise import ComplexArray
from sea_ident.effects import Side
from sea_ident.effects.signal import SignalEffect


def contribution(bench: Bench, fit: Fit, positions: Sequence[int]) -> ComplexArray:
    """(H + 1, E) torque of some effects of a fit on the motion of a bench, which may be another one."""
    total = np.zeros((bench.data.harmonics + 1, len(bench.data.equations)), dtype=np.complex128)
    for position in positions:
        effect = fit.effects[position]
        own = np.array([fit.parameters[c.name] for c in effect.columns(bench.robot)])
        if len(own):
            total += bench.column_spectra(effect, fit.effects) @ own
    return total


def as_known(bench: Bench, fit: Fit, positions: Sequence[int]) -> Known:
    """Some effects of a fit as they are, on the motion of a bench: those in a spring carry a part of its stiffness."""
    stiffness = np.zeros(len(bench.data.equations))
    for position in positions:
        effect = fit.effects[position]
        if effect.side is Side.SPRING and not isinstance(effect, SignalEffect):
            own = contribution(bench, fit, [position])[:, :, None]
            stiffness += bench.slopes_of(own, bench.links_of(effect), fit.effects)[:, 0]
    return Known(contribution(bench, fit, positions), stiffness)


def torque_std(bench: Bench, fit: Fit, position: int) -> FloatArray:
    """(N, E) standard deviation of the torque of an effect over a period, from that of its parameters and shapes.

    Larger in proportion where the model leaves more than noise.
    """
    effect, count = fit.effects[position], len(fit.columns)
    start = sum(bench.counts(fit.effects)[:position])
    width = len(effect.columns(bench.robot))
    directions, factors = [], []
    if width:
        directions.append(bench.column_spectra(effect, fit.effects))
        factors.append(fit.covariance_factor[start : start + width])
    own = [(k, pair) for k, pair in enumerate(fit.free_shapes) if pair[0] == position]
    if own:
        directions.append(bench.tangents(fit.effects, fit.columns, fit.values, [pair for _, pair in own])[0])
        factors.append(fit.covariance_factor[[count + k for k, _ in own]])
    if not directions:
        return np.zeros((bench.data.samples, len(bench.data.equations)))
    rows = waveform(np.concatenate(directions, axis=2), bench.data.samples)
    larger = np.sqrt(fit.unit)
    return np.asarray(larger * np.linalg.norm(rows @ np.concatenate(factors), axis=2), dtype=np.float64)
