"""Signals of all joints that are late by the same time: currents that another device recorded, say.

Joint by joint a search finds as many delays as there are joints, and none where little is to be seen of one. So it is
asked first whether one delay explains nearly all that is missing, and more than any effect of one joint promises.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sea_ident.discrepancy.bench import Bench
from sea_ident.discrepancy.candidates import Candidate, scan
from sea_ident.discrepancy.explained_by_one import explained_by_one
from sea_ident.discrepancy.judge import EQUALLY_GOOD, at_a_bound, penalty, significance
from sea_ident.discrepancy.next_effect import FAMILY_LEVEL
from sea_ident.discrepancy.refit import refitted
from sea_ident.discrepancy.settle import Settled, settle_again
from sea_ident.effects import Effect, effect_classes
from sea_ident.effects.position_delay import PositionDelay
from sea_ident.effects.signal import DelayEffect
from sea_ident.effects.torque_delay import TorqueDelay
from sea_ident.robot import Robot

PROMISED = 0.95
"""Share of the excess from which on an effect of one joint that promises it is the one that is missing [-]."""

NEARLY_ALL = 0.8
"""Share of the excess that one delay must explain, and more than any other effect promises [-]."""

HOPEFUL = 0.3
"""Share of the excess that a first step must promise: of a delay that is not short it says too little [-]."""


def with_a_common_delay(bench: Bench, start: Settled, candidates: Sequence[Candidate], tests: int) -> Settled:
    """A model with all torques or all link encoders late, where that explains nearly all that is missing.

    Args:
        bench: the recording.
        start: the model.
        candidates: the effects of the library around it, best first.
        tests: number of their shapes.

    Returns:
        The model, settled; as it was where it does not.
    """
    fit, noise = start.fit, start.noise
    promised = candidates[0].gain if candidates else 0.0
    if promised >= PROMISED * fit.excess:
        return start
    present = {type(effect) for effect in fit.effects if isinstance(effect, DelayEffect) and effect.joint is None}
    kinds = [effect for effect in common_delays(bench.robot) if type(effect) not in present]
    found, least = start, fit.statistic
    for candidate in scan(bench, fit, noise, kinds):
        if candidate.gain < HOPEFUL * fit.excess:
            break
        new = refitted(bench, fit.effects, candidate.effect, (), noise, fit.parameters)
        gain = fit.statistic - new.statistic
        seen = significance(gain, 1, tests, fit, noise) <= FAMILY_LEVEL
        better = gain > max(NEARLY_ALL * fit.excess, promised) and new.statistic < least
        if seen and better and not at_a_bound(new.effects[-1]) and not bench.slack_links(new):
            found, least = settle_again(bench, new), new.statistic
    if found is start:
        return start
    return start if fit.statistic - explained_by_one(bench, start, candidates) <= least else found


def as_one_delay(bench: Bench, now: Settled, added: int) -> tuple[Settled, list[int]]:
    """A model with one delay of all joints in the place of those of joints that were added, where that does as well.

    Where one joint shows its delay so much more than the others that it promises nearly all, they are found one by one.

    Args:
        bench: the recording.
        now: the model.
        added: number of effects added, its last ones.

    Returns:
        The model, and which of the effects that were added are left; the first of several stands for all.
    """
    left = list(range(added))
    for whole in common_delays(bench.robot):
        fit = now.fit
        first = len(fit.effects) - len(left)
        own = [k for k in range(first, len(fit.effects)) if _is_at_a_joint(fit.effects[k], whole)]
        if not own or any(type(e) is type(whole) and e.joint is None for e in fit.effects):
            continue
        delays = [effect.delay for k in own if isinstance(effect := fit.effects[k], TorqueDelay | PositionDelay)]
        begun = replace(whole, delay=float(np.median(delays)))
        effects = [begun if k == own[0] else e for k, e in enumerate(fit.effects) if k not in own[1:]]
        new = bench.refine(effects, now.noise, start=fit.parameters, only=len(bench.effects))
        spared = sum(penalty(fit.effects[k], bench) for k in own) - penalty(new.effects[own[0]], bench)
        # one that is as good as one of a joint is not the simpler one
        price = spared if len(own) > 1 else -EQUALLY_GOOD
        if new.statistic < fit.statistic + fit.unit * price and not at_a_bound(new.effects[own[0]]):
            now = settle_again(bench, new)
            left = [k for k in left if k + first not in own[1:]]
    return now, left


def _is_at_a_joint(effect: Effect, whole: DelayEffect) -> bool:
    """Whether an effect is a delay of the same kind at one joint, and no more than a delay."""
    return type(effect) is type(whole) and effect.joint is not None and not getattr(effect, "lag", 0.0)


def common_delays(robot: Robot) -> tuple[TorqueDelay | PositionDelay, ...]:
    """All torques late, and all link encoders, where the library has delays.

    Where no joint has a spring the one is the other, backwards; where there is one joint both are its own.
    """
    if robot.n < 2:
        return ()
    elastic = any(joint.elastic for joint in robot.joints)
    delays = (TorqueDelay(), PositionDelay()) if elastic else (TorqueDelay(),)
    return tuple(delay for delay in delays if delay.name in effect_classes())
