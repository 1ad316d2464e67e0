"""Which effects are missing: forward selection with a family-wise level, exchange, backward elimination."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.bench import Bench
from sea_ident.discrepancy.breakaway import lets_go_late
from sea_ident.discrepancy.candidates import Candidate, scan
from sea_ident.discrepancy.columns import Key, effect_key
from sea_ident.discrepancy.edges import sharpened
from sea_ident.discrepancy.exchange import Outdone, Tried, exchange
from sea_ident.discrepancy.fit import Fit
from sea_ident.discrepancy.free_shapes import is_signal
from sea_ident.discrepancy.judge import (
    at_a_bound,
    bends_another,
    flat_steps,
    is_of_a_law,
    own_torque,
    penalty,
    physical,
    scatter_p,
    significance,
    too_short,
    torque_change,
    torque_changes,
)
from sea_ident.discrepancy.kinks import with_their_kinks
from sea_ident.discrepancy.lack import LACK_LEVEL, lack_of_fit, remainder_share
from sea_ident.discrepancy.powers import with_their_powers
from sea_ident.discrepancy.refit import of_every_kind, refitted
from sea_ident.discrepancy.settle import Settled, settle, settle_again
from sea_ident.effects import Effect
from sea_ident.effects.external_force import ExternalForce

FAMILY_LEVEL = 1e-3
"""Probability of accepting anything where nothing is missing."""

MOST_EFFECTS = 6
"""Largest number of effects that are added."""

USEFUL_SHARE = 0.2
"""Share of the excess that an effect must explain to be accepted, ..."""

MANY = 4
"""... and from so many effects on that are there before it ..."""

USEFUL_BESIDE_MANY = 0.5
"""... this share: a few more that are really there explain the rest, what the library does not have is never done."""

USEFUL_AGAIN = 0.4
"""Another of a kind that was added at the same joint must explain this share: orders of a ripple that are really there
explain the rest, a form that is not that of a ripple is a sum of many."""

SMALLEST_SHARE = 1e-3
"""An effect must change the torque of one of its equations by this share of the rms, or it does not matter."""

BESIDE_ANOTHER = 0.12
"""And by this share of what another effect does to the same equation: the form of that one is known no better, ..."""

COMPLETE = 0.9
"""... unless it explains this share of the excess: what another effect in the wrong form leaves is none of its own."""

LARGE_TORQUE = 0.3
"""An effect of more than this share of the torque (rms) must be visible as such, ..."""

CANCELLED = 0.02
"""... with more than this share of it not taken up by other parameters."""

SCATTER_LEVEL = 1e-5
"""Probability that an effect must not exceed by the scatter of the periods along its own columns."""

PUSHES_BACK = 0.2
"""Share of a large push by which the torque must change without it: else it only cancels another [-]."""

BEYOND_FORM = 2.0
"""Times the torque that is left without a name by which a push must exceed it: forms that are not those of the library
leave something at certain times of a period too, and a push fits there [-]."""

MOST_SETTLINGS = 3
"""Rounds in which effects that depend on the model, and the noise floor, follow an effect that was added."""

FINALISTS = 4
"""Candidates that are refitted with everything free before one is accepted, and the best of every kind too, ..."""

MOST_FINALISTS = 7
"""... and up to so many where they promise about as much as the best of them."""

LAST_TWO = 2
"""Of these the best are compared with the shapes of the model refined too."""

LITTLE_LEFT = 0.02
"""An effect that leaves less than this share of the excess is compared only with what promises more than it, ..."""

AS_MUCH = 0.95
"""... or about as much as it did, this share at least: a push on the link before it does nearly the same, ..."""

NEARLY_RIGHT = 3.0
"""... once one leaves less than this statistic over degrees of freedom."""

HOPELESS = 100.0
"""Statistic over degrees of freedom beyond which no further effect is looked for, ..."""

SLOW = 0.4
"""... where the second or a later one left more than this share of the excess: the library does not have it."""


@dataclass(frozen=True, eq=False)
class Selection:
    """Outcome of a search.

    Attributes:
        start: the model without anything added, refitted.
        final: the model with the effects added.
        added: number of effects added, the last ones of `final.fit.effects`.
        p_values: of each added effect, corrected for all that was tried.
        candidates: scan around the final model.
        tests: number of shapes of all candidates.
        whole: the same before what was no longer needed was taken out.
    """

    start: "Settled"
    final: "Settled"
    added: int
    p_values: tuple[float, ...]
    candidates: tuple[Candidate, ...] = ()
    tests: int = 1
    whole: "Selection | None" = None

    @property
    def effects(self) -> tuple[Effect, ...]:
        """The effects added."""
        effects = self.final.fit.effects
        return effects[len(effects) - self.added :] if self.added else ()


def search(
    bench: Bench,
    effects: Sequence[Effect],
    begun: Selection | None = None,
    ruled_out: Collection[Key] = (),
    start: Settled | None = None,
) -> Selection:
    """Find the effects that a model lacks.

    Args:
        bench: the recording.
        effects: the model.
        begun: what was found with other samples left out, or before what drifts was known, to go on from; nothing by
            default.
        ruled_out: effects that are not looked for: other data spoke against them.
        start: the model, settled on this bench, where that was done already.

    Returns:
        The model before and after, with what was added.
    """
    start = settle(bench, effects) if start is None else start
    now, added = start, list[float]()
    largest = np.zeros(len(bench.data.equations))
    tried: Tried = {}
    if begun is not None and begun.added:
        now, added = settle_again(bench, begun.final.fit), list(begun.p_values)
        now = _improved(bench, now, len(added), tried, ruled_out)
        largest = _largest_changes(bench, now.fit, len(added))
    while True:
        candidates = [c for c in scan(bench, now.fit, now.noise) if c.key not in ruled_out]
        tests = max(sum(c.tests for c in candidates), 1)
        if len(added) >= MOST_EFFECTS:
            break
        step = next_effect(bench, now, candidates, tests, np.maximum(SMALLEST_SHARE, BESIDE_ANOTHER * largest), tried)
        if step is None:
            break
        new, p_value = step
        largest = np.maximum(largest, visible_changes(bench, now.fit, new))
        added.append(p_value)
        last = now
        now = _improved(bench, _settled(bench, settle_again(bench, new)), len(added), tried, ruled_out)
        lost = len(added) > 1 and now.fit.statistic > HOPELESS * now.fit.dof
        if lost and now.fit.excess > SLOW * last.fit.excess:
            break
        if not all(physical(bench, now.fit, -k) for k in range(1, len(added) + 1)):
            added.pop()
            now = last
            break
    whole = Selection(start, now, len(added), tuple(added), tuple(candidates), tests)
    now, added = _eliminate(bench, now, added, tests)
    return replace(whole, final=now, added=len(added), p_values=tuple(added), whole=whole)


def _improved(bench: Bench, now: Settled, added: int, tried: Tried, ruled_out: Collection[Key]) -> Settled:
    """A model whose effects have the form that they need by now, and gave way to better ones.

    What is tried in the place of a push has sharp edges, and so must the push; what took the place of another effect
    may move them.
    """
    now = _formed(bench, now)
    exchanged = exchange(bench, now, added, tried, ruled_out)
    return now if exchanged is now else _formed(bench, _settled(bench, exchanged))


def _formed(bench: Bench, now: Settled) -> Settled:
    """Pushes with their edges and springs with their kinks where they belong, saturation by the power that it needs."""
    first = len(bench.effects)
    sharp = sharpened(bench, now.fit, now.noise, first)
    now = with_their_kinks(bench, now if sharp is now.fit else settle_again(bench, sharp), first)
    return with_their_powers(bench, now, first)


def _settled(bench: Bench, now: Settled) -> Settled:
    """A model with its noise floor and what depends on its parameters, followed until they stand still."""
    for _ in range(MOST_SETTLINGS):
        before = now.fit.statistic / now.fit.dof
        now = settle_again(bench, now.fit)
        if now.fit.statistic / now.fit.dof > 0.98 * before:
            break
    return now


def _largest_changes(bench: Bench, fit: Fit, added: int) -> FloatArray:
    """(E,) the largest of `visible_changes` by any of the last effects of a fit, each by itself [-]."""
    largest = np.zeros(len(bench.data.equations))
    for position in range(len(fit.effects) - added, len(fit.effects)):
        others = [e for k, e in enumerate(fit.effects) if k != position]
        less = bench.predicted(others, fit.parameters)
        largest = np.maximum(largest, torque_changes(bench, less, fit))
    return largest


def next_effect(
    bench: Bench,
    now: Settled,
    candidates: list[Candidate],
    tests: int,
    smallest: FloatArray,
    tried: Tried | None = None,
) -> tuple[Fit, float] | None:
    """The best candidate refitted with everything free and its significance, None where none is worth it.

    Of a candidate at least one equation must change by what is `smallest` (E,) there, as a share of the torque. What is
    outdone by the best is noted among what was `tried`.
    """
    fit, noise = now.fit, now.noise
    worth = [
        c for c in candidates if c.gain > 0.0 and significance(c.gain, c.columns, tests, fit, noise) < 10 * FAMILY_LEVEL
    ]
    accepted: list[tuple[Fit, float]] = []
    steps, useful = (flat_steps(bench, now), least_useful(bench, now)) if worth else (np.zeros((0, 0)), 0.0)
    most, promised, explained = 0.0, 0.0, False
    again = {effect_key(effect) for effect in fit.effects[len(bench.effects) :]}
    refits: list[tuple[Candidate, float]] = []
    as_good = sum(c.gain > AS_MUCH * worth[0].gain for c in worth[:MOST_FINALISTS])
    for candidate in of_every_kind(worth, max(FINALISTS, as_good), worth[0].effect.joint if worth else None):
        if most > (1.0 - LITTLE_LEFT) * fit.excess and candidate.gain < min(most, AS_MUCH * promised) and explained:
            continue
        leaders = sorted(new.statistic for new, _ in accepted)[:LAST_TWO]
        least = max(useful, USEFUL_AGAIN * fit.excess) if candidate.key in again else useful
        # one that explains too little, or less than those that are compared in the end, need not be known exactly
        beat = min([fit.statistic - least, *leaders[LAST_TWO - 1 :]])
        new = refitted(bench, fit.effects, candidate.effect, (), noise, fit.parameters, beat)
        gain = fit.statistic - new.statistic
        p_value = significance(gain, candidate.columns, tests, fit, noise)
        refits.append((candidate, gain if physical(bench, new, -1) else 0.0))
        if p_value > FAMILY_LEVEL or gain < least or not _acceptable(bench, fit, new, steps, smallest):
            continue
        accepted.append((new, p_value))
        if gain > most:
            most, promised = gain, candidate.gain
        explained = explained or new.statistic < NEARLY_RIGHT * new.dof
    if not accepted:
        return None
    # what is left by the best is left by lack of other effects as well, and small differences are a matter of these
    unit = min((new for new, _ in accepted), key=lambda new: new.statistic).unit
    accepted.sort(key=lambda item: item[0].statistic + unit * penalty(item[0].effects[-1], bench))

    def score(new: Fit) -> float:
        whole = bench.refine(new.effects, noise, start=new.parameters) if len(accepted) > 1 else new
        return whole.statistic + unit * penalty(new.effects[-1], bench)

    best, best_p = min(accepted[:LAST_TWO], key=lambda item: score(item[0]))
    own, whole_gain = effect_key(best.effects[-1]), fit.statistic - best.statistic
    if tried is not None:
        for candidate, gain in refits:
            tried[own, candidate.key] = Outdone(candidate.gain / whole_gain, gain / whole_gain)
    return best, best_p


def least_useful(bench: Bench, now: Settled) -> float:
    """Drop of the statistic that one effect more must bring.

    Beside many, less is enough where it explains more than one of these does: that one was only found before it.
    """
    fit = now.fit
    usual, positions = USEFUL_SHARE * fit.excess, range(len(bench.effects), len(fit.effects))
    if len(positions) < MANY:
        return usual
    least = USEFUL_BESIDE_MANY * fit.excess
    for position in positions:
        others = [e for k, e in enumerate(fit.effects) if k != position]
        without = bench.fit(others, now.noise, start=fit.parameters, tangents=False)
        least = min(least, without.statistic - fit.statistic)
    return max(usual, least)


def _acceptable(bench: Bench, fit: Fit, new: Fit, steps: FloatArray, smallest: FloatArray) -> bool:
    """Whether the last effect of a new fit is large enough, could be, and is neither hidden nor a matter of one pass.

    Args:
        bench: the recording.
        fit: without the effect.
        new: with it.
        steps: (S, M) whitened steps between periods without it.
        smallest: (E,) change of the torque that matters, as a share of it [-].
    """
    effect = new.effects[-1]
    if (
        not physical(bench, new, -1)
        or len(bench.slack_links(new)) > len(bench.slack_links(fit))
        or at_a_bound(effect)
        or too_short(bench, effect)
    ):
        return False
    own = own_torque(bench, new, -1)
    cancels = is_signal(effect) or is_of_a_law(effect)  # an error of a sensor is taken up, and so is a term of a law
    if own > LARGE_TORQUE and not cancels and torque_change(bench, fit, new) < CANCELLED * own:
        return False
    if fit.statistic - new.statistic > COMPLETE * fit.excess:
        smallest = np.minimum(smallest, SMALLEST_SHARE)
    if np.all(visible_changes(bench, fit, new) < smallest):
        return False
    if scatter_p(steps, fit.whitened - new.whitened) <= SCATTER_LEVEL:
        return True
    # what differs from pass to pass because each is let go at another instant may be stiction all the same
    return lets_go_late(bench, fit, effect)


def visible_changes(bench: Bench, before: Fit, after: Fit) -> FloatArray:
    """(E,) change by the last effect of a fit in every equation, as a share of the torque there [-].

    Where the model bent to do without it, the change is larger than the effect and says nothing of its size.
    """
    return np.minimum(torque_changes(bench, before, after), 2.0 * own_torque(bench, after, -1))


def still_needed(bench: Bench, selection: Selection) -> Selection:
    """What is left of what was found before more was known of the recording."""
    now = settle_again(bench, selection.final.fit)
    now, p_values = _eliminate(bench, now, list(selection.p_values), selection.tests, fewest=0)
    return replace(selection, final=now, added=len(p_values), p_values=tuple(p_values))


def _eliminate(
    bench: Bench, now: Settled, added: list[float], tests: int, fewest: int = 1
) -> tuple[Settled, list[float]]:
    """Take out effects that are no longer needed, one after the other, down to the fewest."""
    added = list(added)
    while len(added) > fewest:
        fit, noise = now.fit, now.noise
        nameless = remainder_share(bench, now) if lack_of_fit(bench, now)[2] < LACK_LEVEL else 0.0
        first = len(fit.effects) - len(added)
        scores = []
        for position in range(first, len(fit.effects)):
            others = [e for k, e in enumerate(fit.effects) if k != position]
            without = bench.refine(others, noise, start=fit.parameters, only=len(bench.effects))
            loss = without.statistic - fit.statistic
            columns = max(len(fit.effects[position].columns(bench.robot)), 1)
            visible, own = torque_change(bench, fit, without), own_torque(bench, fit, position)
            needed = visible >= SMALLEST_SHARE
            if isinstance(fit.effects[position], ExternalForce):
                needed = needed and own > BEYOND_FORM * nameless
                # a push comes and goes: nothing but another push can cancel it
                needed = needed and (own < LARGE_TORQUE or visible > PUSHES_BACK * own)
            needed = needed and not bends_another(bench, fit, position)
            p_value = significance(loss, columns, tests, without, noise) if needed else 1.0
            scores.append((p_value, position, without))
        worst = max(scores, key=lambda s: (s[0], -s[2].statistic))
        if worst[0] <= FAMILY_LEVEL:
            break
        now = settle_again(bench, worst[2])
        del added[worst[1] - first]
    return now, added


def without(bench: Bench, selection: Selection, weak: Sequence[int]) -> Selection:
    """What was found without some of it, the rest fitted anew.

    Args:
        bench: the recording.
        selection: what was found.
        weak: positions among the effects that were added.

    Returns:
        The selection that is left.
    """
    fit = selection.final.fit
    first = len(fit.effects) - selection.added
    kept = [e for k, e in enumerate(fit.effects) if k - first not in weak]
    now = settle_again(bench, bench.refine(kept, selection.final.noise, start=fit.parameters, only=len(bench.effects)))
    return replace(
        selection,
        final=settle_again(bench, now.fit),
        added=selection.added - len(weak),
        p_values=tuple(p for k, p in enumerate(selection.p_values) if k not in weak),
        candidates=tuple(scan(bench, now.fit, now.noise)),
    )
