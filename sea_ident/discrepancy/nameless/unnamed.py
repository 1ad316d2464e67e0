"""Which of what was found is not what it is called: a relative without a name in its place explains much more.

A search takes the nearest that there is. A ripple that grows with the load is found as a ripple, at the right joint and
of the right order, and most of the gap goes with it; friction whose viscous part changes over the turn is found as
friction whose dry part does. So every effect that was found is held against its relatives. Where one of these *in its
place* fits better by long odds and leaves no more than noise, or hardly anything of what the named effect leaves, the
named one is not what is there. Whether what the named one leaves stands out of noise does not matter.

What pushes in every period may be a law of the position: the end of the range of a joint, which its motion comes to in
every pass. So a push is held against such ends, and so is any effect where something is left beside what was found.
What was found in a spring, or as a push, and leaves something is held against a spring that creeps, too, and what was
found in an encoder, or as a wave or a spring along the path, against an encoder of another scale.

Two effects of one joint may be one that acts in one direction only: a loss that a gear has while its motor drives is
half a friction that grows with the load and half a torque constant. And friction that grows with the load is twice that
loss less a torque constant, which is one whose sign turns with the direction. Where one that does all that both do fits
as well alone, with fewer parameters, the two are not what is there. Two waves of nearly one length are one that grows
and fades, mostly with the load: that one is tried in the place of both. An encoder that errs at a joint and a torque of
its motor that changes along the path are together a torque on the link: the same effect there is asked too.
"""

from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.fit import Fit, Solution
from sea_ident.discrepancy.bench.judge import EQUALLY_GOOD
from sea_ident.discrepancy.bench.lack import LACK_LEVEL, lack_of_fit
from sea_ident.discrepancy.bench.settle import Settled
from sea_ident.discrepancy.compared.heldout import HeldOut
from sea_ident.discrepancy.nameless.creeping import Creep, creeping, no_dry_friction
from sea_ident.discrepancy.nameless.end_stops import EndStop, end_stops
from sea_ident.discrepancy.nameless.relatives import (
    BehindTheSpring,
    Relative,
    behind_the_spring,
    one_sided,
    relatives_of,
)
from sea_ident.discrepancy.nameless.scaled_encoders import ScaledEncoder, scaled_encoders
from sea_ident.discrepancy.search.candidates import Candidate, scan
from sea_ident.discrepancy.search.refit import refitted
from sea_ident.discrepancy.search.search import Selection
from sea_ident.effects import Effect
from sea_ident.effects.external_force import ExternalForce
from sea_ident.effects.spring_hysteresis import SpringHysteresis
from sea_ident.effects.spring_offset import SpringOffset
from sea_ident.plain import plain
from sea_ident.side_by_side import side_by_side

LEAVES = 0.3
"""Share of the excess that a relative may leave of what the named effect leaves to be taken for the truth, unless it
leaves no more than noise [-]."""

PROMISED = 0.5
"""Share of what the named effect explains that a relative must promise to explain before it is fitted [-]."""

OF_INTEREST = 4.0
"""Times the statistic of the named effect above which a relative is not fitted to the end [-]: not even with the shapes
of the model as it has them it comes to as little."""

TRIED = 2
"""Relatives of an effect that are fitted, those that promise most."""

TRIED_FOR_TWO = 4
"""Relatives in the place of two effects that are fitted: each of the two in the directions that promise most."""

ALL_OF_IT = 0.9
"""Share of what two effects explain that one in the place of both must promise before it is fitted [-]."""


@dataclass(frozen=True)
class Unnamed:
    """An effect that was found and a relative without a name that explains the recording much better.

    Attributes:
        effect: name of what was found.
        joint: its joint.
        relative: how the other differs, in words.
        share: what it leaves of what the named one leaves [-].
        solution: the whole model with it in the place of the effect.
        second: name of another effect of the joint in the place of which it is too, None where there is none.
    """

    effect: str
    joint: str | None
    relative: str
    share: float
    solution: Solution
    second: str | None = None

    @property
    def sentence(self) -> str:
        """What it explains."""
        if self.second is not None:
            return (
                f"{self.effect} and {self.second} at {self.joint} are what one effect alone does as well: "
                f"{self.relative}, with fewer parameters."
            )
        same = f"The same as {self.effect} at {self.joint}, but {self.relative},"
        if self.share > LEAVES:
            return f"{same} leaves no more than noise, and fits better by odds of more than a thousand to one."
        return f"{same} leaves {plain(100 * self.share)} % of what that one leaves."


