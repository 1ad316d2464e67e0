"""Dry friction in a spring and a constant torque in it, which come together and are not found one after the other.

Friction rests anywhere, and an encoder has a zero: a spring that rubs has a constant beside its friction more often
than not. Without the constant the elements that stick stand in for it, as springs that pull the wrong way; without the
friction the constant explains little, and the law of the spring bends to whatever comes next.
"""

from collections.abc import Sequence

from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.fit import Fit
from sea_ident.discrepancy.bench.judge import EQUALLY_GOOD, at_a_bound, significance
from sea_ident.discrepancy.bench.physics import physical
from sea_ident.discrepancy.bench.settle import Settled
from sea_ident.discrepancy.search.candidates import Candidate, scan
from sea_ident.discrepancy.search.next_effect import FAMILY_LEVEL
from sea_ident.discrepancy.search.refit import refitted
from sea_ident.discrepancy.search.slips import with_its_second_element
from sea_ident.effects import Effect, effect_classes
from sea_ident.effects.offset import Offset
from sea_ident.effects.spring_hysteresis import SpringHysteresis
from sea_ident.effects.spring_offset import SpringOffset

HOPEFUL = 0.5
"""Share of the excess that a first step must promise of both [-]."""

LEAVES = 0.3
"""Share of what the best single effect leaves that both may leave, to be taken in its place [-]."""


def both_at_once(
    bench: Bench, now: Settled, candidates: Sequence[Candidate], single: Fit | None, tests: int
) -> tuple[Fit, float] | None:
    """The model with friction and a constant in one spring, where that is better than any one effect.

    Args:
        bench: the recording.
        now: the model.
        candidates: the effects of the library around it.
        single: the model with the best single effect; None where there is none.
        tests: number of shapes of all candidates.

    Returns:
        The model and the significance of both; None where one effect does, or both are not possible.
    """
    fit, noise = now.fit, now.noise
    rubs = single is not None and isinstance(single.effects[-1], SpringHysteresis) and not physical(bench, single, -1)
    best = fit if single is None else single
    began = [_begun(bench, now, joint) for joint in _springs(bench, now, candidates, tests)]
    if not began:
        return None
    begun, candidate = max(began, key=lambda each: each[1].gain - each[0].statistic)
    if begun.statistic - candidate.gain > fit.statistic - HOPEFUL * fit.excess:
        return None
    new = with_its_second_element(
        bench, refitted(bench, begun.effects, candidate.effect, (), noise, begun.parameters), noise
    )
    if at_a_bound(new.effects[-1]) or len(bench.slack_links(new)) > len(bench.slack_links(fit)):
        return None
    if not (physical(bench, new, -1) and physical(bench, new, -2)):
        return None
    p_value = significance(fit.statistic - new.statistic, 2, tests, fit, noise)
    better = new.excess < LEAVES * best.excess and best.statistic - new.statistic > EQUALLY_GOOD * best.unit
    as_good = rubs and new.statistic < best.statistic + EQUALLY_GOOD * best.unit
    return (new, p_value) if p_value <= FAMILY_LEVEL and (better or as_good) else None


def _springs(bench: Bench, now: Settled, candidates: Sequence[Candidate], tests: int) -> list[str]:
    """Joints in whose springs either explains something, and the model has neither."""
    fit, noise = now.fit, now.noise
    if not {SpringHysteresis.name, SpringOffset.name} <= effect_classes().keys():
        return []
    taken = {effect.joint for effect in fit.effects if isinstance(effect, SpringHysteresis | SpringOffset | Offset)}
    seen = {
        candidate.effect.joint
        for candidate in candidates
        if isinstance(candidate.effect, SpringHysteresis | SpringOffset)
        and significance(candidate.gain, candidate.columns, tests, fit, noise) <= FAMILY_LEVEL
    }
    return [name for name in bench.robot.joint_names if name in seen - taken]


def _begun(bench: Bench, now: Settled, joint: str) -> tuple[Fit, Candidate]:
    """The model with a constant in a spring, and what friction in that promises beside it."""
    effects: tuple[Effect, ...] = (*now.fit.effects, SpringOffset(joint))
    fit = bench.fit(effects, now.noise, start=now.fit.parameters)
    return fit, scan(bench, fit, now.noise, [SpringHysteresis(joint, elements=1)])[0]
