"""What one motion does not tell apart another may: equals are compared on data that were not used."""

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from sea_ident.discrepancy.bench import Bench
from sea_ident.discrepancy.columns import effect_key
from sea_ident.discrepancy.findings import Alternative
from sea_ident.discrepancy.fit import Fit
from sea_ident.discrepancy.free_shapes import SHAPES_THAT_STAY, free_shapes, is_signal, moved
from sea_ident.discrepancy.heldout import HeldOut
from sea_ident.discrepancy.judge import EQUALLY_GOOD, penalty, physical
from sea_ident.discrepancy.remembering import remembering
from sea_ident.discrepancy.search import Selection
from sea_ident.discrepancy.settle import Settled
from sea_ident.discrepancy.transfer import Transfer
from sea_ident.effects import Effect
from sea_ident.effects.external_force import ExternalForce

Alternatives = dict[int, tuple[Alternative, ...]]

CLEARLY = 1.0
"""What a simpler effect must save, in units of the statistic."""

UNDECIDED = 0.1
"""Share of what neither explains on the other motion that a difference between two must exceed [-]: something else is
wrong there, and could lean to either."""

OTHER_SHAPES = (1.5, 2.0, 3.0, 4.0)
"""Factors by which a shape is moved where it may be open."""


def declared(alternatives: Mapping[int, tuple[Alternative, ...]]) -> Alternatives:
    """The alternatives of each effect that are as likely where no other motion decides."""
    return {position: tuple(a for a in others if not a.dearer) for position, others in alternatives.items()}


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
            if other.fit is None or _twice(other.fit, position, selection.added):
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
    changed = False
    for position, others in alternatives.items():
        if not changed:
            selection, held = _with_its_best_shape(bench, selection, held, position)
        own = held.transfers[position - first]
        left: list[Alternative] = []
        memory = remembering(bench, selection, held, position)
        for other in others if memory is None else (*others, memory):
            fit = other.fit
            if fit is None:
                left.append(other)
                continue
            if other.dearer and own.excess < EQUALLY_GOOD * own.unit:
                # nothing there that more parameters could explain
                continue
            if changed:
                # it was fitted beside an effect that is out by now
                fit = _beside(bench, selection, position, fit)
            if _twice(fit, position, selection.added):
                continue
            replaced = replace(selection, final=Settled(fit, selection.final.noise))
            rival = held.worth(replaced, position)
            if _better(rival, own):
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
            elif not _better(own, rival):
                left.append(replace(other, fit=fit))
                continue
            same = _with_another_shape(bench, selection, held, position, fit, rival)
            if same is not None:
                left.append(replace(other, fit=same))
        kept[position] = tuple(left)
    return selection, kept, held


def _with_another_shape(
    bench: Bench, selection: Selection, held: HeldOut, position: int, fit: Fit, found: Transfer
) -> Fit | None:
    """A fit whose effect the other motion rules out, with a shape with which it does not; None where there is none."""
    own = held.transfers[position - len(selection.final.fit.effects) + selection.added]
    for other, result in _open_shapes(bench, selection, held, position, fit, found):
        if not _better(own, result):
            return other
    return None


def _with_its_best_shape(bench: Bench, selection: Selection, held: HeldOut, position: int) -> tuple[Selection, HeldOut]:
    """A selection with the shape of one effect that holds best on the other motion, of those that the first allows."""
    fit = selection.final.fit
    best = held.transfers[position - len(fit.effects) + selection.added]
    if best.excess < EQUALLY_GOOD * best.unit:
        return selection, held
    chosen = selection
    for other, result in _open_shapes(bench, selection, held, position, fit, best):
        if _better(result, best):
            best, chosen = result, replace(selection, final=Settled(other, selection.final.noise))
    return chosen, held if chosen is selection else held.again(chosen)


def _open_shapes(
    bench: Bench, selection: Selection, held: HeldOut, position: int, fit: Fit, found: Transfer
) -> Iterator[tuple[Fit, Transfer]]:
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

    Yields:
        The model with another shape, and what it is worth on the other motion; the next one in a direction only where
        the last was better.
    """
    # each compared with the fit as it was found in one and the same noise floor
    noise = bench.noise(fit)
    base = bench.fit(fit.effects, noise, start=fit.parameters)
    enough = EQUALLY_GOOD * base.unit
    for ways in _other_shapes(bench, fit, position):
        last = found
        for effect in ways:
            effects = list(fit.effects)
            effects[position] = effect
            other = bench.fit(effects, noise, start=base.parameters)
            if other.statistic - base.statistic > enough or not physical(bench, other, position):
                break
            result = held.worth(replace(selection, final=Settled(other, noise)), position)
            yield other, result
            if result.statistic > last.statistic - EQUALLY_GOOD * last.unit:
                break
            last = result


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


def _better(one: Transfer, other: Transfer) -> bool:
    """Whether one effect does better than another on the other motion beyond doubt, and holds there."""
    if not (one.tested and one.holds):
        return False
    if other.remembers and not one.remembers and one.statistic - other.statistic < EQUALLY_GOOD * one.unit:
        # what is foretold is worth more than what is fitted there
        return True
    return other.statistic - one.statistic > max(EQUALLY_GOOD * one.unit, UNDECIDED * one.excess)
