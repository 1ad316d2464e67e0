"""A constant torque of a spring that is none in another motion: dry friction in it remembers.

An element of spring and dry friction that does not slip is elastic. It adds to the stiffness of the spring, and where
it slipped last to its zero. On one motion that is a constant in the spring, and is to be called one. Where another
motion finds another constant there, or the element slips there, nothing constant is missing: such an element does that,
and nothing else that the library has. Where it slips is then read from the other motion.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.columns import effect_key
from sea_ident.discrepancy.bench.fit import Fit
from sea_ident.discrepancy.bench.judge import EQUALLY_GOOD
from sea_ident.discrepancy.bench.settle import Settled
from sea_ident.discrepancy.compared.heldout import HeldOut
from sea_ident.discrepancy.result.findings import Alternative
from sea_ident.discrepancy.search.search import Selection
from sea_ident.effects import Effect, effect_classes
from sea_ident.effects.spring_hysteresis import SpringHysteresis
from sea_ident.effects.spring_offset import SpringOffset
from sea_ident.side_by_side import side_by_side

CONFIRMED = 0.99
"""Share of what a constant could explain on another motion from which on it is the same there [-]: to a tenth of it."""

MOST_OF_IT = 0.5
"""Share that such an element must explain of what the constant fails to explain there, or of all that is left there
where the constant is the same [-]."""

STICKS = (0.5, 0.75, 1.0, 1.5, 2.0)
"""Deflections from which on an element does not slip to and fro, as shares of the travel of its spring [-]."""

BARELY = 1.001
"""Factor that keeps an element that is about to slip from it [-]."""

SLIPS = (0.05, 1.0)
"""Those at which it may slip on the other motion for all that the one that was used shows: that may go to and fro once
and press on after [-], ..."""

TRIED = 20
"""... how many of them are tried there, ..."""

REFINED = 3
"""... and how many of these are refined."""


def remembering(bench: Bench, selection: Selection, held: HeldOut, position: int) -> Alternative | None:
    """A spring with dry friction that does not slip in place of a constant in it that another motion does not confirm.

    Args:
        bench: the recording that was used.
        selection: what was found on it.
        held: the other motion.
        position: of the effect in the model.

    Returns:
        The alternative, with the deflection at which it slips that does best on the other motion; None where the effect
        is no constant of a spring, where it holds, or where such a spring does not do as well.
    """
    now = selection.final.fit
    effect, found = now.effects[position], held.transfers[position - len(now.effects) + selection.added]
    if not isinstance(effect, SpringOffset) or not found.tested:
        return None
    if found.excess < EQUALLY_GOOD * found.unit or SpringHysteresis.name not in effect_classes():
        return None
    if effect_key(SpringHysteresis(effect.joint)) in {effect_key(each) for each in now.effects}:
        return None
    travel = float(np.ptp(bench.state(now.effects).motion.deflection[:, bench.robot.index(effect.required_joint)]))
    sticking, slipping = (
        [SpringHysteresis(effect.joint, float(share) * travel) for share in shares]
        for shares in (BARELY * np.array(STICKS), np.geomspace(*SLIPS, TRIED))
    )
    tried: list[tuple[Effect, Mapping[str, float]]] = [(element, now.parameters) for element in sticking]
    tried.extend((f.effects[position], f.parameters) for f in _on_the_other(held, selection, position, slipping))
    fits = [fit for element, start in tried if (fit := _here(bench, selection, position, element, start)) is not None]

    def left(fit: Fit) -> float:
        return held.worth(replace(selection, final=Settled(fit, selection.final.noise)), position, found).excess

    best = min(zip(side_by_side(left, fits), range(len(fits)), strict=True), default=None)
    # what else is missing there bends the constant as well
    failed = found.excess if found.share > CONFIRMED else min((1.0 - found.share) * found.possible, found.excess)
    if best is None or found.excess - best[0] < MOST_OF_IT * failed:
        return None
    # the best of many takes some of what is noise there
    if found.excess - best[0] < (EQUALLY_GOOD + 2.0 * np.log(len(fits))) * found.unit:
        return None
    return Alternative(SpringHysteresis.name, effect.joint, 1.0, fits[best[1]], dearer=True)


def _on_the_other(held: HeldOut, selection: Selection, position: int, elements: Sequence[Effect]) -> list[Fit]:
    """A selection with the best of some elements at a position, fitted to the other motion: what slips shows there."""
    final, noise = selection.final.fit, held.noise
    fits = []
    for element in elements:
        effects = list(final.effects)
        effects[position] = element
        fits.append(held.bench.fit(effects, noise, start=final.parameters, tangents=False))
    fits.sort(key=lambda fit: fit.statistic)
    return [held.bench.refine(fit.effects, noise, start=fit.parameters, only=position) for fit in fits[:REFINED]]


def _here(bench: Bench, selection: Selection, position: int, element: Effect, start: Mapping[str, float]) -> Fit | None:
    """A selection with an element at a position; None where it does not do as well on the motion that was used.

    What that does not tell, as which of two that do not slip is the stiffer one, stays about as it was at the start.
    """
    now = selection.final.fit
    effects = list(now.effects)
    effects[position] = element
    fit = bench.fit(effects, selection.final.noise, start=start)
    if fit.statistic - now.statistic > EQUALLY_GOOD * now.unit:
        return None
    stiff = fit.parameters[f"{element.joint}.spring_stiffness"] > 0.0
    if not stiff or any(fit.parameters[column.name] < 0.0 for column in element.columns(bench.robot)):
        return None
    return fit
