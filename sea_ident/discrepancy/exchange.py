"""Effects that were added, replaced by better ones now that the others are there."""

from collections.abc import Collection
from dataclasses import dataclass
from typing import TypeAlias

from sea_ident.discrepancy.bench import Bench
from sea_ident.discrepancy.candidates import scan, sought
from sea_ident.discrepancy.columns import Key, effect_key
from sea_ident.discrepancy.fit import Solution
from sea_ident.discrepancy.free_shapes import is_signal
from sea_ident.discrepancy.judge import at_a_bound, comes_first, is_push, penalty, slowest, too_short
from sea_ident.discrepancy.physics import physical
from sea_ident.discrepancy.refit import of_every_kind, refitted
from sea_ident.discrepancy.settle import Settled, settle_again
from sea_ident.side_by_side import side_by_side

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
"""... unless it promises more of that than it did, by this share of it [-]."""


@dataclass(frozen=True)
class Outdone:
    """An effect that was tried in the place of another and did not take it.

    Attributes:
        promised: share of what the other explains that it promised to explain [-].
        explained: share that it did, nothing where it cannot be [-].
    """

    promised: float
    explained: float

    def again(self, promised: float) -> bool:
        """Whether it is worth another try by what it promises now [-]."""
        return promised > self.promised + PROMISES_MORE or self.explained > OUTDONE


Tried: TypeAlias = dict[tuple[Key, Key], Outdone]
"""What did not take the place of an effect that was added, by the effect and what was tried; it grows as more is."""


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
    position, last = len(now.fit.effects) - added, len(now.fit.effects)
    while position < last:
        challenge = _Challenge(bench, now, dict(tried), ruled_out)
        for challenged in side_by_side(challenge, range(position, last)):
            position += 1
            tried.update(challenged.tried)
            if challenged.better is not None:
                # what comes after it is to be held against what there is now
                now = settle_again(bench, bench.again(challenged.better, now.noise))
                break
    return now


@dataclass(frozen=True, eq=False)
class _Challenged:
    """What came of trying others in the place of an effect.

    Attributes:
        better: the model with the best of them, None where none is better.
        tried: what did not take its place.
    """

    better: Solution | None
    tried: Tried


@dataclass(frozen=True, eq=False)
class _Challenge:
    """Tries others in the place of an effect that was added.

    Attributes:
        bench: the recording.
        now: the model.
        tried: what did not take the place of another before.
        ruled_out: effects that are not tried.
    """

    bench: Bench
    now: Settled
    tried: Tried
    ruled_out: Collection[Key]

    def __call__(self, position: int) -> _Challenged:
        """Try others in the place of the effect at a position."""
        bench, fit, noise = self.bench, self.now.fit, self.now.noise
        tried: Tried = {}
        if fit.statistic < RIGHT * fit.dof and not slowest(fit.effects[position]):
            return _Challenged(None, tried)
        own = effect_key(fit.effects[position])
        others = [e for k, e in enumerate(fit.effects) if k != position]
        reduced = bench.fit(others, noise, start=fit.parameters)
        explained = max(reduced.statistic - fit.statistic, 1e-300)
        lawless = is_push(fit.effects[position])
        best, scanned = fit, scan(bench, reduced, noise, instead_of=sought(reduced, fit, noise))
        rivals = [c for c in scanned if c.key != own and c.key not in self.ruled_out]
        for candidate in of_every_kind(rivals, CHALLENGERS, fit.effects[position].joint):
            promised = candidate.gain / explained
            last = self.tried.get((own, candidate.key))
            if promised < (LEAST_OF_A_SIGNAL if is_signal(candidate.effect) else 0.5):
                continue
            if last is not None and not last.again(promised):
                continue
            better = best.statistic + fit.unit * (penalty(best.effects[position], bench) - 1.0)
            beat = better - fit.unit * penalty(candidate.effect, bench)
            new = refitted(bench, others[:position], candidate.effect, others[position:], noise, fit.parameters, beat)
            ended, slack = new.effects[position], len(bench.slack_links(new)) > len(bench.slack_links(fit))
            ends = at_a_bound(ended) or slowest(ended) or too_short(bench, ended)
            possible = not (slack or ends) and physical(bench, new, position)
            gain = reduced.statistic - new.statistic if possible else 0.0
            tried[own, candidate.key] = Outdone(promised, gain / explained)
            if is_push(candidate.effect) and not lawless:
                possible = comes_first(gain, explained, reduced)
            if possible and new.statistic + fit.unit * penalty(new.effects[position], bench) < better:
                best = new
        return _Challenged(None if best is fit else best.solution, tried)
