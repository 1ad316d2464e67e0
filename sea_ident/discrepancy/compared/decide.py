"""What one motion does not tell apart another may: equals are compared on data that were not used."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.columns import effect_key
from sea_ident.discrepancy.bench.fit import Fit, Solution
from sea_ident.discrepancy.bench.free_shapes import SHAPES_THAT_STAY, free_shapes, is_signal, moved
from sea_ident.discrepancy.bench.judge import EQUALLY_GOOD, penalty
from sea_ident.discrepancy.bench.physics import physical
from sea_ident.discrepancy.bench.settle import Settled
from sea_ident.discrepancy.compared.heldout import HeldOut
from sea_ident.discrepancy.compared.remembering import remembering
from sea_ident.discrepancy.compared.transfer import Transfer
from sea_ident.discrepancy.result.findings import Alternative
from sea_ident.discrepancy.search.edges import at_centre
from sea_ident.discrepancy.search.search import Selection
from sea_ident.effects import Effect
from sea_ident.effects.external_force import ExternalForce
from sea_ident.side_by_side import side_by_side

Alternatives = dict[int, tuple[Alternative, ...]]

CLEARLY = 1.0
"""What a simpler effect must save, in units of the statistic."""

OTHER_SHAPES = (1.5, 2.0, 3.0, 4.0)
"""Factors by which a shape is moved where it may be open."""


def declared(alternatives: Mapping[int, tuple[Alternative, ...]]) -> Alternatives:
    """The alternatives of each effect that are as likely where no other motion decides."""
    return {position: tuple(a for a in others if a.as_likely) for position, others in alternatives.items()}


def simplest_first(
    bench: Bench, selection: Selection, alternatives: Mapping[int, tuple[Alternative, ...]]
) -> tuple[Selection, Alternatives]:
    """Of effects that one motion does not tell apart, the one with the fewest parameters is the one that is named.

    A search compares them in the noise floor of a model that lacks them all, where the difference may be larger.

    Args:
        bench: the recording.
        selection: what was found.
        alternatives: what else each effect could be, by its position in the model.

    Returns:
        The selection with the simplest, and what else each of its effects could be.
    """
    kept: Alternatives = {}
    changed = False
    for position, others in alternatives.items():
        now = selection.final.fit
        own = now.effects[position]
        if changed:
            # they were fitted beside an effect that is out by now
            others = tuple(
                replace(a, fit=None if a.fit is None else _beside(bench, selection, position, a.fit)) for a in others
            )
        best, price = None, now.statistic + now.unit * (penalty(own, bench) - CLEARLY)
        for other in others:
            if other.fit is None or other.behind or _twice(other.fit, position, selection.added):
                continue
            own_price = penalty(other.fit.effects[position], bench)
            whole = other.fit.statistic + now.unit * own_price
            if own_price < penalty(own, bench) and whole < price:
                best, price = other, whole
        if best is not None and best.fit is not None:
            selection = replace(selection, final=Settled(best.fit, selection.final.noise))
            out = Alternative(own.name, own.joint, best.cos2, now)
            others, changed = (out, *(a for a in others if a is not best)), True
        kept[position] = others
    return selection, kept


def _twice(fit: Fit, position: int, added: int) -> bool:
    """Whether the effect at a position is there at another one too, of those that were added."""
    keys = [effect_key(effect) for effect in fit.effects[len(fit.effects) - added :]]
    return keys.count(effect_key(fit.effects[position])) > 1


def _beside(bench: Bench, selection: Selection, position: int, fit: Fit) -> Fit:
    """A fit with another effect at a position, beside the effects that a selection has by now."""
    now = selection.final
    effects = list(now.fit.effects)
    effects[position] = fit.effects[position]
    return bench.fit(effects, now.noise, start=now.fit.parameters)


def decide(
    bench: Bench, selection: Selection, alternatives: Mapping[int, tuple[Alternative, ...]], held: HeldOut
) -> tuple[Selection, Alternatives, HeldOut]:
    """Let another motion choose between an effect and its alternatives, each with its parameters as they were found.

    Args:
        bench: the recording that was used.
        selection: what was found on it.
        alternatives: what else each effect could be, by its position in the model.
        held: the other motion.

    Returns:
        The selection with what holds best on the other motion, the alternatives that it does not rule out, and what
        the selection is worth there.
    """
    kept: Alternatives = {}
    first = len(selection.final.fit.effects) - selection.added
    changed = reshaped = False
    for position, others in alternatives.items():
        beside_another = changed or reshaped
        if not changed:
            shaped, held = _with_its_best_shape(bench, selection, held, position)
            selection, reshaped = shaped, reshaped or shaped is not selection
        own = held.transfers[position - first]
        left: list[Alternative] = []
        memory = remembering(bench, selection, held, position)
        waiting = list(others if memory is None else (*others, memory))
        while waiting:
            comparison = _Comparison(bench, selection, held, position, own, beside_another or changed)
            compared = list(waiting)
            for other, rival in zip(compared, side_by_side(comparison, compared), strict=True):
                waiting.pop(0)
                fit = comparison.fit(other)
                if fit is None:
                    left.append(other)
                if fit is None or rival is None:
                    continue
                replaced = replace(selection, final=Settled(fit, selection.final.noise))
                if rival.remembers == own.remembers and held.foretell_the_same(selection, replaced):
                    left.extend(() if other.behind or other.dearer else (replace(other, fit=fit),))
                    continue
                swapped = _better(rival, own, other.behind)
                if swapped:
                    before = selection.final.fit
                    selection, changed = replace(replaced, final=Settled(fit, bench.noise(fit))), True
                    held = held.again(replaced)
                    # what was no better than the one that is now out was no better than this one
                    left = []
                    out = before.effects[position]
                    other, fit = Alternative(out.name, out.joint, other.cos2), before
                    own, rival = rival, own
                elif other.dearer:
                    continue
                elif other.behind:
                    # where both motions together do not tell them apart, it is as likely after all
                    nearly = _better(rival, own, other.behind - 2.0 * rival.margin)
                    if nearly and not _better(own, rival, -other.behind):
                        left.append(replace(other, fit=fit, behind=0.0))
                    continue
                elif not _better(own, rival):
                    left.append(replace(other, fit=fit))
                    continue
                same = _with_another_shape(bench, selection, held, position, fit, rival)
                if same is not None:
                    left.append(replace(other, fit=same))
                if swapped:
                    # the others are held against this one from here on
                    break
        kept[position] = tuple(left)
    return selection, kept, held


@dataclass(frozen=True, eq=False)
class _Comparison:
    """Tries alternatives of an effect on another motion.

    Attributes:
        bench: the recording that was used.
        selection: what was found on it.
        held: the other motion.
        position: of the effect in the model.
        own: what the effect is worth there.
        changed: whether the alternatives were fitted beside an effect that is out by now.
    """

    bench: Bench
    selection: Selection
    held: HeldOut
    position: int
    own: Transfer
    changed: bool

    def fit(self, other: Alternative) -> Fit | None:
        """The model with an alternative, None where there is none."""
        if other.fit is None or not self.changed:
            return other.fit
        return _beside(self.bench, self.selection, self.position, other.fit)

    def __call__(self, other: Alternative) -> Transfer | None:
        """What an alternative is worth; None where that does not matter."""
        if other.fit is None or (not other.as_likely and self.own.excess < EQUALLY_GOOD * self.own.unit):
            # nothing there that more parameters, or others, could explain
            return None
        fit = self.fit(other)
        if fit is None or _twice(fit, self.position, self.selection.added):
            return None
        replaced = replace(self.selection, final=Settled(fit, self.selection.final.noise))
        return self.held.worth(replaced, self.position, self.own)


def _with_another_shape(
    bench: Bench, selection: Selection, held: HeldOut, position: int, fit: Fit, found: Transfer
) -> Fit | None:
    """A fit whose effect the other motion rules out, with a shape with which it does not; None where there is none."""
    own = held.transfers[position - len(selection.final.fit.effects) + selection.added]
    shapes = _OpenShapes(bench, selection, held, position, fit, found)
    for ways in side_by_side(shapes, _other_shapes(bench, fit, position)):
        for solution, result in ways:
            if not _better(own, result):
                return shapes.again(solution)
    return None


def _with_its_best_shape(bench: Bench, selection: Selection, held: HeldOut, position: int) -> tuple[Selection, HeldOut]:
    """A selection with the shape of one effect that holds best on the other motion, of those that the first allows."""
    fit = selection.final.fit
    best = held.transfers[position - len(fit.effects) + selection.added]
    if best.excess < EQUALLY_GOOD * best.unit:
        return selection, held
    if isinstance(fit.effects[position], ExternalForce):
        return _on_the_centre(bench, selection, held, position)
    shapes, chosen = _OpenShapes(bench, selection, held, position, fit, best), selection
    for ways in side_by_side(shapes, _other_shapes(bench, fit, position)):
        for solution, result in ways:
            if _better(result, best):
                best = result
                chosen = replace(selection, final=Settled(shapes.again(solution), selection.final.noise))
    return chosen, held if chosen is selection else held.again(chosen)


def _on_the_centre(bench: Bench, selection: Selection, held: HeldOut, position: int) -> tuple[Selection, HeldOut]:
    """A selection with a push on the centre of mass of its link, where both motions together speak for that.

    Where a push meets its link bends to whatever else is missing beside it, far beyond what noise would do.
    """
    fit, noise = selection.final.fit, selection.final.noise
    centre = at_centre(bench, fit, noise, position)
    if centre is fit:
        return selection, held
    other = replace(selection, final=Settled(centre, noise))
    own = held.transfers[position - len(fit.effects) + selection.added]
    better = _better(held.worth(other, position, own), own, max(centre.statistic - fit.statistic, 0.0))
    return (other, held.again(other)) if better else (selection, held)


class _OpenShapes:
    """A fit with other shapes of one effect that do as well on the motion that was used.

    A motion may leave a shape open: play that is never closed is the same torque whatever its width. Then only all the
    shapes that it leaves open together can be ruled out.

    Args:
        bench: the recording that was used.
        selection: what was found.
        held: the other motion.
        position: of the effect.
        fit: the model with the effect as it was found, ...
        found: ... and what it is worth on the other motion.
    """

    def __init__(
        self, bench: Bench, selection: Selection, held: HeldOut, position: int, fit: Fit, found: Transfer
    ) -> None:
        self._bench, self._selection, self._held, self._position = bench, selection, held, position
        self._found, self._own = found, held.transfers[position - len(fit.effects) + selection.added]
        # each compared with the fit as it was found in one and the same noise floor
        self._noise = bench.noise(fit)
        self._base = bench.fit(fit.effects, self._noise, start=fit.parameters)

    def __call__(self, ways: Sequence[Effect]) -> list[tuple[Solution, Transfer]]:
        """Models with shapes in one direction, and what each is worth there, on as long as that becomes more."""
        bench, base, last = self._bench, self._base, self._found
        shown = []
        for effect in ways:
            effects = list(base.effects)
            effects[self._position] = effect
            other = bench.fit(effects, self._noise, start=base.parameters)
            worse = other.statistic - base.statistic > EQUALLY_GOOD * base.unit
            if worse or not physical(bench, other, self._position):
                break
            replaced = replace(self._selection, final=Settled(other, self._noise))
            result = self._held.worth(replaced, self._position, self._own)
            shown.append((other.solution, result))
            if result.statistic > last.statistic - EQUALLY_GOOD * last.unit:
                break
            last = result
        return shown

    def again(self, solution: Solution) -> Fit:
        """One of these models."""
        return self._bench.again(solution, self._noise)


def _other_shapes(bench: Bench, fit: Fit, position: int) -> list[list[Effect]]:
    """An effect with other shapes: larger and larger ones, smaller and smaller ones, or each that a search tries."""
    effect = fit.effects[position]
    if is_signal(effect) or isinstance(effect, ExternalForce):
        return []
    if effect.name in SHAPES_THAT_STAY:
        return [[other] for other in effect.variants(bench.state(fit.effects)) if other != effect]
    return [
        [moved(effect, shape, sign * float(np.log(factor))) for factor in OTHER_SHAPES]
        for sign in (-1.0, 1.0)
        for _, shape in free_shapes((effect,))
        if shape.logarithmic
    ]


def _better(one: Transfer, other: Transfer, behind: float = 0.0) -> bool:
    """Whether one effect does better than another on the other motion beyond doubt, and holds there.

    By so much more of the surprise as it was `behind` on the motion that was used.
    """
    if not (one.tested and one.holds):
        return False
    if other.remembers and not one.remembers and one.surprise + behind - other.surprise < EQUALLY_GOOD * one.unit:
        # what is foretold is worth more than what is fitted there
        return True
    return other.surprise - one.surprise > one.margin + behind
