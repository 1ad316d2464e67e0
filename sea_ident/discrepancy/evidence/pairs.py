"""Two effects that a recording does not tell apart, and how well a motion would."""

from dataclasses import dataclass, replace

import numpy as np

from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.contribution import contribution
from sea_ident.discrepancy.bench.fit import Fit
from sea_ident.discrepancy.bench.free_shapes import free_shapes, is_signal
from sea_ident.discrepancy.bench.linear import solve, whiten
from sea_ident.discrepancy.bench.physics import physical
from sea_ident.discrepancy.measured.noise import NoiseFloor
from sea_ident.discrepancy.result.findings import Alternative
from sea_ident.discrepancy.search.search import Selection


@dataclass(frozen=True, eq=False)
class Pair:
    """Two effects that explain a recording equally well.

    Attributes:
        own: the model with the one that was named.
        own_position: of it among the effects.
        rival: the model with the other.
        rival_position: of it among the effects.
    """

    own: Fit
    own_position: int
    rival: Fit
    rival_position: int

    @property
    def names(self) -> tuple[str, str]:
        """Both, as `name at joint`."""
        return self.own.effects[self.own_position].title, self.rival.effects[self.rival_position].title


def ambiguous_pairs(selection: Selection, alternatives: dict[int, tuple[Alternative, ...]]) -> list[Pair]:
    """The named effect that is the hardest to tell, with all its alternatives, the most similar first."""
    found = [(a.cos2, position, a.fit) for position, own in alternatives.items() for a in own if a.fit is not None]
    found.sort(key=lambda each: -each[0])
    return [Pair(selection.final.fit, k, fit, k) for _, k, fit in found if k == found[0][1]]


def hardest(bench: Bench, noise: NoiseFloor, pair: Pair) -> Pair:
    """The pair with each effect in the form that other motions tell least, of those that are the same on this one.

    Args:
        bench: the recording.
        noise: its noise floor.
        pair: the pair as it was found.

    Returns:
        The pair itself where there are no such forms.
    """
    own = _hardest(bench, noise, pair.own, pair.own_position)
    rival = _hardest(bench, noise, pair.rival, pair.rival_position)
    return pair if own is pair.own and rival is pair.rival else replace(pair, own=own, rival=rival)


def _hardest(bench: Bench, noise: NoiseFloor, fit: Fit, position: int) -> Fit:
    """The model with the last form of an effect that is as possible as the one that it has."""
    before, after = fit.effects[:position], fit.effects[position + 1 :]
    for other in reversed(fit.effects[position].same_here(bench.state(fit.effects))):
        found = bench.fit((*before, other, *after), noise, start=fit.parameters)
        if physical(bench, found, position):
            return found
    return fit


def separation(bench: Bench, noise: NoiseFloor, pair: Pair) -> float:
    """Energy of one effect that the model with the other leaves, in units of the noise; the smaller of both ways."""
    one = _left(bench, noise, pair.own, pair.own_position, pair.rival)
    other = _left(bench, noise, pair.rival, pair.rival_position, pair.own)
    return min(one, other)


def _left(bench: Bench, noise: NoiseFloor, truth: Fit, position: int, against: Fit) -> float:
    """Energy of an effect of one model outside all that another can follow."""
    whitener, free = bench.whitener(noise), bench.freed(noise)
    directions = bench.design(against.effects)
    shapes = free_shapes(against.effects)
    if shapes:
        bent, _ = bench.tangents(against.effects, against.columns, against.values, shapes)
        directions = np.concatenate([directions, bent], axis=2)
    flat = free.off(whiten(whitener, directions))
    basis = solve(flat, np.zeros(len(flat)))[1]
    if is_signal(truth.effects[position]):
        others = [e for k, e in enumerate(truth.effects) if k != position]
        with_it, without = (bench.predicted(effects, truth.parameters) for effects in (truth.effects, others))
        torque = without.residual - with_it.residual
    else:
        torque = contribution(bench, truth, [position])
    signal = free.off(whiten(whitener, torque))
    signal = signal - basis @ (basis.T @ signal)
    return float(signal @ signal)
