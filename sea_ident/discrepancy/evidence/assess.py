"""What else an effect could be, and what could not have been seen."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from scipy import stats
from scipy.optimize import brentq

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.columns import effect_key
from sea_ident.discrepancy.bench.fit import Fit, Solution
from sea_ident.discrepancy.bench.judge import (
    EQUALLY_GOOD,
    FEWEST_TO_SEARCH,
    SMALLEST_SHARE,
    flat_steps,
    never_closed,
    penalty,
    slowest,
    spread,
    too_short,
)
from sea_ident.discrepancy.bench.linear import off, span, whiten
from sea_ident.discrepancy.bench.physics import physical
from sea_ident.discrepancy.bench.settle import Settled
from sea_ident.discrepancy.measured.noise import ComplexArray, NoiseFloor, closed_freedom, unstacked
from sea_ident.discrepancy.measured.standing import LIVE_BESIDE_REVERSALS
from sea_ident.discrepancy.result.findings import Alternative, Detectability
from sea_ident.discrepancy.search.candidates import ABSORBED, Candidate, scan
from sea_ident.discrepancy.search.next_effect import FAMILY_LEVEL, LITTLE_LEFT, NEARLY_RIGHT, SCATTER_LEVEL
from sea_ident.discrepancy.search.powers import with_its_power
from sea_ident.discrepancy.search.refit import of_every_kind, refitted
from sea_ident.discrepancy.search.search import Selection
from sea_ident.effects import Effect
from sea_ident.effects.signal import SignalEffect
from sea_ident.side_by_side import side_by_side
from sea_ident.singular_values import svd

THE_SAME = 0.05
"""Two effects between whose statistics there is less than this are one and the same on this motion."""

EXACTLY = 1e-6
"""Share of a column outside of the span of others up to which it is one of them but for rounding [-]."""

LOOKS_ALIKE = 0.9
"""Share of one effect in the span of another from which on they are called confusable."""

RIVALS = 8
"""Candidates that are tried in the place of an effect, and the best of every kind beside them."""

NO_BETTER = 0.5
"""Where an effect explains nearly all and has not the form of what is there, one that leaves no more than this share
more is no worse [-]."""

DETECTED = 0.95
"""Share of the cases in which an effect of the smallest size is found."""

TAKEN_UP = 0.1
"""Share of what an effect explains with the shapes of the others held that these leave it where they are free [-]."""

POWER_QUANTILE = 1.645
"""Standard deviations that make that share."""


def rivals(bench: Bench, selection: Selection) -> dict[int, tuple[Alternative, ...]]:
    """Effects that do as well in the place of each effect that was added, by its position in the model.

    Those that do so by more parameters come last.
    """
    now = selection.final
    positions = range(len(now.fit.effects) - selection.added, len(now.fit.effects))
    return {position: _alike(bench, now, position) for position in positions}


def _alike(bench: Bench, now: Settled, position: int) -> tuple[Alternative, ...]:
    """What does as well as the effect at a position, each with its model."""
    fit, noise = now.fit, now.noise
    own = fit.effects[position]
    reduced = _without(bench, now, position)
    gain = reduced.statistic - fit.statistic
    enough = no_worse(fit, gain)
    reach = enough + EQUALLY_GOOD * fit.unit
    alike: list[Alternative] = []
    dearer: list[tuple[Alternative, float]] = []
    scores: list[float] = []
    # wherever they act: of what the model absorbs but for a trace, that may be in the equations of other joints
    scanned = scan(bench, reduced, noise)
    tried = of_every_kind([c for c in scanned if c.key != effect_key(own)], RIVALS)
    tried = [c for c in tried if not c.gain < 0.3 * gain]
    in_place = _InPlace(bench, now, position, enough, reach)
    for candidate, solution in zip(tried, side_by_side(in_place, tried), strict=True):
        if solution is None:
            continue
        new = bench.again(solution, noise)
        price = fit.unit * (penalty(new.effects[position], bench) - penalty(own, bench))
        explained = reduced.whitened - fit.whitened
        share = float((reduced.whitened - new.whitened) @ explained / (explained @ explained))
        other = Alternative(candidate.effect.name, candidate.effect.joint, min(max(share, 0.0), 1.0), fit=new)
        worse = new.statistic - fit.statistic
        # what has a column more that these data do not ask for is the same effect, and no other motion will tell them
        if price > 0.0 and worse + price > 0.0 and _is_part_of(own, new.effects[position], bench, now):
            continue
        # what it saves by fewer parameters makes up for nothing that it explains less
        behind = worse + max(price, 0.0)
        if not worse < enough:
            if behind < reach:
                alike.append(replace(other, behind=behind))
        # a play that is never closed is a constant: nothing but its size is fitted
        elif worse + price < enough or never_closed(bench, new.effects, position):
            alike.append(other)
            scores.append(new.statistic)
        else:
            dearer.append((other, new.statistic))
    # what this motion shows as exactly the same as one of them is as likely, however many parameters it has
    for other, score in dearer:
        alike.append(replace(other, dearer=not any(abs(score - s) < THE_SAME for s in scores)))
    unique = {(other.effect, other.joint): other for other in sorted(alike, key=_rank)}
    return tuple(sorted(unique.values(), key=lambda other: (not other.as_likely, -other.cos2)))


def _without(bench: Bench, now: Settled, position: int) -> Fit:
    """The model without the effect at a position, the shapes of the others held where that tells what it is needed for.

    Where these could take up nearly all that it does, they hide with their shapes held what would do the same: a slip
    that was found beside a play that never closes has the constant of that in it.
    """
    fit, noise = now.fit, now.noise
    others = [e for k, e in enumerate(fit.effects) if k != position]
    reduced = bench.fit(others, noise, start=fit.parameters)
    own = fit.slice_of(position, bench.counts(fit.effects))
    if own.start < own.stop and fit.lost_by(own, fit.values[own]) < TAKEN_UP * (reduced.statistic - fit.statistic):
        return bench.refine(others, noise, start=fit.parameters, only=len(bench.effects))
    return reduced


def _is_part_of(one: Effect, other: Effect, bench: Bench, now: Settled) -> bool:
    """Whether an effect is another whose further columns are zero, as a constant is a spring without stiffness."""
    if isinstance(one, SignalEffect) or isinstance(other, SignalEffect):
        return False
    if len(other.columns(bench.robot)) <= len(one.columns(bench.robot)):
        return False
    whitener, effects = bench.whitener(now.noise), now.fit.effects
    own, whole = (whiten(whitener, bench.column_spectra(e, effects) * now.fit.scale[:, None]) for e in (one, other))
    return bool(np.linalg.norm(off(span(whole), own)) < EXACTLY * np.linalg.norm(own))


def _rank(other: Alternative) -> tuple[bool, float]:
    """The larger, the rather it is kept of several of a kind."""
    return other.as_likely, other.cos2


@dataclass(frozen=True, eq=False)
class _InPlace:
    """Refits candidates in the place of an effect.

    Attributes:
        bench: the recording.
        now: the model with the effect.
        position: of the effect in it.
        enough: difference of the statistic up to which another does as well, ...
        reach: ... and up to which another motion may outweigh it.
    """

    bench: Bench
    now: Settled
    position: int
    enough: float
    reach: float

    def __call__(self, candidate: Candidate) -> Solution | None:
        """The model with a candidate in the place of the effect, None where that does much worse."""
        bench, fit, noise, position = self.bench, self.now.fit, self.now.noise, self.position
        before, after, beat = fit.effects[:position], fit.effects[position + 1 :], fit.statistic + self.reach
        new = refitted(bench, before, candidate.effect, after, noise, fit.parameters, beat)
        if new.statistic > fit.statistic + self.enough:
            new = with_its_power(bench, new, noise, position)
        if slowest(new.effects[position]) or too_short(bench, new.effects[position]):
            return None
        if new.statistic < beat and physical(bench, new, position):
            return new.solution
        return None


def no_worse(fit: Fit, gain: float) -> float:
    """Difference of the statistic up to which another effect does as well as the one of a fit that has this gain."""
    unit = fit.unit
    if unit > NEARLY_RIGHT and fit.excess < LITTLE_LEFT * gain:
        return max(EQUALLY_GOOD * unit, NO_BETTER * fit.excess)
    return EQUALLY_GOOD * unit


def detectability(
    bench: Bench, fit: Fit, noise: NoiseFloor, candidates: Sequence[Candidate], judged: tuple[Bench, Settled]
) -> tuple[Detectability, ...]:
    """Smallest size of every candidate that would have been found, and what it is easily taken for.

    It stands out of the noise floor and of the scatter of the periods along its own column, and matters to the torque:
    that is what a search asks of an effect.

    Args:
        bench: the recording.
        fit: what was found.
        noise: noise floor.
        candidates: around it.
        judged: the recording with all that is compared beside reversals, and the model there: what lives there is as
            large as it would have to be in these samples.

    Returns:
        One entry for every candidate.
    """
    tests = max(sum(c.tests for c in candidates), 1)
    several = bench.data.periods > 1
    beside = flat_steps(*judged) if several else np.zeros((0, 0))
    steps = flat_steps(bench, Settled(fit, noise)) if several else np.zeros((0, 0))
    colours: ComplexArray = np.linalg.inv(bench.whitener(noise)).astype(np.complex128)
    candidates = [c for c in candidates if np.any(c.directions)]
    bases = [_orthonormal(c.directions) for c in candidates]
    labels = [c.effect.title for c in candidates]
    stack = np.concatenate([b for b in bases], axis=1) if bases else np.zeros((len(fit.whitened), 0))
    gram = stack.T @ stack
    starts = np.concatenate([[0], np.cumsum([b.shape[1] for b in bases])]).astype(int)
    # energy of one basis in the span of the other; for single columns this is cos^2, else an upper bound of the largest
    share = np.add.reduceat(np.add.reduceat(gram**2, starts[:-1], axis=0), starts[:-1], axis=1) if len(gram) else gram
    out = []
    for i, candidate in enumerate(candidates):
        strength = np.linalg.norm(candidate.directions, axis=0)
        best = int(np.argmax(strength)) if len(strength) else 0
        smallest = float("inf")
        if len(strength) and strength[best] > 0.0:
            own = candidate.directions[:, best]
            needed = max(_needed(candidate.columns, tests, noise), _out_of_the_scatter(steps, own))
            smallest = max(needed / strength[best], _that_matters(bench, colours, own, candidate.effect.joint))
        absorbed, effect = candidate.absorbed, candidate.effect
        if effect.name in LIVE_BESIDE_REVERSALS:
            effect = _usual(effect)
            smallest, absorbed = _beside_reversals(judged, effect, tests, beside)
        mine = slice(starts[i], starts[i + 1])
        alike = []
        for k in range(len(candidates)):
            if k == i or share[i, k] <= LOOKS_ALIKE:
                continue
            if float(np.linalg.norm(gram[mine, starts[k] : starts[k + 1]], 2)) ** 2 > LOOKS_ALIKE:
                alike.append(labels[k])
        out.append(
            Detectability(
                effect=candidate.effect.name,
                joint=candidate.effect.joint,
                smallest=float(smallest),
                unit=_unit(bench, candidate.effect, best),
                absorbed=float(np.clip(absorbed, 0.0, 1.0)),
                confusable_with=tuple(alike),
                shapes=_shapes(bench, effect),
                title=candidate.effect.title,
            )
        )
    return tuple(sorted(out, key=lambda d: (d.effect, str(d.joint))))


def _needed(columns: int, tests: int, noise: NoiseFloor) -> float:
    """Size of an effect in units of the noise that stands out of it 19 times out of 20."""
    threshold = float(stats.f.isf(FAMILY_LEVEL / tests, columns, max(noise.total_freedom, 4.0)))
    return float(np.sqrt(threshold * columns)) + POWER_QUANTILE


def _out_of_the_scatter(steps: FloatArray, column: FloatArray) -> float:
    """Size of an effect that stands out of the scatter of the periods along its whitened column (M,) as often.

    That is more than the noise floor says, one for all phases of a period, where noise gathers where the effect does,
    and of few periods the scatter is not well known itself (power of Student's test, by its noncentral distribution).
    """
    if len(steps) < FEWEST_TO_SEARCH - 1:
        return 0.0
    return _size_for(closed_freedom(len(steps))) * spread(steps, column)


@cache
def _size_for(freedom: float) -> float:
    """Size in standard deviations, known with such a freedom, that is told from the scatter 19 times out of 20."""
    least = float(stats.t.isf(SCATTER_LEVEL / 2.0, freedom))
    return float(brentq(lambda size: stats.nct.sf(least, freedom, size) - DETECTED, least, 3.0 * least))


def _that_matters(bench: Bench, colours: ComplexArray, column: FloatArray, joint: str | None) -> float:
    """Size from which on what the model does not take up of a whitened column (M,) matters to the torque.

    Args:
        bench: the recording.
        colours: (H + 1, E, E) what whitened numbers are to be multiplied by to be torques.
        column: of unit size.
        joint: where the effect acts. What it does to the constants of other joints is there by the correlation of their
            noise alone, which few periods tell badly; None where it acts on all.
    """
    spectra = np.matmul(colours, unstacked(column, colours.shape[1])[:, :, None])[:, :, 0]
    shares = np.sqrt(np.sum(np.abs(spectra) ** 2, axis=0)) / np.maximum(bench.torque_rms, 1e-300)
    own = [joint is None or equation.joint == joint for equation in bench.data.equations]
    return SMALLEST_SHARE / max(float(shares[own].max()), 1e-300)


def _usual(effect: Effect) -> Effect:
    """An effect with the shapes that its kind has where nothing is known of them, at the speeds of the motion."""
    upper = {shape.name: shape.upper for shape in effect.ranges}
    usual = {s.name: getattr(type(effect), s.name) * (upper[s.name] / s.upper) for s in effect.shapes}
    return replace(effect, **usual)


def _beside_reversals(
    judged: tuple[Bench, Settled], effect: Effect, tests: int, steps: FloatArray
) -> tuple[float, float]:
    """Smallest size of an effect that lives beside reversals and would have been found there, and what is absorbed.

    It has to stand out of the scatter of the periods along its own column too, which is more there than the noise
    floor, one for all phases of a period, says.

    Args:
        judged: the recording with all that is compared there, and the model.
        effect: the effect.
        tests: number of shapes of all candidates.
        steps: (S, M) whitened steps between periods.

    Returns:
        The size, and the share of its power that the model absorbs.
    """
    bench, settled = judged
    fit = settled.fit
    column = whiten(bench.whitener(settled.noise), bench.column_spectra(effect, fit.effects) * fit.scale[:, None])
    across = fit.off(bench.freed(settled.noise).off(column))[:, 0]
    strength, power = float(np.linalg.norm(across)), float(np.sum(column**2))
    if not strength**2 > ABSORBED * power:
        return float("inf"), 1.0
    size = max(_needed(1, tests, settled.noise), _out_of_the_scatter(steps, across))
    return size / strength, 1.0 - strength**2 / power


def _shapes(bench: Bench, effect: Effect) -> tuple[tuple[str, float, str], ...]:
    """Name, value and unit of the shapes of an effect."""
    shapes = () if isinstance(effect, SignalEffect) else effect.ranges
    return tuple((s.name, float(getattr(effect, s.name)), effect.shape_unit(s, bench.robot)) for s in shapes)


def _orthonormal(columns: FloatArray) -> FloatArray:
    left, strength, _ = svd(columns)
    kept: FloatArray = left[:, strength > 1e-6 * max(float(strength.max(initial=0.0)), 1e-300)]
    return kept if np.any(strength > 0.0) else kept[:, :0]


def _unit(bench: Bench, effect: Effect, column: int) -> str:
    if isinstance(effect, SignalEffect):
        return effect.shape_unit(effect.amounts[column], bench.robot)
    return effect.columns(bench.robot)[column].unit
