"""Effects that were added, replaced by better ones now that the others are there."""

from collections.abc import Collection, Generator, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import TypeAlias

from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.columns import Key, effect_key
from sea_ident.discrepancy.bench.fit import Fit, Solution
from sea_ident.discrepancy.bench.free_shapes import is_signal
from sea_ident.discrepancy.bench.judge import at_a_bound, comes_first, is_push, penalty, slowest, too_short
from sea_ident.discrepancy.bench.physics import physical
from sea_ident.discrepancy.bench.settle import Settled, settle_again
from sea_ident.discrepancy.measured.noise import NoiseFloor
from sea_ident.discrepancy.search.candidates import scan, sought
from sea_ident.discrepancy.search.refit import AT_ONCE, of_every_kind, refitted
from sea_ident.effects import Effect
from sea_ident.effects.load import LoadEffect
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
        position, better = _first_better(bench, now, range(position, last), tried, ruled_out)
        if better is not None:
            # what comes after it is to be held against what there is now
            now = settle_again(bench, bench.again(better, now.noise))
    return now


def _first_better(
    bench: Bench, now: Settled, positions: range, tried: Tried, ruled_out: Collection[Key]
) -> tuple[int, Solution | None]:
    """The place after the first in which another effect is better, and the best model with another there.

    The outcome is the same whether there are cores for two at a time or not.
    """
    matches = _matches(bench, now, positions, tried, ruled_out)
    position, better = positions.start, None
    price = _price(bench, now.fit, position)
    while pair := list(islice(matches, AT_ONCE)):
        prices = [price if m.position == position else _price(bench, now.fit, m.position) for m in pair]
        outcomes = side_by_side(_Trial(bench, now), list(zip(pair, prices, strict=True)))
        for match, own in zip(pair, prices, strict=True):
            if match.position != position:
                if better is not None:
                    break
                position, price = match.position, own
            outcome = next(outcomes)
            tried[match.own, match.key] = Outdone(match.promised, outcome.gain / match.explained)
            if outcome.possible and outcome.price < price - now.fit.unit:
                price, better = outcome.price, outcome.solution
        outcomes.close()
        if better is not None and pair[-1].position != position:
            break
    return (positions.stop, None) if better is None else (position + 1, better)


@dataclass(frozen=True, eq=False)
class _Match:
    """An effect that was added, and another one that is tried in its place.

    Attributes:
        position: of the one that was added.
        own: what it is.
        key: what the other one is.
        effect: the other one.
        promised: share of what the one explains that the other promises to explain [-].
        explained: drop of the statistic by the one.
        reduced: the model without either.
    """

    position: int
    own: Key
    key: Key
    effect: Effect
    promised: float
    explained: float
    reduced: Fit


def _matches(
    bench: Bench, now: Settled, positions: range, tried: Tried, ruled_out: Collection[Key]
) -> Generator[_Match, None, None]:
    """All that is worth trying, place by place."""
    fit, noise = now.fit, now.noise
    for position in positions:
        effect = fit.effects[position]
        if fit.statistic < RIGHT * fit.dof and not slowest(effect):
            continue
        own = effect_key(effect)
        others = [e for k, e in enumerate(fit.effects) if k != position]
        reduced = bench.fit(others, noise, start=fit.parameters)
        explained = max(reduced.statistic - fit.statistic, 1e-300)
        scanned = scan(bench, reduced, noise, instead_of=sought(reduced, fit, noise))
        rivals = [c for c in scanned if c.key != own and c.key not in ruled_out]
        for candidate in of_every_kind(rivals, CHALLENGERS, effect.joint):
            promised = candidate.gain / explained
            last = tried.get((own, candidate.key))
            if promised < (LEAST_OF_A_SIGNAL if is_signal(candidate.effect) else 0.5):
                continue
            if last is None or last.again(promised):
                yield _Match(position, own, candidate.key, candidate.effect, promised, explained, reduced)


def _price(bench: Bench, fit: Fit, position: int) -> float:
    """Statistic of a model and the price of the parameters of one of its effects."""
    return fit.statistic + fit.unit * penalty(fit.effects[position], bench)


@dataclass(frozen=True, eq=False)
class _Outcome:
    """What came of an effect that was tried in the place of another.

    Attributes:
        solution: the model with it.
        gain: drop of the statistic by it, nothing where it cannot be.
        price: statistic and the price of its parameters.
        possible: whether it may take the place.
    """

    solution: Solution
    gain: float
    price: float
    possible: bool


@dataclass(frozen=True, eq=False)
class _Trial:
    """Tries an effect in the place of another.

    Attributes:
        bench: the recording.
        now: the model.
    """

    bench: Bench
    now: Settled

    def __call__(self, tried: tuple[_Match, float]) -> _Outcome:
        """Refit the model with another effect, which is of interest below a price."""
        (match, price), bench, fit, noise = tried, self.bench, self.now.fit, self.now.noise
        position, reduced = match.position, match.reduced
        before, after = reduced.effects[:position], reduced.effects[position:]
        beat = price - fit.unit * (1.0 + penalty(match.effect, bench))
        new = refitted(bench, before, match.effect, after, noise, fit.parameters, beat)
        if _carries(match.effect, (*before, *after)):
            new = _anchored_anew(bench, new, noise, beat)
        ended, slack = new.effects[position], len(bench.slack_links(new)) > len(bench.slack_links(fit))
        ends = at_a_bound(ended) or slowest(ended) or too_short(bench, ended)
        possible = not (slack or ends) and physical(bench, new, position)
        gain = reduced.statistic - new.statistic if possible else 0.0
        if is_push(match.effect) and not is_push(fit.effects[position]):
            possible = comes_first(gain, match.explained, reduced)
        # in the unit of the model that it is compared with
        return _Outcome(new.solution, gain, new.statistic + fit.unit * penalty(ended, bench), possible)


def _carries(effect: Effect, others: Sequence[Effect]) -> bool:
    """Whether what depends on a load is at the joint of an effect: it was found with the torque of another one."""
    return any(isinstance(other, LoadEffect) and other.joint == effect.joint for other in others)


def _anchored_anew(bench: Bench, fit: Fit, noise: NoiseFloor, beat: float) -> Fit:
    """A model whose effects know the load that it has by now; as it is where it is better with what they knew."""
    effects = bench.anchored(fit.effects, fit.parameters)
    new = bench.refine(effects, noise, start=fit.parameters, only=len(bench.effects), beat=beat)
    return new if new.statistic < fit.statistic else fit
