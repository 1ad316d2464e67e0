"""Which effects are missing: forward selection with a family-wise level, exchange, and what is needed of that."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.columns import Key
from sea_ident.discrepancy.bench.fit import Fit
from sea_ident.discrepancy.bench.judge import SMALLEST_SHARE, is_given, significance, too_short, torque_changes
from sea_ident.discrepancy.bench.physics import possible
from sea_ident.discrepancy.bench.settle import (
    Settled,
    anchored_in_itself,
    settle,
    settle_again,
    settled_down,
    settled_in_form,
)
from sea_ident.discrepancy.search.as_described import as_described
from sea_ident.discrepancy.search.candidates import Candidate, scan
from sea_ident.discrepancy.search.common_delays import with_a_common_delay
from sea_ident.discrepancy.search.elimination import Elimination, eliminate
from sea_ident.discrepancy.search.exchange import Tried, exchange
from sea_ident.discrepancy.search.formed import formed
from sea_ident.discrepancy.search.friction_and_constant import both_at_once
from sea_ident.discrepancy.search.next_effect import BESIDE_ANOTHER, next_effect, visible_changes
from sea_ident.discrepancy.search.one_for_two import one_for_two
from sea_ident.discrepancy.search.placements import with_placements
from sea_ident.discrepancy.search.slips import by_the_first_element
from sea_ident.effects import Effect, JointEffect
from sea_ident.side_by_side import side_by_side

MOST_EFFECTS = 6
"""Largest number of effects that are added, beside those that the description gives."""

NOT_ASKED = float("nan")
"""Significance of what is in a model before it is asked for one: that is done beside all that is found."""

WIDER_BEFORE = 3
"""Effects before which it is asked whether signals of all joints are late, or joints elsewhere."""

FAR_FROM_RIGHT = 30.0
"""Statistic over degrees of freedom beyond which others are tried in the place of what was added only when there is
nothing more to add: so much is missing beside it that the best in its place is hardly the right one."""

HOPELESS = 100.0
"""Statistic over degrees of freedom beyond which no further effect is looked for, ..."""

SLOW = 0.4
"""... where the last one left more than this share of the excess, ..."""

FEWEST_LOST = 3
"""... and was the third or a later one: the library does not have it. Of several effects that matter alike each leaves
about half, and what explains the rest does so only beside all of them."""


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
        tried: what did not take the place of an effect, which a search that goes on from here tries only where it
            promises more by then.
    """

    start: "Settled"
    final: "Settled"
    added: int
    p_values: tuple[float, ...]
    candidates: tuple[Candidate, ...] = ()
    tests: int = 1
    whole: "Selection | None" = None
    tried: Tried = field(default_factory=dict)

    @property
    def effects(self) -> tuple[Effect, ...]:
        """The effects added."""
        effects = self.final.fit.effects
        return effects[len(effects) - self.added :] if self.added else ()

    def joints_of(self, kind: type[JointEffect]) -> set[str]:
        """Joints at which an effect of this kind was added."""
        return {effect.required_joint for effect in self.effects if isinstance(effect, kind)}


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
        tried.update(begun.tried)
        now, added = settle_again(bench, begun.final.fit), list(begun.p_values)
        now = _improved(bench, now, len(added), tried, ruled_out)
    elif not ruled_out:
        now, added = _as_described(bench, start)
    largest = _largest_changes(bench, now.fit, len(added))
    waits, before = False, start
    while True:
        candidates = [c for c in scan(bench, now.fit, now.noise) if c.key not in ruled_out]
        tests = max(sum(c.tests for c in candidates), 1)
        if len(added) < WIDER_BEFORE and not ruled_out:
            wider = with_a_common_delay(bench, now, candidates, tests)
            wider = with_placements(bench, now, candidates) if wider is now else wider
            if wider is not now:
                more = len(wider.fit.effects) - len(now.fit.effects)
                wider = _improved(bench, wider, len(added) + more, tried, ruled_out)
                if _possible(bench, wider, len(added) + more):
                    now, before = wider, now
                    added.extend([NOT_ASKED] * more)
                    largest = np.maximum(largest, _largest_changes(bench, now.fit, len(added)))
                    continue
        step = None
        sought = len(added) - _described(bench, now, len(added))
        if sought < MOST_EFFECTS and not _lost(now, before, sought, candidates):
            smallest = np.maximum(SMALLEST_SHARE, BESIDE_ANOTHER * largest)
            step = next_effect(bench, now, candidates, tests, smallest, tried)
            single = None if step is None else step[0]
            # other data spoke against one of both
            both = None if ruled_out else both_at_once(bench, now, candidates, single, tests)
            step = step if both is None else both
        if step is None and waits:
            last, waits = now, False
            now = _improved(bench, now, len(added), tried, ruled_out)
            if now is not last:
                continue
        if step is None:
            break
        new, p_value = step
        largest = np.maximum(largest, visible_changes(bench, now.fit, new))
        more = len(new.effects) - len(now.fit.effects)
        added.extend([p_value] * more)
        before = now
        now = settled_down(bench, settle_again(bench, new))
        waits = now.fit.statistic > FAR_FROM_RIGHT * now.fit.dof and _possible(bench, now, len(added))
        now = formed(bench, now) if waits else _improved(bench, now, len(added), tried, ruled_out)
        if not _possible(bench, now, len(added)):
            del added[-more:]
            now = before
            break
    now, left = one_for_two(bench, now, len(added))
    added = [added[k] for k in left]
    whole = Selection(start, now, len(added), tuple(added), tuple(candidates), tests, tried=tried)
    now, added = eliminate(bench, now, added, tests)
    added = _asked(bench, now, added, tests)
    now = settled_in_form(bench, now, len(now.fit.effects) - len(added), by_the_first_element)
    return replace(whole, final=anchored_in_itself(bench, now), added=len(added), p_values=tuple(added), whole=whole)


