"""The next effect of a search: which of the candidates is added, and what it must come to."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.columns import effect_key
from sea_ident.discrepancy.bench.fit import Fit, Solution
from sea_ident.discrepancy.bench.free_shapes import is_signal
from sea_ident.discrepancy.bench.judge import (
    COMPLETE,
    SMALLEST_SHARE,
    at_a_bound,
    comes_first,
    flat_steps,
    is_push,
    own_torque,
    penalty,
    scatter_p,
    significance,
    too_short,
    torque_change,
    torque_changes,
)
from sea_ident.discrepancy.bench.physics import is_term, possible
from sea_ident.discrepancy.bench.settle import Settled
from sea_ident.discrepancy.measured.noise import NoiseFloor
from sea_ident.discrepancy.search.breakaway import lets_go_late
from sea_ident.discrepancy.search.candidates import Candidate
from sea_ident.discrepancy.search.exchange import Outdone, Tried
from sea_ident.discrepancy.search.refit import AT_ONCE, of_every_kind, refitted
from sea_ident.discrepancy.search.taken_up import taken_up
from sea_ident.effects import Effect
from sea_ident.effects.spring_hysteresis import SpringHysteresis
from sea_ident.effects.spring_offset import SpringOffset
from sea_ident.side_by_side import side_by_side

FAMILY_LEVEL = 1e-3
"""Probability of accepting anything where nothing is missing."""

USEFUL_SHARE = 0.2
"""Share of the excess that an effect must explain to be accepted, ..."""

MANY = 4
"""... and from so many effects on that are there before it ..."""

USEFUL_BESIDE_MANY = 0.5
"""... this share: a few more that are really there explain the rest, what the library does not have is never done."""

USEFUL_AGAIN = 0.4
"""Another of a kind that was added at the same joint must explain this share: orders of a ripple that are really there
explain the rest, a form that is not that of a ripple is a sum of many."""

BESIDE_ANOTHER = 0.12
"""And by this share of what another effect does to the same equation, for the form of that one is known no better,
unless it explains nearly all: what another effect in the wrong form leaves is none of its own."""

LARGE_TORQUE = 0.3
"""An effect of more than this share of the torque (rms) must be visible as such, ..."""

CANCELLED = 0.02
"""... with more than this share of it not taken up by other parameters."""

SCATTER_LEVEL = 1e-5
"""Probability that an effect must not exceed by the scatter of the periods along its own columns."""

FINALISTS = 4
"""Candidates that are refitted with everything free before one is accepted, and the best of every kind too, ..."""

MOST_FINALISTS = 7
"""... and up to so many where they promise about as much as the best of them."""

LAST_TWO = 2
"""Of the candidates the best are compared with the shapes of the model refined too."""

LITTLE_LEFT = 0.02
"""An effect that leaves less than this share of the excess is compared only with what promises more than it, ..."""

AS_MUCH = 0.95
"""... or about as much as it did, this share at least: a push on the link before it does nearly the same, ..."""

NEARLY_RIGHT = 3.0
"""... once one leaves less than this statistic over degrees of freedom."""

HOPEFUL = 0.4
"""What is not in the chain of signals must promise this share of what the best of those before it explains: shapes and
edges that are refined bring about twice what is promised, seldom more."""


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
    most, by_law, promised, explained = 0.0, 0.0, 0.0, False
    again = {effect_key(effect) for effect in fit.effects[len(bench.effects) :]}
    refits: list[tuple[Candidate, float]] = []
    impossible: list[tuple[Effect, float]] = []

    def passed_over(candidate: Candidate) -> bool:
        """Whether it is not worth a refit beside what was accepted before it."""
        if is_push(candidate.effect) and not comes_first(candidate.gain / HOPEFUL, by_law, fit):
            return True
        if most > (1.0 - LITTLE_LEFT) * fit.excess and candidate.gain < min(most, AS_MUCH * promised) and explained:
            return True
        return candidate.gain < HOPEFUL * most and not is_signal(candidate.effect)

    waiting = _finalists(worth)
    while waiting := [c for c in waiting if not passed_over(c)]:
        pair, waiting = waiting[:AT_ONCE], waiting[AT_ONCE:]
        leaders = sorted(new.statistic for new, _ in accepted)[:LAST_TWO]
        # one that explains too little, or less than those that are compared in the end, need not be known exactly
        interest = [fit.statistic, *leaders[LAST_TWO - 1 :]]
        needs = [max(useful, USEFUL_AGAIN * fit.excess) if c.key in again else useful for c in pair]
        trial = _Trial(bench, now, steps, smallest, tests, tuple(interest))
        outcomes = side_by_side(trial, list(zip(pair, needs, strict=True)))
        for candidate in pair:
            if passed_over(candidate):
                break
            outcome = next(outcomes)
            refits.append((candidate, outcome.gain if outcome.possible else 0.0))
            if not outcome.possible:
                impossible.append((candidate.effect, outcome.gain))
            if not outcome.acceptable or (is_push(candidate.effect) and not comes_first(outcome.gain, by_law, fit)):
                continue
            new = bench.again(outcome.solution, noise)
            accepted.append((new, outcome.p_value))
            by_law = by_law if is_push(candidate.effect) else max(by_law, outcome.gain)
            if outcome.gain > most:
                most, promised = outcome.gain, candidate.gain
            explained = explained or new.statistic < NEARLY_RIGHT * new.dof
        outcomes.close()
    if not accepted:
        return None
    # what is left by the best is left by lack of other effects as well, and small differences are a matter of these
    unit = min((new for new, _ in accepted), key=lambda new: new.statistic).unit
    accepted.sort(key=lambda item: item[0].statistic + unit * penalty(item[0].effects[-1], bench))

    def score(item: tuple[Fit, float]) -> float:
        new, _ = item
        whole = bench.refine(new.effects, noise, start=new.parameters) if len(accepted) > 1 else new
        return whole.statistic + unit * penalty(new.effects[-1], bench)

    last = _where_it_rests(fit, accepted, impossible) or accepted[:LAST_TWO]
    scores = list(side_by_side(score, last))
    best, best_p = last[scores.index(min(scores))]
    own, whole_gain = effect_key(best.effects[-1]), fit.statistic - best.statistic
    if tried is not None:
        for candidate, gain in refits:
            tried[own, candidate.key] = Outdone(candidate.gain / whole_gain, gain / whole_gain)
    return best, best_p


def _where_it_rests(
    fit: Fit, accepted: Sequence[tuple[Fit, float]], impossible: Sequence[tuple[Effect, float]]
) -> list[tuple[Fit, float]]:
    """The constant of a spring, where dry friction in it would explain more than all others but is not possible alone.

    It rests anywhere, and what slips nowhere stands in for that. Nothing else is in its way then: what explains a
    little more than the constant does so by what the friction leaves.

    Args:
        fit: the model.
        accepted: models with one effect more that are possible, and their significance.
        impossible: effects that are not, and by how much they bring the statistic down.
    """
    most = max(fit.statistic - new.statistic for new, _ in accepted)
    joints = {effect.joint for effect, gain in impossible if isinstance(effect, SpringHysteresis) and gain > most}
    for new, p_value in accepted:
        last, as_much = new.effects[-1], fit.statistic - new.statistic > AS_MUCH * most
        if as_much and isinstance(last, SpringOffset) and last.joint in joints:
            return [(new, p_value)]
    return []


@dataclass(frozen=True, eq=False)
class _Outcome:
    """What came of a candidate that was refitted.

    Attributes:
        solution: the model with it.
        gain: drop of the statistic.
        p_value: its significance.
        possible: whether it is, or would be beside others.
        acceptable: whether it may be added.
    """

    solution: Solution
    gain: float
    p_value: float
    possible: bool
    acceptable: bool


@dataclass(frozen=True, eq=False)
class _Trial:
    """Refits candidates with everything free.

    Attributes:
        bench: the recording.
        now: the model without them.
        steps: (S, M) whitened steps between periods without them.
        smallest: (E,) change of the torque that matters, as a share of it [-].
        tests: number of shapes of all candidates.
        interest: statistics that each must stay below to be of interest, the first less what it must explain.
    """

    bench: Bench
    now: Settled
    steps: FloatArray
    smallest: FloatArray
    tests: int
    interest: tuple[float, ...]

    def __call__(self, tried: tuple[Candidate, float]) -> _Outcome:
        """Refit a candidate that must explain so much of the statistic."""
        (candidate, least), bench, fit, noise = tried, self.bench, self.now.fit, self.now.noise
        beat = min(self.interest[0] - least, *self.interest[1:], np.inf)
        new = refitted(bench, fit.effects, candidate.effect, (), noise, fit.parameters, beat)
        gain = fit.statistic - new.statistic
        p_value = significance(gain, candidate.columns, self.tests, fit, noise)
        could_be = possible(bench, new, noise, -1)
        acceptable = could_be and p_value <= FAMILY_LEVEL and gain >= least
        acceptable = acceptable and _acceptable(bench, fit, new, noise, self.steps, self.smallest)
        return _Outcome(new.solution, gain, p_value, could_be, acceptable)


def _finalists(worth: Sequence[Candidate]) -> list[Candidate]:
    """Candidates that are refitted, best first (what acts by a law, and pushes after it)."""
    if not worth:
        return []
    joint = worth[0].effect.joint
    laws = [c for c in worth if not is_push(c.effect)]
    pushes = [c for c in worth[: _as_good(worth)] if is_push(c.effect)]
    return [*of_every_kind(laws, _as_good(laws), joint), *pushes]


def _as_good(candidates: Sequence[Candidate]) -> int:
    """How many of the first are finalists: more where they promise about as much as the best."""
    return max(FINALISTS, sum(c.gain > AS_MUCH * candidates[0].gain for c in candidates[:MOST_FINALISTS]))


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


def _acceptable(bench: Bench, fit: Fit, new: Fit, noise: NoiseFloor, steps: FloatArray, smallest: FloatArray) -> bool:
    """Whether the last effect of a new fit is large enough, and is neither hidden nor a matter of one pass.

    Args:
        bench: the recording.
        fit: without the effect.
        new: with it.
        noise: noise floor of both.
        steps: (S, M) whitened steps between periods without it.
        smallest: (E,) change of the torque that matters, as a share of it [-].
    """
    effect = new.effects[-1]
    slack = len(bench.slack_links(new)) > len(bench.slack_links(fit))
    if slack or at_a_bound(effect) or too_short(bench, effect):
        return False
    own = own_torque(bench, new, -1)
    cancels = is_signal(effect) or is_term(effect)  # an error of a sensor is taken up, and so is a term of a law
    if own > LARGE_TORQUE and not cancels and torque_change(bench, fit, new) < CANCELLED * own:
        return False
    if fit.statistic - new.statistic > COMPLETE * fit.excess:
        smallest = np.minimum(smallest, SMALLEST_SHARE)
    hidden = np.all(visible_changes(bench, fit, new) < smallest)
    if hidden and (own < SMALLEST_SHARE or not taken_up(bench, fit, new, noise, -1)):
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
