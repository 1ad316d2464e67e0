"""Friction that acts only beside reversals, in samples that a search leaves out: those are compared, for it alone."""

from dataclasses import replace

import numpy as np

from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.fit import Fit
from sea_ident.discrepancy.bench.judge import EQUALLY_GOOD, SMALLEST_SHARE, too_short, torque_changes
from sea_ident.discrepancy.bench.lack import LACK_LEVEL, lack_of_fit
from sea_ident.discrepancy.bench.lacking import candidate_effects
from sea_ident.discrepancy.bench.physics import physical
from sea_ident.discrepancy.bench.settle import Settled, settle_again
from sea_ident.discrepancy.conclude import FEWEST_PERIODS, unexplained
from sea_ident.discrepancy.measured.standing import LIVE_BESIDE_REVERSALS, compared_beside_reversals
from sea_ident.discrepancy.search.breakaway import LEVEL, breakaway_p
from sea_ident.discrepancy.search.candidates import Candidate, scan
from sea_ident.discrepancy.search.confirm import Confirmed
from sea_ident.discrepancy.search.next_effect import BESIDE_ANOTHER, next_effect
from sea_ident.discrepancy.search.refit import refitted
from sea_ident.discrepancy.search.search import MOST_EFFECTS
from sea_ident.effects.coulomb_friction import CoulombFriction
from sea_ident.effects.stribeck_friction import StribeckFriction

SPEEDS = 12
"""Speeds from which the start of a sliding friction is refined: each twice the one before."""

MOST_OF_IT = 0.5
"""Share of what is left beside reversals that a friction must explain: the corner that a speed within the band misses
is left there too, at every joint, and some friction explains a part of it [-]."""

USUAL = 1
"""Caution of the recordings that are looked at: one that is diagnosed without its slow samples is not."""


def searched_beside_reversals(bench: Bench, confirmed: Confirmed) -> tuple[Bench, Confirmed]:
    """Look for friction in the samples beside reversals, where what was found explains all others.

    What the mean leaves there is not noise alone: the corner of friction that a band-limited speed misses, a motor that
    friction holds. So that must be more than chance as a whole, and an effect must explain a share of it as anywhere
    else and most of what is left, stand out of the scatter of the periods along its own column, and be the best of the
    whole library. Stiction is looked for in the passes first: where it lets go at another instant in each, the mean
    hardly shows it.

    Args:
        bench: the recording.
        confirmed: what was found in the rest of it.

    Returns:
        The bench that shows what was found, and what was found with the friction there.
    """
    if bench.data.caution != USUAL or bench.data.periods < FEWEST_PERIODS or unexplained(confirmed):
        return bench, confirmed
    near = bench.comparing(compared_beside_reversals(bench.data))
    before = confirmed.selection
    now = settle_again(near, before.final.fit)
    now, added = _let_go_late(near, now, MOST_EFFECTS - before.added)
    begun: set[str | None] = set()

    def other_start(joint: str | None) -> bool:
        """Whether the friction of a joint starts to slide elsewhere than it did; asked of every joint once."""
        nonlocal now
        last = now
        now = now if joint in begun else with_sliding_start(near, now, joint)
        begun.add(joint)
        return now is not last

    while before.added + len(added) < MOST_EFFECTS and lack_of_fit(near, now)[2] < LACK_LEVEL:
        few = [e for e in candidate_effects(near, now.fit.effects) if e.name in LIVE_BESIDE_REVERSALS]
        candidates = scan(near, now.fit, now.noise, few)
        # a friction that starts to slide where it does not may keep any other from being possible beside it
        if candidates and other_start(candidates[0].effect.joint):
            continue
        step = _next(near, now, before.start.fit, candidates)
        if step is None:
            break
        if other_start(step[0].effects[-1].joint):
            continue
        if step[0].excess > (1.0 - MOST_OF_IT) * now.fit.excess:
            break
        # all others only where one of the few may be it: mostly none is
        step = _next(near, now, before.start.fit, scan(near, now.fit, now.noise))
        if step is None or step[0].effects[-1].name not in LIVE_BESIDE_REVERSALS:
            break
        settled = settle_again(near, settle_again(near, step[0]).fit)
        # it may have become shorter in its own noise floor
        if too_short(near, settled.fit.effects[-1]):
            break
        added.append(step[1])
        now = settled
    if not added:
        return bench, replace(confirmed, beside=(near, now))
    start = settle_again(near, before.start.fit)
    found = tuple(scan(near, now.fit, now.noise))
    selection = replace(
        before, start=start, final=now, added=before.added + len(added), p_values=(*before.p_values, *added),
        candidates=found, tests=max(sum(c.tests for c in found), 1),
    )  # fmt: skip
    return near, Confirmed(selection, near, start, now, beside=(near, now))


