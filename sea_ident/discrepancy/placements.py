"""Joints that are elsewhere than the description says: what may be missing before anything else.

Where a joint is bends the torque of all joints before it, by the bodies that it carries. Step by step a search would
take it for whatever is alike in one of them, and so it is asked first, where no other effect explains nearly all.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from sea_ident.discrepancy.bench import Bench
from sea_ident.discrepancy.candidates import Candidate
from sea_ident.discrepancy.fit import Solution
from sea_ident.discrepancy.settle import Settled, settle_again
from sea_ident.effects import Effect
from sea_ident.effects.joint_placement import JointPlacement
from sea_ident.side_by_side import side_by_side

PROMISED = 0.95
"""Share of the excess from which on another effect that promises it is the one that is missing [-]."""

PLAIN = 10.0
"""Statistic over degrees of freedom from which on it is asked: less is explained by many ways of several joints [-]."""

NEARLY_ALL = 0.8
"""Share of the excess that joints must explain, and more than any other effect promises [-]."""

WORTH = 0.5
"""Share of what is left that one joint more must explain [-]."""

HOPEFUL = 0.3
"""The same for where they are by a first step."""

ROUNDS = 3
"""Rounds in which the bodies that a joint carries and where it is follow each other."""


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
    promised = candidates[0].gain if candidates else 0.0
    if promised >= PROMISED * excess or start.fit.statistic < PLAIN * start.fit.dof:
        return start
    present = {effect.joint for effect in start.fit.effects if isinstance(effect, JointPlacement)}
    places = [place for place in JointPlacement.instances(bench.robot) if place.joint not in present]
    now = start
    while places:
        tried = list(side_by_side(_Moved(bench, now), places))
        best = min(range(len(places)), key=lambda k: tried[k][0])
        new = bench.again(tried[best][1], now.noise)
        if now.fit.statistic - new.statistic < WORTH * now.fit.excess:
            break
        del places[best]
        now = settle_again(bench, settle_again(bench, new).fit)
    return now if excess - now.fit.excess > max(NEARLY_ALL * excess, promised) else start


@dataclass(frozen=True, eq=False)
class _Moved:
    """Moves one joint more.

    Attributes:
        bench: the recording.
        now: the model.
    """

    bench: Bench
    now: Settled

    def __call__(self, place: Effect) -> tuple[float, Solution]:
        """What is left with it, and the model."""
        bench, fit = self.bench, self.now.fit
        effects = (*bench.anchored(fit.effects, fit.parameters), *bench.anchored((place,), fit.parameters))
        new = bench.fit(effects, self.now.noise, start=fit.parameters, tangents=False)
        for _ in range(ROUNDS if fit.statistic - new.statistic > HOPEFUL * fit.excess else 0):
            anchored = bench.anchored(new.effects, new.parameters)
            new = bench.fit(anchored, self.now.noise, start=new.parameters, tangents=False)
        return new.statistic, new.solution
