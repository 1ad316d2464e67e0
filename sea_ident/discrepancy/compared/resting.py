"""The constant torque at which dry friction in a spring rests: a matter of how it was loaded, no effect of its own.

An element of spring and dry friction that does not slip on a motion keeps a constant of the time before. A search finds
it beside the friction, and calls it by the first effect that is a constant in that spring: an offset of an encoder, or
play that is never closed. On another motion the friction rests elsewhere.
"""

from dataclasses import replace

from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.columns import effect_key
from sea_ident.discrepancy.bench.settle import Settled
from sea_ident.discrepancy.compared.decide import Alternatives
from sea_ident.discrepancy.compared.heldout import HeldOut
from sea_ident.discrepancy.result.findings import Alternative
from sea_ident.discrepancy.search.search import Selection
from sea_ident.effects.spring_hysteresis import SpringHysteresis
from sea_ident.effects.spring_offset import SpringOffset


def resting(selection: Selection, held: HeldOut | None) -> tuple[int, ...]:
    """Which of the effects that were added are constants in springs that dry friction may keep.

    Args:
        selection: what was found.
        held: the data that were not used; a constant that is the same on another motion is one.

    Returns:
        Positions among the effects that were added.
    """
    slipping = selection.joints_of(SpringHysteresis)
    return tuple(
        k
        for k, effect in enumerate(selection.effects)
        if isinstance(effect, SpringOffset) and effect.joint in slipping and not _confirmed(held, k)
    )


def with_constants_at_rest(
    bench: Bench, selection: Selection, alternatives: Alternatives, held: HeldOut | None
) -> tuple[Selection, Alternatives, HeldOut | None]:
    """What is no more than a constant beside dry friction in the same spring, as a constant of that spring.

    Args:
        bench: the recording.
        selection: what was found.
        alternatives: what else each effect could be, by its position in the model.
        held: the data that were not used.

    Returns:
        The selection with such constants, what else each effect that is named could be, and what the selection is worth
        on the data that were not used.
    """
    slipping = selection.joints_of(SpringHysteresis)
    first = len(selection.final.fit.effects) - selection.added
    left, changed = dict(alternatives), False
    for position, others in alternatives.items():
        alike = [a for a in others if a.effect == SpringOffset.name and a.joint in slipping]
        now = selection.final
        if not alike or _confirmed(held, position - first):
            continue
        effects, own, constant = list(now.fit.effects), now.fit.effects[position], SpringOffset(alike[0].joint)
        if effect_key(constant) in {effect_key(effect) for effect in effects}:
            continue
        effects[position] = constant
        fit = bench.fit(effects, now.noise, start=now.fit.parameters)
        selection, changed = replace(selection, final=Settled(fit, bench.noise(fit))), True
        out = Alternative(own.name, own.joint, alike[0].cos2, now.fit)
        left[position] = (out, *(a for a in others if a is not alike[0]))
    if changed and held is not None:
        held = held.again(selection)
    at_rest = {first + k for k in resting(selection, held)}
    return selection, {position: others for position, others in left.items() if position not in at_rest}, held


def _confirmed(held: HeldOut | None, k: int) -> bool:
    """Whether the effect that was added at this place was tested on another motion, and holds there."""
    if held is None or not held.other_motion or not held.transfers:
        return False
    return held.transfers[k].tested and held.transfers[k].holds
