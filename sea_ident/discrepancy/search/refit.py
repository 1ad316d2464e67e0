"""A model with another effect, fitted from several beginnings."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.fit import Fit
from sea_ident.discrepancy.bench.free_shapes import is_signal
from sea_ident.discrepancy.bench.judge import EQUALLY_GOOD
from sea_ident.discrepancy.bench.settle import FAR
from sea_ident.discrepancy.measured.noise import NoiseFloor
from sea_ident.discrepancy.search.candidates import Candidate
from sea_ident.discrepancy.search.described import from_described_springs
from sea_ident.discrepancy.search.edges import with_sharp_edges
from sea_ident.discrepancy.search.kinks import at_its_kink
from sea_ident.effects import Effect, Shape
from sea_ident.effects.backlash import NEARLY_HARD, Backlash
from sea_ident.effects.external_force import ExternalForce
from sea_ident.effects.signal import SignalEffect
from sea_ident.effects.spring import SpringEffect
from sea_ident.effects.torque_delay import TorqueDelay

AT_ONCE = 2
"""Candidates that are refitted at a time, whether there are cores for them or not: so the outcome is the same."""

LARGE_AMOUNT = 0.05
"""Share of its range from which on an estimate of an amount is beyond the reach of its tangent [-]: it is begun ..."""

SMALLER = 0.1
"""... with this part of it too [-]."""

SOFTER = (0.25, 0.5, 1.0, 1.4)
"""Softness of the ends of a play of which the best is a beginning too [-]: hard ends do not show how soft ones do."""

IN_SERIES = 4
"""Steps in which the width of such a play makes it one in series with its spring, ..."""

IN_ITS_SPRING = 0.05
"""... and share of the stiffness of that to which it has the same, and need not be followed further [-]."""

MOST_LAWS = 4
"""Rounds in which an effect in a spring follows the law of the spring, and the law the effect."""

BEGINS = 1.1
"""Factor between the width of a play and the least deflection of a motion within which it closes it hardly [-]."""

FAR_ABOVE = 4.0
"""Times the statistic of interest from which on the law of the spring does not make an effect the better one."""

NO_BEGINNING = 3.0
"""Times the statistic that comes of the estimate beyond which another amount is further from the truth than that."""


def refitted(
    bench: Bench,
    before: Sequence[Effect],
    effect: Effect,
    after: Sequence[Effect],
    noise: NoiseFloor,
    start: Mapping[str, float],
    beat: float = np.inf,
) -> Fit:
    """A model with one effect more, its shapes refined from the best of several beginnings.

    Args:
        bench: the recording.
        before: effects of the model that stand before it.
        effect: the effect.
        after: effects of the model that stand after it.
        noise: noise floor.
        start: parameters to start from.
        beat: statistic that is of interest; what will stay above need not be exact.

    Returns:
        The fit.
    """
    begun = [effect, *effect.beginnings()]
    if isinstance(effect, Backlash):
        begun.append(_softened(bench, before, effect, after, noise, start))
    if isinstance(effect, SignalEffect) and any(_share(effect, a) > LARGE_AMOUNT for a in effect.ranges):
        smaller = {a.name: SMALLER * float(getattr(effect, a.name)) for a in effect.amounts}
        begun.append(replace(effect, **smaller))  # type: ignore[arg-type]
    fits: list[Fit] = []
    for each in begun:
        model = (*before, each, *after)
        later = bool(fits) and not isinstance(each, Backlash)
        if later and bench.fit(model, noise, start=start, tangents=False).statistic > NO_BEGINNING * fits[0].statistic:
            continue
        if isinstance(each, ExternalForce):
            fits.append(bench.fit(model, noise, start=start))
        else:
            fits.append(bench.refine(model, noise, start=start, only=len(bench.effects), beat=beat))
    best = min(fits, key=lambda fit: (len(bench.slack_links(fit)), fit.statistic))
    if isinstance(effect, SignalEffect):
        best = from_described_springs(bench, best, len(before), noise, start, beat)
    if isinstance(effect, TorqueDelay):
        best = _where_friction_turns(bench, best, noise)
    if isinstance(effect, SpringEffect):
        best = _in_its_spring(bench, best, noise, len(before), beat)
        best = at_its_kink(bench, best, noise, len(before))
    if isinstance(effect, Backlash):
        best = _open(bench, best, noise, len(before))
    return with_sharp_edges(bench, best, noise, len(before), beat)


def _where_friction_turns(bench: Bench, fit: Fit, noise: NoiseFloor) -> Fit:
    """A model with a late torque in which friction turns as sharply as it does beside that.

    As long as the delay was missing, friction seemed to turn slowly, and with that there is little left of a delay.

    Args:
        bench: the recording.
        fit: the model with it.
        noise: noise floor.
    """
    if fit.statistic > FAR * fit.dof:
        return fit
    bent = bench.refine(fit.effects, noise, start=fit.parameters)
    return bent if bent.statistic < fit.statistic else fit


def _in_its_spring(bench: Bench, fit: Fit, noise: NoiseFloor, position: int, beat: float) -> Fit:
    """A model with an effect that knows the law of its spring, which was another one as long as the effect was missing.

    Args:
        bench: the recording.
        fit: the model.
        noise: noise floor.
        position: of the effect in it.
        beat: statistic that is of interest.
    """
    for _ in range(MOST_LAWS):
        anchored = list(fit.effects)
        own = bench.anchored(fit.effects, fit.parameters)[position]
        anchored[position] = _as_wide_as_in_its_spring(bench, own, fit) if isinstance(own, Backlash) else own
        if tuple(anchored) == fit.effects:
            break
        last, fit = fit, bench.refine(anchored, noise, start=fit.parameters, only=len(bench.effects), beat=beat)
        if abs(last.statistic - fit.statistic) < EQUALLY_GOOD or fit.statistic > FAR_ABOVE * beat:
            break
    return fit


def _softened(
    bench: Bench,
    before: Sequence[Effect],
    effect: Backlash,
    after: Sequence[Effect],
    noise: NoiseFloor,
    start: Mapping[str, float],
) -> Backlash:
    """Play with soft ends that does best of some, as wide as makes its stiffness that of the spring it is in.

    Width, softness and stiffness make up for each other along a valley, which a fit of all of them would go along in
    small steps.
    """
    best, least = effect, np.inf
    for softness in SOFTER:
        play = replace(effect, softness=softness)
        for _ in range(IN_SERIES):
            fit = bench.fit((*before, play, *after), noise, start=start, tangents=False)
            own = fit.parameters[play.parameter_name()]
            stiffness = fit.parameters.get(f"{play.joint}.spring_stiffness", 0.0)
            if not (own > 0.0 and stiffness > 0.0):
                break
            if fit.statistic < least:
                best, least = play, fit.statistic
            play = replace(play, half_width=play.half_width * own / stiffness)
    return best


def _as_wide_as_in_its_spring(bench: Bench, play: Backlash, fit: Fit) -> Backlash:
    """Play that the motion never closes as wide as makes it one in the spring that it is in.

    Its torque is then about a constant, K times the width. A fit of both ends wherever it passes on that way, at worst
    with the width at which the motion begins to close it.

    Args:
        bench: the recording.
        play: the play.
        fit: the model with it.
    """
    least, ratio = _least_deflection(bench, fit, play), _over_its_spring(fit, play)
    if not ratio > 0.0 or play.half_width > BEGINS * least:
        return play
    return replace(play, half_width=min(play.half_width * ratio, least / BEGINS))


def _open(bench: Bench, fit: Fit, noise: NoiseFloor, position: int) -> Fit:
    """Play with hard ends in the stiffness of its spring, where the motion never closes that and it does as well.

    On such a motion it is a constant torque, whatever the width. Soft ends follow a little of what else is there, with
    a stiffness that is not that of the spring, and are not what another motion shows.

    Args:
        bench: the recording.
        fit: the model with the play.
        noise: noise floor.
        position: of the play in it.
    """
    play = fit.effects[position]
    if not isinstance(play, Backlash) or not _least_deflection(bench, fit, play):
        return fit
    if play.softness <= NEARLY_HARD and abs(_over_its_spring(fit, play) - 1.0) < IN_ITS_SPRING:
        return fit
    found, tried = fit, replace(play, softness=NEARLY_HARD)
    # in the law of its spring as it was found first, then in that which it is with such a play
    for follows in (False, True):
        for _ in range(IN_SERIES):
            effects = list(found.effects)
            effects[position] = tried
            new = bench.fit(effects, noise, start=found.parameters)
            possible = tried.plausible(np.array([new.parameters[tried.parameter_name()]]), new.parameters)
            if possible and new.statistic - fit.statistic < EQUALLY_GOOD * fit.unit:
                found = new
            own = bench.anchored(new.effects, new.parameters)[position] if follows else tried
            last, tried = tried, _as_wide_as_in_its_spring(bench, own, new) if isinstance(own, Backlash) else tried
            if tried == last:
                break
    return found


def _least_deflection(bench: Bench, fit: Fit, play: Backlash) -> float:
    """The least deflection of the spring that a play is in, 0 where it deflects to both sides."""
    deflection = bench.state(fit.effects).motion.deflection[:, bench.robot.index(play.required_joint)]
    return 0.0 if np.ptp(np.sign(deflection)) else float(np.min(np.abs(deflection)))


def _over_its_spring(fit: Fit, play: Backlash) -> float:
    """Stiffness of a play over that of the spring that it is in, 0 where that has none [-]."""
    stiffness = fit.parameters.get(f"{play.joint}.spring_stiffness", 0.0)
    return fit.parameters[play.parameter_name()] / stiffness if stiffness > 0.0 else 0.0


def _share(effect: SignalEffect, amount: Shape) -> float:
    """Part of its range that an amount takes [-]."""
    return abs(float(getattr(effect, amount.name))) / max(amount.upper - amount.lower, 1e-300)


def of_every_kind(candidates: Sequence[Candidate], count: int, joint: str | None = None) -> list[Candidate]:
    """The first candidates, the first of every side of the model that is not among them, and the signals of a joint.

    A first step along a tangent flatters what has many shapes, and says little about an effect in the chain of signals
    whose amount is not small.
    """
    chosen = list(candidates[:count])
    kinds = {kind_of(c.effect) for c in chosen}
    for candidate in candidates[count:]:
        if kind_of(candidate.effect) not in kinds:
            chosen.append(candidate)
            kinds.add(kind_of(candidate.effect))
        elif joint is not None and candidate.effect.joint == joint and is_signal(candidate.effect):
            chosen.append(candidate)
    return chosen


def kind_of(effect: Effect) -> str:
    """What an effect acts on: a side of the model, or which part of the chain of signals."""
    return effect.name if is_signal(effect) else str(effect.side)
