"""A model in the noise floor that belongs to it."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.fit import Fit, Solution
from sea_ident.discrepancy.measured.noise import NoiseFloor
from sea_ident.effects import Effect
from sea_ident.regressor import prior_parameters
from sea_ident.side_by_side import side_by_side

FAR = 3.0
"""Statistic over degrees of freedom beyond which the shapes of the model are left alone, for they would bend to the
misfit, ..."""

BENT = 0.7
"""... unless that leaves less than this share of the excess: then they were what is wrong, ..."""

MORE_ROUNDS = 8
"""Rounds more that a noise floor and a fit may take where steps of encoders, which a fit weighs by its inertias, make
up most of the floor, ..."""

CONSISTENT = 1.0
"""... until the floor has about what the fit makes of these steps: their share of it is one at most [-]."""

NEARLY_LOST = 0.05
"""Share of the stiffness of a first fit below which a spring is as good as lost [-]: a step of a fit seldom passes
`LEAST_STIFFNESS`, and one that loses a spring ends there."""

LEAVES_MORE = 1.2
"""Factor by which the statistic over degrees of freedom may grow where fewer samples are compared [-]."""

STANDS = 0.98
"""Ratio of two statistics over degrees of freedom in turn from which on a model stands still [-], ..."""

MOST_SETTLINGS = 3
"""... or rounds after which it is as it is."""

ANCHORED = 0.3
"""Size, in standard deviations of the noise, of a change that effects are not made to follow any more [-]: an estimate
is off by that at most, ..."""

MOST_ANCHORINGS = 8
"""... or rounds after which they are as they are."""

COMMON = 2.5
"""... or they change by less than this factor: as much as one motor may differ from another."""


@dataclass(frozen=True, eq=False)
class Settled:
    """A model fitted in a noise floor that belongs to it.

    Attributes:
        fit: the fit.
        noise: the floor that it was fitted in.
    """

    fit: Fit
    noise: NoiseFloor


def settle(bench: Bench, effects: Sequence[Effect], rounds: int = 2) -> Settled:
    """Fit a model and find its noise floor in turn, from nothing."""
    fit = bench.first_fit if tuple(effects) == bench.effects else bench.fit(effects, None, tangents=False)
    settled = Settled(fit, bench.noise(fit))
    for _ in range(rounds):
        settled = settle_again(bench, settled.fit)
    for _ in range(MORE_ROUNDS):
        if bench.share_of_steps(settled.fit, settled.noise) <= CONSISTENT:
            break
        settled = settle_again(bench, settled.fit)
    lost = _lost_springs(bench, settled.fit)
    if any(lost):
        # a model that lacks much may lose a spring from here, and keep it from where the description puts it
        described = np.nan_to_num(prior_parameters(bench.robot, settled.fit.effects))
        known = {c.name: float(v) for c, v in zip(fit.columns, described, strict=True)}
        other = Settled(bench.fit(settled.fit.effects, settled.noise, start=known), settled.noise)
        for _ in range(rounds):
            other = settle_again(bench, other.fit)
        if _lost_springs(bench, other.fit) < lost:
            return other
    return settled


def _lost_springs(bench: Bench, fit: Fit) -> tuple[int, int]:
    """How many springs have lost their stiffness in a fit, and how many have nearly lost it."""
    return len(bench.slack_links(fit)), len(bench.slack_links(fit, NEARLY_LOST))


def settle_again(bench: Bench, fit: Fit, noise: NoiseFloor | None = None) -> Settled:
    """Noise floor of a fit, or a given one, and the fit refined in it."""
    noise = bench.noise(fit) if noise is None else noise
    anchored = bench.anchored(fit.effects, fit.parameters)
    bench.release(anchored)

    def refined(only: int) -> Solution:
        return bench.refine(anchored, noise, start=fit.parameters, only=only).solution

    whole, added = 0, len(bench.effects)
    # where it is far, both will be wanted
    far = bench.statistic(fit, noise) > FAR * fit.dof
    ways: Iterator[Solution] = side_by_side(refined, (whole, added)) if far else map(refined, (whole, added))
    bent = bench.again(next(ways), noise)
    if bent.statistic > FAR * bent.dof:
        straight = bench.again(next(ways), noise)
        if bent.excess > BENT * straight.excess and far_from(bent.effects, bench.effects):
            return Settled(straight, noise)
    return Settled(bent, noise)


def settled_down(bench: Bench, now: Settled) -> Settled:
    """A model with its noise floor and what depends on its parameters, followed until they stand still."""
    for _ in range(MOST_SETTLINGS):
        before = now.fit
        now = settle_again(bench, before)
        if now.fit.statistic / now.fit.dof > STANDS * before.statistic / before.dof:
            break
    return now


def settled_elsewhere(bench: Bench, fit: Fit) -> Settled:
    """A model that was settled with other samples left out, settled in these.

    The first floor is that of its residual as it was there. A model that explained all there and leaves more here may
    be held against a floor that is not its own: those after it tell.
    """
    now = settle_again(bench, fit)
    leaves_more = now.fit.statistic / now.fit.dof > LEAVES_MORE * fit.statistic / fit.dof
    return settled_down(bench, now) if fit.statistic < FAR * fit.dof and leaves_more else now


def settled_in_form(
    bench: Bench, now: Settled, first: int, formed: Callable[[Bench, Fit, NoiseFloor, int], Fit]
) -> Settled:
    """A settled model whose effects have the form that a function gives each of them.

    Args:
        bench: the recording.
        now: the model.
        first: position of the first effect that may change.
        formed: gives a fit the form of its effect at a position; the fit itself where that has it.

    Returns:
        The model, settled; the same one where all have their form.
    """
    fit = now.fit
    for position in range(first, len(fit.effects)):
        fit = formed(bench, fit, now.noise, position)
    return now if fit is now.fit else settle_again(bench, fit)


def anchored_in_itself(bench: Bench, now: Settled) -> Settled:
    """A model that explains the recording, its effects as they are with what the model says of loads and springs.

    An effect that depends on the rest of the model, or on its own size, was found with what that was a fit before.
    Where each round leaves a quarter of the error, it takes a handful until that is less than what noise does.

    Args:
        bench: the recording.
        now: the model; one that lacks more is left as it is, for its sizes are wrong by what it lacks.
    """
    for _ in range(MOST_ANCHORINGS):
        if now.fit.statistic > FAR * now.fit.dof or _still_to_follow(bench, now) < ANCHORED:
            break
        now = settle_again(bench, now.fit)
    return now


def _still_to_follow(bench: Bench, now: Settled) -> float:
    """By how much the torque of a model changes where its effects follow it, in standard deviations of noise [-]."""
    fit = now.fit
    anchored = bench.anchored(fit.effects, fit.parameters)
    if anchored == fit.effects:
        return 0.0
    change = (bench.design(anchored) - bench.design(fit.effects)) @ fit.values
    return float(np.linalg.norm(bench.whitening(now.noise).flat(change * fit.scale)))


def far_from(effects: Sequence[Effect], usual: Sequence[Effect]) -> bool:
    """Whether a shape of the first effects of a model is further from the usual one than shapes commonly are."""
    for one, other in zip(effects, usual, strict=False):
        for shape in one.shapes:
            pair = float(getattr(one, shape.name)), float(getattr(other, shape.name))
            if shape.logarithmic and not 1.0 / COMMON < pair[0] / pair[1] < COMMON:
                return True
    return False
