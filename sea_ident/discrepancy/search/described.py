"""Errors in the chain of signals, begun with springs that are about what the robot's description says.

A large error of an encoder is a large torque of a spring that is not there. A model without it bends its springs to
do without that torque, until they have lost their stiffness or their sign, and from there no small step leads to the
error. From springs that are known to a part of themselves the way is straight.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.fit import Fit
from sea_ident.discrepancy.bench.linear import solve
from sea_ident.discrepancy.measured.noise import NoiseFloor
from sea_ident.effects import Effect, Side
from sea_ident.effects.signal import SignalEffect
from sea_ident.regressor import prior_parameters

DESCRIBED_WITHIN = 0.2
"""Standard deviation of a spring from its description, as a share of it [-]: what tolerances and ageing make of it."""

MOST_ROUNDS = 10
"""Largest number of Gauss-Newton steps."""

STANDS = 1e-3
"""A step that takes less than this share of what is left was the last [-]."""

FAR_OFF = 30.0
"""Times the statistic of interest from which on an effect that ended in the wrong place is not begun again [-]."""

NEAR = 4
"""Rounds in which a fit that was begun in the right place arrives."""

BENT = 1.5
"""Factor between the stiffness of a spring and its description beyond which a model has bent it [-]."""

ELSEWHERE = 0.2
"""Share of an amount from which on a difference makes it another place [-]."""


@dataclass(frozen=True, eq=False)
class Beginning:
    """Where a fit begins.

    Attributes:
        effect: the effect with its amounts.
        parameters: of the model, by name.
        left: (M,) residual, every equation in units of its own torque [-].
    """

    effect: SignalEffect
    parameters: dict[str, float]
    left: FloatArray


def from_described_springs(
    bench: Bench, fit: Fit, position: int, noise: NoiseFloor, start: Mapping[str, float], beat: float = np.inf
) -> Fit:
    """A model whose effect in the chain of signals may have ended in the wrong place, begun from described springs.

    Args:
        bench: the recording.
        fit: the model.
        position: of the effect in it.
        noise: noise floor.
        start: parameters that the fit was begun from.
        beat: statistic that is of interest; what will stay above need not be exact.

    Returns:
        The fit that comes of the other beginning where springs have bent, that is another place and better; else the
        fit as it is.
    """
    if fit.statistic > FAR_OFF * beat:
        return fit
    before, effect, after = fit.effects[:position], fit.effects[position], fit.effects[position + 1 :]
    if not isinstance(effect, SignalEffect) or not any(
        _bent(bench, effect, known) for known in (start, fit.parameters)
    ):
        return fit
    begun = begin_as_described(bench, before, effect, after)
    if begun is None or not _elsewhere(effect, begun.effect):
        return fit
    if np.linalg.norm(begun.left) > np.linalg.norm(bench.whitening(None).flat(fit.residual)):
        return fit
    model = (*before, begun.effect, *after)
    # the noise floor of a model that has bent its springs is as wrong as they are
    own = bench.noise(bench.predicted(model, begun.parameters))
    right = bench.refine(model, own, start=begun.parameters, only=len(bench.effects), rounds=NEAR)
    least = min(beat, fit.statistic)
    new = bench.refine(right.effects, noise, start=right.parameters, only=len(bench.effects), beat=least)
    return min((fit, new), key=lambda one: (len(bench.slack_links(one)), one.statistic))


def _bent(bench: Bench, effect: SignalEffect, parameters: Mapping[str, float]) -> bool:
    """Whether the spring at the joint of an effect is further from its description than springs are."""
    stiffness = parameters.get(f"{effect.joint}.spring_stiffness")
    if effect.joint is None or stiffness is None:
        return False
    described = bench.robot.spring(effect.joint).stiffness
    return described is not None and not 1.0 / BENT < stiffness / described < BENT


def _elsewhere(one: SignalEffect, other: SignalEffect) -> bool:
    """Whether the amounts of two differ by more than two steps on one way do."""
    pairs = [(float(getattr(one, amount.name)), float(getattr(other, amount.name))) for amount in one.amounts]
    return any(abs(here - there) > ELSEWHERE * max(abs(here), abs(there)) for here, there in pairs)


def begin_as_described(
    bench: Bench, before: Sequence[Effect], effect: SignalEffect, after: Sequence[Effect]
) -> Beginning | None:
    """Amounts of an effect in the chain of signals, with springs that stay near their description as long as need be.

    All equations count alike, and what is left sets how much the description counts beside them: at first, where the
    amounts are wrong, all; in the end, where only noise is left, nothing.

    Args:
        bench: the recording.
        before: effects of the model that stand before it.
        effect: the effect; its amounts begin at zero.
        after: effects of the model that stand after it.

    Returns:
        The beginning; None where the description gives no spring at the joint of the effect.
    """
    columns = bench.labels((*before, *after))
    described = np.nan_to_num(prior_parameters(bench.robot, (*before, *after)))
    spring = np.array([column.side is Side.SPRING for column in columns], dtype=bool)
    held = np.flatnonzero(spring & (described != 0.0))
    if not any(columns[k].joint == effect.joint for k in held):
        return None
    flat = bench.whitening(None).flat
    ranges = np.array([amount.upper - amount.lower for amount in effect.ranges])
    now = replace(effect, **{amount.name: 0.0 for amount in effect.amounts})  # type: ignore[arg-type]
    design = flat(bench.design((*before, now, *after)))
    values = described.copy()
    known_part = {column.name: float(value) for column, value in zip(columns, values, strict=True)}
    target = flat(bench.predicted((*before, now, *after), known_part).residual) + design @ described
    values[~spring] = solve(design[:, ~spring], target - design[:, spring] @ described[spring])[0]
    left = target - design @ values
    size = float(np.sqrt(np.mean(left**2)))
    for _ in range(MOST_ROUNDS):
        model = (*before, now, *after)
        parameters = {column.name: float(value) for column, value in zip(columns, values, strict=True)}
        bent = [bench.signal_tangent(now, amount, model, parameters)[0] for amount in now.ranges]
        whole = np.concatenate([design, flat(np.stack(bent, axis=2)) * ranges], axis=1)
        weight = size / (DESCRIBED_WITHIN * np.abs(described[held]))
        known = np.zeros((len(held), whole.shape[1]))
        known[np.arange(len(held)), held] = weight
        missing = weight * (described[held] - values[held])
        step = solve(np.concatenate([whole, known]), np.concatenate([left, missing]))[0]
        values = values + step[: len(values)]
        now = _moved(now, step[len(values) :] * ranges)
        design = flat(bench.design((*before, now, *after)))
        left = target - design @ values
        last, size = size, float(np.sqrt(np.mean(left**2)))
        if abs(last - size) < STANDS * size:
            break
    return Beginning(now, {c.name: float(v) for c, v in zip(columns, values, strict=True)}, left)


def _moved(effect: SignalEffect, steps: FloatArray) -> SignalEffect:
    """The effect with its amounts changed, as far as their ranges allow."""
    values = {
        amount.name: float(np.clip(getattr(effect, amount.name) + step, amount.lower, amount.upper))
        for amount, step in zip(effect.ranges, steps, strict=True)
    }
    return replace(effect, **values)  # type: ignore[arg-type]
