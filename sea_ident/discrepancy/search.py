"""Which effects are missing: forward selection with a family-wise level, exchange, backward elimination."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.bench import Bench
from sea_ident.discrepancy.candidates import Candidate, effect_key, scan
from sea_ident.discrepancy.described import from_described_springs
from sea_ident.discrepancy.edges import with_sharp_edges
from sea_ident.discrepancy.fit import Fit
from sea_ident.discrepancy.free_shapes import is_signal
from sea_ident.discrepancy.judge import (
    at_a_bound,
    flat_periods,
    own_torque,
    penalty,
    physical,
    scatter_p,
    significance,
    slowest,
    too_short,
    torque_change,
    torque_changes,
)
from sea_ident.discrepancy.noise import NoiseFloor
from sea_ident.discrepancy.settle import Settled, settle, settle_again
from sea_ident.effects import Effect, Shape
from sea_ident.effects.external_force import ExternalForce
from sea_ident.effects.signal import SignalEffect
from sea_ident.effects.spring import SpringEffect

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

MOST_SETTLINGS = 3
"""Rounds in which effects that depend on the model, and the noise floor, follow an effect that was added."""

FINALISTS = 4
"""Candidates that are refitted with everything free before one is accepted, and the best of every kind beside them."""

LAST_TWO = 2
"""Of these the best are compared with the shapes of the model refined too."""

LITTLE_LEFT = 0.02
"""An effect that leaves less than this share of the excess is compared only with what promises more than it, ..."""

NEARLY_RIGHT = 3.0
"""... once one leaves less than this statistic over degrees of freedom."""

RIGHT = 1.2
"""Statistic over degrees of freedom up to which no other effect is tried in the place of one that was added."""

HOPELESS = 100.0
"""Statistic over degrees of freedom beyond which no further effect is looked for, ..."""

SLOW = 0.4
"""... where the second or a later one left more than this share of the excess: the library does not have it."""

LEAST_OF_A_SIGNAL = 0.02
"""Share of what it is to explain that a first step must promise of an effect in the chain of signals: it says little of
one that is not small, but not nothing."""

LARGE_AMOUNT = 0.1
"""Share of its range from which on an estimate of an amount is beyond the reach of its tangent [-]: it is begun ..."""

SMALLER = 0.1
"""... with this part of it too [-]."""

CHALLENGERS = 3
"""Candidates that are tried in the place of an effect that was added, and the best of every kind beside them."""


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
    """

    start: "Settled"
    final: "Settled"
    added: int
    p_values: tuple[float, ...]
    candidates: tuple[Candidate, ...] = ()
    tests: int = 1

    @property
    def effects(self) -> tuple[Effect, ...]:
        """The effects added."""
        effects = self.final.fit.effects
        return effects[len(effects) - self.added :] if self.added else ()


def search(bench: Bench, effects: Sequence[Effect]) -> Selection:
    """Find the effects that a model lacks.

    Args:
        bench: the recording.
        effects: the model.

    Returns:
        The model before and after, with what was added.
    """
    start = settle(bench, effects)
    now = start
    added: list[float] = []
    largest = np.zeros(len(bench.data.equations))
    while True:
        candidates = scan(bench, now.fit, now.noise)
        tests = max(sum(c.tests for c in candidates), 1)
        if len(added) >= MOST_EFFECTS:
            break
        step = next_effect(bench, now, candidates, tests, np.maximum(SMALLEST_SHARE, BESIDE_ANOTHER * largest))
        if step is None:
            break
        new, p_value = step
        largest = np.maximum(largest, visible_changes(bench, now.fit, new))
        added.append(p_value)
        last = now
        now = settle_again(bench, new)
        for _ in range(MOST_SETTLINGS):
            before = now.fit.statistic / now.fit.dof
            now = settle_again(bench, now.fit)
            if now.fit.statistic / now.fit.dof > 0.98 * before:
                break
        now = _exchange(bench, now, len(added))
        lost = len(added) > 1 and now.fit.statistic > HOPELESS * now.fit.dof
        if lost and now.fit.excess > SLOW * last.fit.excess:
            break
        if not all(physical(bench, now.fit, -k) for k in range(1, len(added) + 1)):
            added.pop()
            now = last
            break
    now, added = _eliminate(bench, now, added, tests)
    return Selection(start, now, len(added), tuple(added), tuple(candidates), tests)