def unnamed(
    bench: Bench, selection: Selection, held: HeldOut | None, away: tuple[Bench, Settled] | None = None
) -> tuple[Unnamed, ...]:
    """Effects that were found in the place of which a relative explains the recording much better.

    Args:
        bench: the recording.
        selection: what was found.
        held: data that were not used; what a relative explains must hold on another motion too.
        away: the recording with more left out around the reversals, and the model with what was found there: whether
            one effect does what two do is told where the sign of friction is known; the recording itself by default.

    Returns:
        One entry for every such effect, with its best relative.
    """
    now = selection.final
    pairs = _one_for_two(*(away or (bench, now)), selection, held)
    stops = end_stops(bench)
    leaves = lack_of_fit(bench, now)[2] < LACK_LEVEL

    def in_place_of(position: int) -> Unnamed | None:
        own = now.fit.effects[position]
        outside: tuple[Effect, ...] = stops if leaves or isinstance(own, ExternalForce) else ()
        if leaves:
            outside = (*outside, *creeping(bench, own), *scaled_encoders(bench.robot, own))
        best = _best(bench, now, position, outside)
        return best[0] if best is not None and _holds(best[1], selection, held, position) else None

    positions = range(len(now.fit.effects) - selection.added, len(now.fit.effects))
    return (*pairs, *(found for position in positions if (found := in_place_of(position)) is not None))


def _one_for_two(bench: Bench, now: Settled, selection: Selection, held: HeldOut | None) -> tuple[Unnamed, ...]:
    """Pairs of effects that were found at one joint where one alone does as well as both."""
    fit, noise = now.fit, now.noise
    first = len(fit.effects) - selection.added
    found = []
    for one, two in combinations(range(first, len(fit.effects)), 2):
        own, second = fit.effects[one], fit.effects[two]
        if own.joint != second.joint or {type(own), type(second)} == {SpringOffset, SpringHysteresis}:
            continue  # a spring with dry friction in it rests anywhere: that is one cause, and takes two
        family: tuple[Effect, ...] = (*behind_the_spring(bench, own), *behind_the_spring(bench, second))
        if own.side is second.side:
            family = (*one_sided(own), *one_sided(second), *family)
        if type(own) is type(second):  # two waves that beat are one that grows and fades
            family = (*family, *_grown(bench, fit, own), *_grown(bench, fit, second))
        if not family:
            continue
        others = [e for k, e in enumerate(fit.effects) if k not in (one, two)]
        reduced = bench.fit(others, noise, start=fit.parameters)
        gain = reduced.statistic - fit.statistic
        for candidate in scan(bench, reduced, noise, family)[:TRIED_FOR_TWO]:
            if candidate.gain < ALL_OF_IT * gain:
                break
            # the load is that of the model with both: without them it bends
            relative = bench.anchored((*others, candidate.effect), fit.parameters)[-1]
            new = refitted(bench, others, relative, (), noise, fit.parameters, OF_INTEREST * fit.statistic)
            if new.statistic - fit.statistic > EQUALLY_GOOD * fit.unit:
                # the shapes of the model are those beside the two
                new = bench.refine(new.effects, noise, start=new.parameters)
            if new.statistic - fit.statistic < EQUALLY_GOOD * fit.unit and _transfers(new, selection, held):
                share = new.excess / max(fit.excess, 1.0)
                other = second.title.removesuffix(f" at {second.joint}")
                found.append(Unnamed(own.name, own.joint, _whole(candidate.effect), share, new.solution, other))
                break
    return tuple(found)