def friction_of_the_slow(bench: Bench, confirmed: Confirmed) -> tuple[Bench, Confirmed] | None:
    """What was found without the slow samples, with the friction that only these show.

    What hides an effect among them may be such a friction as well as the steepness of friction there.

    Args:
        bench: the recording with the usual samples compared.
        confirmed: what was found without those that are slow, and explains the rest.

    Returns:
        The bench that shows the friction, and what was found with it; None where that does not explain all there is.
    """
    found = confirmed.selection
    now, start = (settle_again(bench, each.fit) for each in (found.final, found.start))
    near, more = searched_beside_reversals(bench, replace(confirmed, selection=replace(found, start=start, final=now)))
    if more.selection.added == found.added or lack_of_fit(near, more.final)[2] < LACK_LEVEL:
        return None
    return near, more


def _let_go_late(near: Bench, now: Settled, most: int) -> tuple[Settled, list[float]]:
    """A model with the stiction that passes show where their motors are let go, and its significance.

    Where it lets go at another instant in every pass, next to nothing of it is in their mean, by which it is fitted.

    Args:
        near: the recording with what is slow beside reversals compared.
        now: the model there.
        most: how many effects may be added.
    """
    added: list[float] = []
    few = [e for e in candidate_effects(near, now.fit.effects) if isinstance(e, StribeckFriction)]
    for candidate in scan(near, now.fit, now.noise, few):
        p_value = breakaway_p(near, now.fit, str(candidate.effect.joint))
        if p_value > LEVEL or len(added) == most:
            continue
        new = refitted(near, now.fit.effects, candidate.effect, (), now.noise, now.fit.parameters)
        if physical(near, new, -1) and now.fit.statistic - new.statistic > EQUALLY_GOOD * new.unit:
            now = settle_again(near, new)
            added.append(p_value)
    return now, added


def with_sliding_start(near: Bench, now: Settled, joint: str | None) -> Settled:
    """A model with the speed up to which a friction only starts to slide where it fits best.

    Where a search compares nothing that slow, that speed may have ended anywhere. From far below it no step leads
    back: no sample is slower.

    Args:
        near: the recording with what is slow beside reversals compared.
        now: the model there.
        joint: of the friction.

    Returns:
        The model refined from the best speed of its range, or as it is where none is better.
    """
    best, own = now.fit, now.fit.effects
    for k, effect in enumerate(own):
        if not isinstance(effect, CoulombFriction) or effect.joint != joint:
            continue
        (shape,) = effect.shapes
        for speed in shape.grid(SPEEDS):
            other = (*own[:k], replace(effect, smoothing=float(speed)), *own[k + 1 :])
            best = min(
                best, near.fit(other, now.noise, start=now.fit.parameters, tangents=False), key=lambda f: f.statistic
            )
    # held against each other in one noise floor: that of the better one is lower, and what it leaves counts more there
    return settle_again(near, best) if best.statistic < now.fit.statistic - EQUALLY_GOOD else now


def _next(near: Bench, now: Settled, start: Fit, candidates: list[Candidate]) -> tuple[Fit, float] | None:
    """The best of some candidates refitted with everything free, and its significance."""
    change = torque_changes(near, start, now.fit) if len(now.fit.effects) > len(start.effects) else 0.0
    smallest = np.broadcast_to(np.maximum(SMALLEST_SHARE, BESIDE_ANOTHER * change), now.fit.scale.shape)
    return next_effect(near, now, candidates, max(sum(c.tests for c in candidates), 1), smallest)
