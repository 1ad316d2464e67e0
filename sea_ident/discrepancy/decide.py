"""What one motion does not tell apart another may: equals are compared on data that were not used."""

from collections.abc import Mapping
from dataclasses import replace

from sea_ident.discrepancy.assess import Transfer
from sea_ident.discrepancy.bench import Bench
from sea_ident.discrepancy.findings import Alternative
from sea_ident.discrepancy.heldout import HeldOut, tried
from sea_ident.discrepancy.judge import EQUALLY_GOOD
from sea_ident.discrepancy.search import Selection
from sea_ident.discrepancy.settle import Settled

Alternatives = dict[int, tuple[Alternative, ...]]


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
    noise, changed = selection.final.noise, False
    for position, others in alternatives.items():
        own = held.transfers[position - first]
        left: list[Alternative] = []
        for other in others:
            fit = other.fit
            if fit is None:
                left.append(other)
                continue
            if changed:
                # it was fitted beside an effect that is out by now
                effects = list(selection.final.fit.effects)
                effects[position] = fit.effects[position]
                fit = bench.fit(effects, noise, start=selection.final.fit.parameters)
            replaced = replace(selection, final=Settled(fit, noise))
            there = tried(held.bench, replaced, held.source)
            rival = there.transfers[position - first]
            if _better(rival, own):
                selection, own, changed = replaced, rival, True
                held = replace(there, processed=held.processed, recording=held.recording, warnings=held.warnings)
                # what was no better than the one that is now out was no better than this one
                left = []
            elif not _better(own, rival):
                left.append(replace(other, fit=fit))
        kept[position] = tuple(left)
    return selection, kept, held


def _better(one: Transfer, other: Transfer) -> bool:
    """Whether one effect does better than another on the other motion beyond doubt, and holds there."""
    if not (one.tested and one.holds):
        return False
    return other.statistic - one.statistic > EQUALLY_GOOD * one.unit
