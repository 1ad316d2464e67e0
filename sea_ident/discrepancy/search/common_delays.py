"""Signals of all joints that are late by the same time: currents that another device recorded, say.

Joint by joint a search finds as many delays as there are joints, and none where little is to be seen of one. So it is
asked first whether one delay explains nearly all that is missing, and more than any effect of one joint promises.
"""

from collections.abc import Sequence

from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.judge import at_a_bound, significance
from sea_ident.discrepancy.bench.settle import Settled, settle_again
from sea_ident.discrepancy.search.candidates import Candidate, scan
from sea_ident.discrepancy.search.explained_by_one import explained_by_one, explains_nearly_all, one_promises_all
from sea_ident.discrepancy.search.next_effect import FAMILY_LEVEL
from sea_ident.discrepancy.search.refit import refitted
from sea_ident.effects import effect_classes
from sea_ident.effects.position_delay import PositionDelay
from sea_ident.effects.signal import DelayEffect
from sea_ident.effects.torque_delay import TorqueDelay
from sea_ident.robot import Robot

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
    if one_promises_all(start, candidates):
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
        better = explains_nearly_all(start, gain, candidates) and new.statistic < least
        if seen and better and not at_a_bound(new.effects[-1]) and not bench.slack_links(new):
            found, least = settle_again(bench, new), new.statistic
    if found is start:
        return start
    return start if fit.statistic - explained_by_one(bench, start, candidates) <= least else found


def common_delays(robot: Robot) -> tuple[TorqueDelay | PositionDelay, ...]:
    """All torques late, and all link encoders, where the library has delays.

    Where no joint has a spring the one is the other, backwards; where there is one joint both are its own.
    """
    if robot.n < 2:
        return ()
    elastic = any(joint.elastic for joint in robot.joints)
    delays = (TorqueDelay(), PositionDelay()) if elastic else (TorqueDelay(),)
    return tuple(delay for delay in delays if delay.name in effect_classes())
