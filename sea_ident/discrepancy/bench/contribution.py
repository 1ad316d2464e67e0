"""Torque of single effects of a fit, also on another motion than the one that it was fitted to."""

from collections.abc import Sequence

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.fit import Fit, Known
from sea_ident.discrepancy.measured.data import waveform
from sea_ident.discrepancy.measured.noise import ComplexArray
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


def torque_factor(bench: Bench, fit: Fit, positions: Sequence[int], wider: FloatArray | None = None) -> ComplexArray:
    """(H + 1, E, r) factor of the covariance of the torque of some effects on the motion of a bench, perhaps another.

    From that of their parameters and shapes; larger in proportion where the model leaves more than noise.

    Args:
        bench: the motion.
        fit: the model.
        positions: of the effects in it.
        wider: (p + s,) by how much standard deviations of parameters and shapes are larger than by noise alone [-].
    """
    count, begins = len(fit.columns), np.cumsum([0, *bench.counts(fit.effects)])
    directions, rows = [], list[int]()
    for position in positions:
        if begins[position] < begins[position + 1]:
            directions.append(bench.column_spectra(fit.effects[position], fit.effects))
            rows.extend(range(begins[position], begins[position + 1]))
    own = [(k, pair) for k, pair in enumerate(fit.free_shapes) if pair[0] in positions]
    if own:
        directions.append(bench.tangents(fit.effects, fit.columns, fit.values, [pair for _, pair in own])[0])
        rows.extend(count + k for k, _ in own)
    if not directions:
        return np.zeros((bench.data.harmonics + 1, len(bench.data.equations), 0), dtype=np.complex128)
    # no more columns than there are parameters and shapes
    factor = fit.covariance_factor[rows] * (1.0 if wider is None else wider[rows, None])
    least = np.linalg.qr(factor.T)[1].T
    return np.asarray(np.sqrt(fit.unit) * (np.concatenate(directions, axis=2) @ least), dtype=np.complex128)


def torque_std(bench: Bench, fit: Fit, position: int) -> FloatArray:
    """(N, E) standard deviation of the torque of an effect over a period."""
    rows = waveform(torque_factor(bench, fit, [position]), bench.data.samples)
    return np.asarray(np.linalg.norm(rows, axis=2), dtype=np.float64)