def next_effect(
    bench: Bench, now: Settled, candidates: list[Candidate], tests: int, smallest: FloatArray
) -> tuple[Fit, float] | None:
    """The best candidate refitted with everything free and its significance, None where none is worth it.

    Of a candidate at least one equation must change by what is `smallest` (E,) there, as a share of the torque.
    """
    fit, noise = now.fit, now.noise
    worth = [
        c for c in candidates if c.gain > 0.0 and significance(c.gain, c.columns, tests, fit, noise) < 10 * FAMILY_LEVEL
    ]
    accepted: list[tuple[float, Fit, float]] = []
    periods = flat_periods(bench, now) if worth else np.zeros((0, 0))
    most, explained = 0.0, False
    for candidate in of_every_kind(worth, FINALISTS, worth[0].effect.joint if worth else None):
        if most > (1.0 - LITTLE_LEFT) * fit.excess and candidate.gain < most and explained:
            continue
        new = refitted(bench, fit.effects, candidate.effect, (), noise, fit.parameters)
        gain = fit.statistic - new.statistic
        p_value = significance(gain, candidate.columns, tests, fit, noise)
        if p_value > FAMILY_LEVEL or not _acceptable(bench, fit, new, periods, smallest):
            continue
        accepted.append((new.statistic + penalty(candidate.effect, bench), new, p_value))
        most, explained = max(most, gain), explained or new.statistic < NEARLY_RIGHT * new.dof
    if not accepted:
        return None
    accepted.sort(key=lambda item: item[0])
    best: tuple[float, Fit, float] | None = None
    for _, new, p_value in accepted[:LAST_TWO]:
        whole = bench.refine(new.effects, noise, start=new.parameters) if len(accepted) > 1 else new
        score = whole.statistic + penalty(new.effects[-1], bench)
        if best is None or score < best[0]:
            best = (score, new, p_value)
    return None if best is None else (best[1], best[2])


def _acceptable(bench: Bench, fit: Fit, new: Fit, periods: FloatArray, smallest: FloatArray) -> bool:
    """Whether the last effect of a new fit explains enough, could be, and is neither hidden nor a matter of one pass.

    Args:
        bench: the recording.
        fit: without the effect.
        new: with it.
        periods: (P, M) whitened residuals of the periods without it.
        smallest: (E,) change of the torque that matters, as a share of it [-].
    """
    effect = new.effects[-1]
    useful = USEFUL_SHARE if len(fit.effects) - len(bench.effects) < MANY else USEFUL_BESIDE_MANY
    if fit.statistic - new.statistic < useful * fit.excess or not physical(bench, new, -1):
        return False
    if len(bench.slack_links(new)) > len(bench.slack_links(fit)) or at_a_bound(effect) or too_short(bench, effect):
        return False
    own = own_torque(bench, new, -1)
    if own > LARGE_TORQUE and not is_signal(effect) and torque_change(bench, fit, new) < CANCELLED * own:
        return False
    if fit.statistic - new.statistic > COMPLETE * fit.excess:
        smallest = np.minimum(smallest, SMALLEST_SHARE)
    if np.all(visible_changes(bench, fit, new) < smallest):
        return False
    return scatter_p(periods, fit.whitened - new.whitened) <= SCATTER_LEVEL


def visible_changes(bench: Bench, before: Fit, after: Fit) -> FloatArray:
    """(E,) change by the last effect of a fit in every equation, as a share of the torque there [-].

    Where the model bent to do without it, the change is larger than the effect and says nothing of its size.
    """
    return np.minimum(torque_changes(bench, before, after), 2.0 * own_torque(bench, after, -1))


def refitted(
    bench: Bench,
    before: Sequence[Effect],
    effect: Effect,
    after: Sequence[Effect],
    noise: NoiseFloor,
    start: Mapping[str, float],
) -> Fit:
    """A model with one effect more, its shapes refined from the best of several beginnings."""
    begun = [effect]
    if isinstance(effect, SignalEffect) and effect.beginnings:
        first = effect.amounts[0].name
        begun.extend(replace(effect, **{first: value}) for value in effect.beginnings)  # type: ignore[arg-type]
    if isinstance(effect, SignalEffect) and any(_share(effect, a) > LARGE_AMOUNT for a in effect.amounts):
        smaller = {a.name: SMALLER * float(getattr(effect, a.name)) for a in effect.amounts}
        begun.append(replace(effect, **smaller))  # type: ignore[arg-type]
    fits = [bench.refine((*before, e, *after), noise, start=start, only=len(bench.effects)) for e in begun]
    best = min(fits, key=lambda fit: (len(bench.slack_links(fit)), fit.statistic))
    if isinstance(effect, SignalEffect):
        best = from_described_springs(bench, best, len(before), noise, start)
    if isinstance(effect, SpringEffect):
        # the law of the spring was another one as long as the effect was missing
        anchored = list(best.effects)
        anchored[len(before)] = bench.anchored(best.effects, best.parameters)[len(before)]
        if tuple(anchored) != best.effects:
            best = bench.refine(anchored, noise, start=best.parameters, only=len(bench.effects))
    return with_sharp_edges(bench, best, noise, len(before))


