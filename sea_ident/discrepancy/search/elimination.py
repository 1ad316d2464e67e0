"""Which of the effects that were added to a model it needs: backward elimination."""

from dataclasses import dataclass

from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.fit import Solution
from sea_ident.discrepancy.bench.judge import (
    SMALLEST_SHARE,
    at_a_bound,
    is_push,
    own_torque,
    significance,
    too_short,
    torque_change,
)
from sea_ident.discrepancy.bench.lack import LACK_LEVEL, lack_of_fit, remainder_share
from sea_ident.discrepancy.bench.physics import bends_another, physical
from sea_ident.discrepancy.bench.settle import Settled, settle_again
from sea_ident.discrepancy.search.edges import sharpened, without_another
from sea_ident.discrepancy.search.formed import formed
from sea_ident.discrepancy.search.next_effect import FAMILY_LEVEL, LARGE_TORQUE
from sea_ident.discrepancy.search.taken_up import taken_up
from sea_ident.side_by_side import side_by_side

PUSHES_BACK = 0.2
"""Share of a large push by which the torque must change without it: else it only cancels another [-]."""

BEYOND_FORM = 2.0
"""Times the torque that is left without a name by which a push must exceed it: forms that are not those of the library
leave something at certain times of a period too, and a push fits there [-], ..."""

BEYOND_DOUBT = 0.02
"""... unless it leaves less than this share of the excess without it: no other form is so alike a push that comes and
goes, and without it nothing else is told [-]."""


def eliminate(
    bench: Bench, now: Settled, added: list[float], tests: int, fewest: int = 1
) -> tuple[Settled, list[float]]:
    """Take out effects that are not needed or not physical, one after the other; of the physical the fewest stay.

    Args:
        bench: the recording.
        now: the model.
        added: p-values of its last effects.
        tests: number of shapes of all candidates.
        fewest: how many effects stay at least, where they are physical.

    Returns:
        What is left, and the p-values of that.
    """
    added = list(added)
    while len(added) > fewest or (added and not physical(bench, now.fit, -1)):
        fit, noise = now.fit, now.noise
        nameless = remainder_share(bench, now) if lack_of_fit(bench, now)[2] < LACK_LEVEL else 0.0
        first = len(fit.effects) - len(added)
        positions = range(first, len(fit.effects))
        scores = list(side_by_side(Elimination(bench, now, tests, nameless), positions))
        worst = max(zip(scores, positions, strict=True), key=lambda each: each[0].rank)
        if worst[0].p_value <= FAMILY_LEVEL:
            break
        now = settle_again(bench, bench.again(worst[0].left, noise))
        # its edges were those of a push that stood where it does not, or that another stood in for
        now = formed(bench, now) if is_push(fit.effects[worst[1]]) else now
        del added[worst[1] - first]
    return now, added


@dataclass(frozen=True, eq=False)
class Without:
    """What is left without an effect.

    Attributes:
        p_value: of the effect, 1 where it is not needed.
        statistic: without it.
        left: the model without it.
        sound: whether the others are physical there. Where two bend one another, the one that fits a little better
            alone may do so as what cannot be.
    """

    p_value: float
    statistic: float
    left: Solution
    sound: bool

    @property
    def rank(self) -> tuple[bool, bool, float, float]:
        """The larger, the rather the effect is taken out."""
        return self.p_value > FAMILY_LEVEL, self.sound, self.p_value, -self.statistic


@dataclass(frozen=True, eq=False)
class Elimination:
    """Takes effects out of a model.

    Attributes:
        bench: the recording.
        now: the model.
        tests: number of shapes of all candidates.
        nameless: torque that is left without a name, as a share of it [-].
    """

    bench: Bench
    now: Settled
    tests: int
    nameless: float

    def __call__(self, position: int) -> Without:
        """The model without the effect at a position."""
        bench, fit, noise, first = self.bench, self.now.fit, self.now.noise, len(self.bench.effects)
        effect, others = fit.effects[position], [e for k, e in enumerate(fit.effects) if k != position]
        without = bench.refine(others, noise, start=fit.parameters, only=first)
        if is_push(effect):
            without = without_another(bench, without, noise, effect, first)
        elif any(is_push(other) for other in others[first:]):
            # what bent the edges of a push is not needed for them
            without = sharpened(bench, without, noise, first)
        loss = without.statistic - fit.statistic
        columns = max(len(effect.columns(bench.robot)), 1)
        visible, own = torque_change(bench, fit, without), own_torque(bench, fit, position)
        # as where it was added: what the model bends by without it says nothing of its size
        shows = visible >= SMALLEST_SHARE or taken_up(bench, without, fit, noise, position)
        needed = shows and 2.0 * own >= SMALLEST_SHARE and physical(bench, fit, position)
        # nor what beside the others ended at the end of its range, or is over sooner by now than can be shown
        needed = needed and not at_a_bound(effect) and not too_short(bench, effect)
        if is_push(effect):
            needed = needed and (own > BEYOND_FORM * self.nameless or fit.excess < BEYOND_DOUBT * without.excess)
            # a push comes and goes: nothing but another push can cancel it
            needed = needed and (own < LARGE_TORQUE or visible > PUSHES_BACK * own)
        needed = needed and not bends_another(bench, fit, position)
        p_value = significance(loss, columns, self.tests, without, noise) if needed else 1.0
        added = range(first, len(others))
        sound = p_value <= FAMILY_LEVEL or all(physical(bench, without, k) for k in added)
        return Without(p_value, without.statistic, without.solution, sound)
