"""Dry friction in a spring told by its first element, where the second one says nothing of its own.

On a motion that hardly bends a spring three times as far as its friction slips, only one element is seen to slip. It
may as well be the first as the second one of friction that slips at a third of that: the torque is the same, but the
numbers of the latter are those of no friction that is there. And an element that sticks all the time is a part of the
elastic law with a constant: beside another constant in that spring there is nothing left of it.
"""

from dataclasses import replace

from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.fit import Fit
from sea_ident.discrepancy.bench.judge import EQUALLY_GOOD
from sea_ident.discrepancy.bench.physics import slips_here
from sea_ident.discrepancy.measured.noise import NoiseFloor
from sea_ident.effects.offset import Offset
from sea_ident.effects.spring_hysteresis import WIDER, SpringHysteresis
from sea_ident.effects.spring_offset import SpringOffset

NOT_SEEN = 3.0
"""Standard deviations within which an element may be nothing."""


def by_the_first_element(bench: Bench, fit: Fit, noise: NoiseFloor, position: int) -> Fit:
    """A model with what slips in a spring told as its first element, where that one was nothing.

    Args:
        bench: the recording.
        fit: the model.
        noise: noise floor.
        position: of any effect in the model.

    Returns:
        The model; the same one where its first element is something, or does not do for the second.
    """
    effect = fit.effects[position]
    if not isinstance(effect, SpringHysteresis):
        return fit
    narrow = fit.slice_of(position, bench.counts(fit.effects)).start
    if abs(fit.values[narrow]) > NOT_SEEN * fit.unit**0.5 * fit.std(narrow):
        return fit
    return _unless_worse(bench, fit, noise, position, replace(effect, slip=WIDER * effect.slip))


def without_what_sticks(bench: Bench, fit: Fit, noise: NoiseFloor, position: int) -> Fit:
    """A model without the element that sticks all the time of dry friction that a constant stands beside.

    Args:
        bench: the recording.
        fit: the model.
        noise: noise floor.
        position: of any effect in the model.

    Returns:
        The model; the same one where its second element slips too, has no constant beside it, or is needed.
    """
    effect = fit.effects[position]
    if not isinstance(effect, SpringHysteresis) or effect.elements == 1 or slips_here(bench, effect)[-1]:
        return fit
    if not any(isinstance(e, SpringOffset | Offset) and e.joint == effect.joint for e in fit.effects):
        return fit
    return _unless_worse(bench, fit, noise, position, replace(effect, elements=1))


def with_its_second_element(bench: Bench, fit: Fit, noise: NoiseFloor) -> Fit:
    """A model whose last effect, friction of one element, has the second one too where that slips and is worth it."""
    effect = fit.effects[-1]
    if not isinstance(effect, SpringHysteresis) or effect.elements == 2:
        return fit
    both = (*fit.effects[:-1], replace(effect, elements=2))
    other = bench.refine(both, noise, start=fit.parameters, only=len(bench.effects))
    found = other.effects[-1]
    slips = isinstance(found, SpringHysteresis) and bool(slips_here(bench, found)[-1])
    return other if slips and fit.statistic - other.statistic > EQUALLY_GOOD * other.unit else fit


def _unless_worse(bench: Bench, fit: Fit, noise: NoiseFloor, position: int, form: SpringHysteresis) -> Fit:
    """A model with friction in another form; the same one where that leaves more, or a spring without stiffness."""
    effects = [form if k == position else effect for k, effect in enumerate(fit.effects)]
    other = bench.refine(effects, noise, start=fit.parameters, only=len(bench.effects))
    slack = len(bench.slack_links(other)) > len(bench.slack_links(fit))
    return fit if slack or other.statistic - fit.statistic > EQUALLY_GOOD * fit.unit else other
