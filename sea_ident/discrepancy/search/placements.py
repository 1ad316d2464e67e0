"""Joints that are elsewhere than the description says: what may be missing before anything else.

Where a joint is bends the torque of all joints before it, by the bodies that it carries. Step by step a search would
take it for whatever is alike in one of them, and so it is asked first, where no other effect explains nearly all.
"""

from collections.abc import Sequence

from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.settle import Settled, settle_again
from sea_ident.discrepancy.search.candidates import Candidate
from sea_ident.discrepancy.search.explained_by_one import Added, explained_by_one, explains_nearly_all, one_promises_all
from sea_ident.effects import effect_classes
from sea_ident.effects.joint_placement import JointPlacement
from sea_ident.side_by_side import side_by_side

PLAIN = 10.0
"""Statistic over degrees of freedom from which on it is asked: less is explained by many ways of several joints [-]."""

AS_LITTLE = 2.0
"""Times what joints leave that one effect, fitted, may leave to be what is missing after all [-]."""

WORTH = 0.5
"""Share of what is left that one joint more must explain [-]."""


def with_placements(bench: Bench, start: Settled, candidates: Sequence[Candidate]) -> Settled:
    """A model with joints elsewhere, where that explains nearly all that is missing; as it was where it does not.

    Args:
        bench: the recording.
        start: the model.
        candidates: the effects of the library around it, best first.

    Returns:
        The model, settled.
    """
    excess = start.fit.excess
    if one_promises_all(start, candidates) or start.fit.statistic < PLAIN * start.fit.dof:
        return start
    if JointPlacement.name not in effect_classes():
        return start
    present = {effect.joint for effect in start.fit.effects if isinstance(effect, JointPlacement)}
    places = [place for place in JointPlacement.instances(bench.robot) if place.joint not in present]
    now = start
    while places:
        tried = list(side_by_side(Added(bench, now), places))
        best = min(range(len(places)), key=lambda k: tried[k][0])
        new = bench.again(tried[best][1], now.noise)
        if now.fit.statistic - new.statistic < WORTH * now.fit.excess:
            break
        del places[best]
        now = settle_again(bench, settle_again(bench, new).fit)
    if not explains_nearly_all(start, excess - now.fit.excess, candidates):
        return start
    left_by_one = max(excess - explained_by_one(bench, start, candidates), 0.0)
    return start if left_by_one <= AS_LITTLE * now.fit.excess else now