def _share(effect: SignalEffect, amount: Shape) -> float:
    """Part of its range that an amount takes [-]."""
    return abs(float(getattr(effect, amount.name))) / max(amount.upper - amount.lower, 1e-300)


def of_every_kind(candidates: Sequence[Candidate], count: int, joint: str | None = None) -> list[Candidate]:
    """The first candidates, the first of every side of the model that is not among them, and the signals of a joint.

    A first step along a tangent flatters what has many shapes, and says little about an effect in the chain of signals
    whose amount is not small.
    """
    chosen = list(candidates[:count])
    kinds = {kind_of(c.effect) for c in chosen}
    for candidate in candidates[count:]:
        if kind_of(candidate.effect) not in kinds:
            chosen.append(candidate)
            kinds.add(kind_of(candidate.effect))
        elif joint is not None and candidate.effect.joint == joint and is_signal(candidate.effect):
            chosen.append(candidate)
    return chosen


def kind_of(effect: Effect) -> str:
    """What an effect acts on: a side of the model, or which part of the chain of signals."""
    return effect.name if is_signal(effect) else str(effect.side)


def _exchange(bench: Bench, now: Settled, added: int) -> Settled:
    """Replace effects that were added by better ones, now that the others are there and the noise floor is right."""
    first = len(now.fit.effects) - added
    for position in range(first, first + added):
        fit, noise = now.fit, now.noise
        if fit.statistic < RIGHT * fit.dof and not slowest(fit.effects[position]):
            continue
        others = [e for k, e in enumerate(fit.effects) if k != position]
        reduced = bench.fit(others, noise, start=fit.parameters)
        own = effect_key(fit.effects[position])
        best = fit
        rivals = [c for c in scan(bench, reduced, noise) if c.key != own]
        for candidate in of_every_kind(rivals, CHALLENGERS, fit.effects[position].joint):
            promised = LEAST_OF_A_SIGNAL if is_signal(candidate.effect) else 0.5
            if candidate.gain < promised * (reduced.statistic - fit.statistic):
                continue
            new = refitted(bench, others[:position], candidate.effect, others[position:], noise, fit.parameters)
            better = best.statistic + penalty(best.effects[position], bench)
            slack = len(bench.slack_links(new)) > len(bench.slack_links(fit))
            if slack or not physical(bench, new, position) or too_short(bench, new.effects[position]):
                continue
            if new.statistic + penalty(candidate.effect, bench) < better - 1.0:
                best = new
        if best is not fit:
            now = settle_again(bench, best)
    return now


def _eliminate(bench: Bench, now: Settled, added: list[float], tests: int) -> tuple[Settled, list[float]]:
    """Take out effects that are no longer needed."""
    added = list(added)
    while len(added) > 1:
        fit, noise = now.fit, now.noise
        first = len(fit.effects) - len(added)
        scores = []
        for position in range(first, len(fit.effects)):
            others = [e for k, e in enumerate(fit.effects) if k != position]
            without = bench.refine(others, noise, start=fit.parameters, only=len(bench.effects))
            loss = without.statistic - fit.statistic
            columns = max(len(fit.effects[position].columns(bench.robot)), 1)
            visible, own = torque_change(bench, fit, without), own_torque(bench, fit, position)
            needed = visible >= SMALLEST_SHARE
            if isinstance(fit.effects[position], ExternalForce) and own > LARGE_TORQUE:
                # a push comes and goes: nothing but another push can cancel it
                needed = needed and visible > PUSHES_BACK * own
            p_value = significance(loss, columns, tests, without, noise) if needed else 1.0
            scores.append((p_value, position, without))
        worst = max(scores, key=lambda s: s[0])
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