def _asked(bench: Bench, now: Settled, added: Sequence[float], tests: int) -> list[float]:
    """Significance of each of the last effects of a model, by what it does there where it was not asked for it yet."""
    fit, noise, out = now.fit, now.noise, list(added)
    for k in np.flatnonzero(np.isnan(added)):
        position = len(fit.effects) - len(added) + int(k)
        others = [e for i, e in enumerate(fit.effects) if i != position]
        without = bench.refine(others, noise, start=fit.parameters, only=len(bench.effects))
        columns = max(len(fit.effects[position].columns(bench.robot)), 1)
        out[k] = significance(without.statistic - fit.statistic, columns, tests, without, noise)
    return out


def _described(bench: Bench, now: Settled, added: int) -> int:
    """How many of the last effects of a model the description gives: they were not looked for."""
    effects = now.fit.effects
    return sum(is_given(effect, bench.robot) for effect in effects[len(effects) - added :])


def _as_described(bench: Bench, start: Settled) -> tuple[Settled, list[float]]:
    """A model with what its description gives and it lacks, as far as it is needed, and the significance of that."""
    now = as_described(bench, start)
    if now is not start:
        # encoders that are late at all links are as good as viscous friction there, but for what tells them apart
        late = with_a_common_delay(bench, start, (), 1)
        if late is not start and late.fit.statistic / late.fit.dof < now.fit.statistic / now.fit.dof:
            return late, [NOT_ASKED]
    count = len(now.fit.effects) - len(start.fit.effects)
    now, added = eliminate(bench, now, [0.0] * count, count, fewest=0)
    positions = range(len(now.fit.effects) - len(added), len(now.fit.effects))
    without = side_by_side(Elimination(bench, now, count, 0.0), positions)
    return now, [each.p_value for each in without]


def _lost(now: Settled, before: Settled, added: int, candidates: Sequence[Candidate]) -> bool:
    """Whether the last effect left so much, and nothing promises the rest, that the library does not have it."""
    far = added >= FEWEST_LOST and now.fit.statistic > HOPELESS * now.fit.dof
    most = max((candidate.gain for candidate in candidates), default=0.0)
    return far and now.fit.excess > SLOW * before.fit.excess and most < (1.0 - SLOW) * now.fit.excess


def _possible(bench: Bench, now: Settled, added: int) -> bool:
    """Whether all effects that were added are possible together, and none has become too short to be shown."""
    return all(
        possible(bench, now.fit, now.noise, -k) and not too_short(bench, now.fit.effects[-k])
        for k in range(1, added + 1)
    )


def _improved(bench: Bench, now: Settled, added: int, tried: Tried, ruled_out: Collection[Key]) -> Settled:
    """A model whose effects have the form that they need by now, and gave way to better ones.

    What is tried in the place of a push has sharp edges, and so must the push; what took the place of another effect
    may move them.
    """
    now = formed(bench, now)
    exchanged = exchange(bench, now, added, tried, ruled_out)
    return now if exchanged is now else formed(bench, settled_down(bench, exchanged))


def _largest_changes(bench: Bench, fit: Fit, added: int) -> FloatArray:
    """(E,) the largest of `visible_changes` by any of the last effects of a fit, each by itself [-]."""
    largest = np.zeros(len(bench.data.equations))
    for position in range(len(fit.effects) - added, len(fit.effects)):
        others = [e for k, e in enumerate(fit.effects) if k != position]
        less = bench.predicted(others, fit.parameters)
        largest = np.maximum(largest, torque_changes(bench, less, fit))
    return largest


def still_needed(bench: Bench, selection: Selection) -> Selection:
    """What is left of what was found before more was known of the recording."""
    now = settle_again(bench, selection.final.fit)
    now, p_values = eliminate(bench, now, list(selection.p_values), selection.tests, fewest=0)
    return replace(selection, final=now, added=len(p_values), p_values=tuple(p_values))


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