def _transfers(fit: Fit, selection: Selection, held: HeldOut | None) -> bool:
    """Whether the last effect of a fit with one effect less explains another motion as well."""
    if held is None or not held.other_motion:
        return True
    fewer = replace(selection, final=replace(selection.final, fit=fit), added=selection.added - 1)
    return held.worth(fewer, len(fit.effects) - 1).holds


def _holds(fit: Fit, selection: Selection, held: HeldOut | None, position: int) -> bool:
    """Whether a model with a relative explains another motion as well, and better than the effect that was found."""
    if held is None or not held.other_motion:
        return True
    replaced = replace(selection, final=replace(selection.final, fit=fit))
    rival, own = held.worth(replaced, position), held.transfers[position - len(fit.effects) + selection.added]
    return rival.holds and rival.statistic < own.statistic


def _best(bench: Bench, now: Settled, position: int, outside: tuple[Effect, ...]) -> tuple[Unnamed, Fit] | None:
    """What explains much more in the place of an effect, of its own relatives and some of no kin, and the model."""
    fit, noise = now.fit, now.noise
    own = fit.effects[position]
    others = [e for k, e in enumerate(fit.effects) if k != position]
    family: tuple[Effect, ...] = (*relatives_of(bench, fit.effects, own), *outside)
    if not family:
        return None
    reduced = bench.fit(others, noise, start=fit.parameters)
    gain = reduced.statistic - fit.statistic
    promising = [c for c in scan(bench, reduced, noise, family)[:TRIED] if not c.gain < PROMISED * gain]
    better = EQUALLY_GOOD + 2.0 * float(np.log(len(family)))
    found = side_by_side(_InPlace(bench, now, position, better), promising)
    best = min((each for each in found if each is not None), key=lambda each: each.share, default=None)
    return None if best is None else (best, bench.again(best.solution, noise))


@dataclass(frozen=True, eq=False)
class _InPlace:
    """Tries relatives in the place of an effect.

    Attributes:
        bench: the recording.
        now: the model.
        position: of the effect in it.
        better: by how much the statistic must come down, in units of what is left.
    """

    bench: Bench
    now: Settled
    position: int
    better: float

    def __call__(self, candidate: Candidate) -> Unnamed | None:
        """A relative with the model with it, None where it does not explain much more."""
        bench, fit, noise, position = self.bench, self.now.fit, self.now.noise, self.position
        before, after, beat = fit.effects[:position], fit.effects[position + 1 :], OF_INTEREST * fit.statistic
        new = refitted(bench, before, candidate.effect, after, noise, fit.parameters, beat)
        if new.excess > LEAVES * fit.excess:
            # the shapes of the model are those beside the named effect
            new = bench.refine(new.effects, noise, start=new.parameters)
        share = new.excess / max(fit.excess, 1.0)
        if fit.statistic - new.statistic < self.better * new.unit:
            return None
        if share > LEAVES and lack_of_fit(bench, Settled(new, noise))[2] < LACK_LEVEL:
            return None
        if isinstance(candidate.effect, Creep) and not no_dry_friction(bench, new, position, noise):
            return None
        own = fit.effects[position]
        return Unnamed(own.name, own.joint, _in_words(new.effects[position]), share, new.solution)


def _grown(bench: Bench, fit: Fit, effect: Effect) -> tuple[Effect, ...]:
    """Relatives of an effect that grow with a signal of its joint."""
    return tuple(relative for relative in relatives_of(bench, fit.effects, effect) if relative.growth is not None)


def _whole(relative: Effect) -> str:
    """A relative in words that stand alone."""
    words = _in_words(relative)
    return f"{relative.name} {words}" if isinstance(relative, Relative) and relative.growth is not None else words


def _in_words(relative: Effect) -> str:
    if isinstance(relative, EndStop | Creep | ScaledEncoder):
        return relative.in_words
    if isinstance(relative, BehindTheSpring):
        return f"{relative.name} on the link"
    if isinstance(relative, Relative) and relative.only is not None:
        return f"{relative.name} {relative.only}"
    if isinstance(relative, Relative) and relative.growth is not None:
        return f"growing with the {relative.growth}"
    driver = relative.driver if isinstance(relative, Relative) else None
    return f"driven by {driver.joint if driver is not None else 'another joint'}"
