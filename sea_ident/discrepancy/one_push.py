"""Two pushes at the same time that are one on another link.

A push that was first taken for one on the wrong link leaves what another one at the same time explains: together they
do what the right one does alone, and as long as both are there none is worth an exchange.
"""

from dataclasses import dataclass, replace
from itertools import combinations

from sea_ident.discrepancy.bench import Bench
from sea_ident.discrepancy.edges import at_once, with_sharp_edges
from sea_ident.discrepancy.fit import Fit, Solution
from sea_ident.discrepancy.judge import penalty
from sea_ident.discrepancy.physics import physical
from sea_ident.discrepancy.settle import Settled, settle_again
from sea_ident.effects.external_force import POINT, ExternalForce
from sea_ident.side_by_side import side_by_side


def as_one_push(bench: Bench, now: Settled, added: int) -> tuple[Settled, list[int]]:
    """A model with one push in the place of two that were added, where that does as well for its price.

    Args:
        bench: the recording.
        now: the model.
        added: number of effects added, its last ones.

    Returns:
        The model, and which of the effects that were added are left; the first of two stands for both.
    """
    left, found = list(range(added)), True
    while found:
        fit, found = now.fit, False
        first = len(fit.effects) - len(left)
        for one, two in combinations(range(first, len(fit.effects)), 2):
            single = _single(bench, now, one, two)
            if single is not None:
                now, found = settle_again(bench, single), True
                left.pop(two - first)
                break
    return now, left


def _single(bench: Bench, now: Settled, one: int, two: int) -> Fit | None:
    """The model with the best push in the place of two; None where they are not at the same time, or it does less."""
    fit, push, other = now.fit, now.fit.effects[one], now.fit.effects[two]
    if not isinstance(push, ExternalForce) or not isinstance(other, ExternalForce):
        return None
    time = bench.data.motion.time
    if not at_once(push.pushes(time), other.pushes(time)):
        return None
    tried = list(side_by_side(_Instead(bench, now, one, two), bench.robot.joint_names))
    statistic, solution = min(tried, key=lambda each: each[0])
    new = bench.again(solution, now.noise)
    spared = sum(penalty(fit.effects[k], bench) for k in (one, two)) - penalty(new.effects[one], bench)
    return new if statistic < fit.statistic + fit.unit * spared and physical(bench, new, one) else None


@dataclass(frozen=True, eq=False)
class _Instead:
    """Tries a push on one link in the place of two.

    Attributes:
        bench: the recording.
        now: the model.
        one: position of the first.
        two: position of the second.
    """

    bench: Bench
    now: Settled
    one: int
    two: int

    def __call__(self, joint: str) -> tuple[float, Solution]:
        """What is left with it, and the model."""
        bench, noise, fit = self.bench, self.now.noise, self.now.fit
        push = replace(fit.effects[self.one], joint=joint, **dict.fromkeys(POINT, 0.0))
        effects = [push if k == self.one else effect for k, effect in enumerate(fit.effects) if k != self.two]
        begun = bench.refine(effects, noise, start=fit.parameters, only=len(bench.effects))
        new = with_sharp_edges(bench, begun, noise, self.one)
        return new.statistic, new.solution
