"""Effects that were added, replaced by better ones now that the others are there."""

from collections.abc import Collection
from dataclasses import dataclass, field

from sea_ident.discrepancy.bench import Bench
from sea_ident.discrepancy.candidates import scan, sought
from sea_ident.discrepancy.columns import Key, effect_key
from sea_ident.discrepancy.free_shapes import is_signal
from sea_ident.discrepancy.judge import penalty, physical, slowest, too_short
from sea_ident.discrepancy.refit import of_every_kind, refitted
from sea_ident.discrepancy.settle import Settled, settle_again

RIGHT = 1.2
"""Statistic over degrees of freedom up to which no other effect is tried in the place of one that was added."""

LEAST_OF_A_SIGNAL = 0.02
"""Share of what it is to explain that a first step must promise of an effect in the chain of signals: it says little of
one that is not small, but not nothing."""

CHALLENGERS = 3
"""Candidates that are tried in the place of an effect that was added, and the best of every kind beside them."""

OUTDONE = 0.5
"""One that explains less than this share of what the effect does is not tried in its place again [-], ..."""

PROMISES_MORE = 0.1
"""... unless it promises more of that than it did, by this share of it [-], ..."""

MAKES_UP = 3.0
"""... nor one that fell short by more than this many times what was explained since [-]."""


@dataclass(frozen=True)
class Outdone:
    """An effect that was tried in the place of another and did not take it.

    Attributes:
        promised: share of what the other explains that it promised to explain [-].
        explained: share that it did, nothing where it cannot be [-].
        short: statistic that it left beyond that of the other.
        left: statistic that the other left.
    """

    promised: float
    explained: float
    short: float
    left: float

    def again(self, promised: float, left: float) -> bool:
        """Whether it is worth another try by what it promises now [-], and by the statistic that the other leaves."""
        if promised > self.promised + PROMISES_MORE:
            return True
        return self.explained > OUTDONE and not 0.0 <= MAKES_UP * (self.left - left) < self.short


@dataclass(frozen=True)
class Tried:
    """What was tried in the place of effects that were added; it grows as more is.

    Attributes:
        outdone: what did not take the place, by the effect and what was tried.
        looked: statistic that was left, and what of it the effect explained, when all others were last held against it.
    """

    outdone: dict[tuple[Key, Key], Outdone] = field(default_factory=dict)
    looked: dict[Key, tuple[float, float]] = field(default_factory=dict)

    def nothing_new(self, own: Key, left: float) -> bool:
        """Whether too little was explained since for any other effect to be worth a try in the place of one."""
        if own not in self.looked:
            return False
        before, explained = self.looked[own]
        if not 0.0 <= before - left < PROMISES_MORE * explained:
            return False
        return not any(last.again(last.promised, left) for (of, _), last in self.outdone.items() if of == own)


def exchange(bench: Bench, now: Settled, added: int, tried: Tried, ruled_out: Collection[Key] = ()) -> Settled:
    """Replace effects that were added by better ones, now that the others are there and the noise floor is right.

    Args:
        bench: the recording.
        now: the model with what was added.
        added: number of effects added.
        tried: what did not take the place of another before; what does not now is noted.
        ruled_out: effects that are not tried.

    Returns:
        The model with the better ones.
    """
    first = len(now.fit.effects) - added
    for position in range(first, first + added):
        fit, noise = now.fit, now.noise
        if fit.statistic < RIGHT * fit.dof and not slowest(fit.effects[position]):
            continue
        own = effect_key(fit.effects[position])
        if tried.nothing_new(own, fit.statistic):
            continue
        others = [e for k, e in enumerate(fit.effects) if k != position]
        reduced = bench.fit(others, noise, start=fit.parameters)
        explained = max(reduced.statistic - fit.statistic, 1e-300)
        tried.looked[own] = fit.statistic, explained
        best, scanned = fit, scan(bench, reduced, noise, instead_of=sought(reduced, fit, noise))
        rivals = [c for c in scanned if c.key != own and c.key not in ruled_out]
        for candidate in of_every_kind(rivals, CHALLENGERS, fit.effects[position].joint):
            promised = candidate.gain / explained
            last = tried.outdone.get((own, candidate.key))
            if promised < (LEAST_OF_A_SIGNAL if is_signal(candidate.effect) else 0.5):
                continue
            if last is not None and not last.again(promised, fit.statistic):
                continue
            better = best.statistic + fit.unit * (penalty(best.effects[position], bench) - 1.0)
            beat = better - fit.unit * penalty(candidate.effect, bench)
            new = refitted(bench, others[:position], candidate.effect, others[position:], noise, fit.parameters, beat)
            slack = len(bench.slack_links(new)) > len(bench.slack_links(fit))
            possible = not slack and physical(bench, new, position) and not too_short(bench, new.effects[position])
            gain = reduced.statistic - new.statistic if possible else 0.0
            tried.outdone[own, candidate.key] = Outdone(promised, gain / explained, explained - gain, fit.statistic)
            if possible and new.statistic + fit.unit * penalty(new.effects[position], bench) < better:
                best = new
        if best is not fit:
            now = settle_again(bench, best)
    return now
