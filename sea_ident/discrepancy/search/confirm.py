"""Whether what was found holds away from the reversals too, and what can be found only there."""

from dataclasses import dataclass, replace

import numpy as np

from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.fit import Fit
from sea_ident.discrepancy.bench.judge import SMALLEST_SHARE, flat_steps, scatter_p, significance, torque_change
from sea_ident.discrepancy.bench.lack import LACK_LEVEL, lack_of_fit, remainder_share
from sea_ident.discrepancy.bench.settle import Settled, settle_again, settled_elsewhere
from sea_ident.discrepancy.measured.data import BARELY_SEEN, MOST_LEFT_OUT, away_from_reversals
from sea_ident.discrepancy.search.breakaway import lets_go_late
from sea_ident.discrepancy.search.candidates import scan
from sea_ident.discrepancy.search.next_effect import FAMILY_LEVEL
from sea_ident.discrepancy.search.search import HOPELESS, MOST_EFFECTS, SLOW, Selection, search, without
from sea_ident.discrepancy.search.taken_up import taken_up
from sea_ident.effects import Side
from sea_ident.side_by_side import side_by_side

FAR = 6
"""How many times the usual is left out around reversals where the search is repeated without what is slow."""

PROMISING = 0.3
"""Share of the excess there that a candidate must promise to explain for the search to be repeated [-]."""

NEARLY_ALL = 0.9
"""Share of the excess from which on what was found is where another search begins, with fewer samples or less that
drifts [-]."""

RESOLVED = 0.5
"""Share of the excess that the repeated search may leave of what the first left there, where it leaves any [-]."""


@dataclass(frozen=True, eq=False)
class Confirmed:
    """A selection that holds away from the reversals, and its models there.

    Attributes:
        selection: what is left of what was found.
        bench: the recording with more left out around the reversals.
        start: the model without anything added, there.
        final: the model with the effects added, there.
        among_the_slow: rms of what the model leaves among slow samples that were left out, as a share of the torque
            [-].
        beside: the recording with what is slow beside reversals compared, and the model there; None where that was not
            looked at.
    """

    selection: Selection
    bench: Bench
    start: Settled
    final: Settled
    among_the_slow: float = 0.0
    beside: tuple[Bench, Settled] | None = None

    def less(self, selection: Selection) -> "Confirmed":
        """The same with less found."""
        final = settled_elsewhere(self.bench, selection.final.fit) if selection.added else self.start
        return replace(self, selection=selection, final=final)


def confirm(bench: Bench, selection: Selection) -> Confirmed:
    """Take out the effects that only the samples near reversals speak for.

    What the others say must stand out of the scatter of the periods as well: friction that differs from pass to pass
    does so beyond the samples that are left out, and has another mean over the passes of every recording. What was
    found is at the motor where it stands out by most. Stiction stays that every pass shows where its motor is let go.

    Args:
        bench: the recording.
        selection: what was found.

    Returns:
        What is left.
    """
    away = bench.comparing(replace(away_from_reversals(bench.data), alike=BARELY_SEEN))
    start = settle_again(away, selection.start.fit)
    if not selection.added:
        return Confirmed(selection, away, start, start)
    final = settled_elsewhere(away, selection.final.fit)
    steps = flat_steps(away, final)
    first = len(final.fit.effects) - selection.added
    motors = len({c.effect.joint for c in selection.candidates if c.effect.side is Side.MOTOR})

    def is_weak(position: int) -> bool:
        others = [e for k, e in enumerate(final.fit.effects) if k != position]
        less = away.refine(others, final.noise, start=final.fit.parameters, only=len(away.effects))
        loss = less.statistic - final.fit.statistic
        columns = max(len(final.fit.effects[position].columns(away.robot)), 1)
        p_value = significance(loss, columns, selection.tests, less, final.noise)
        by_chance = max(p_value, max(motors, 1) * scatter_p(steps, less.whitened - final.fit.whitened))
        if by_chance <= FAMILY_LEVEL:
            visible = torque_change(away, final.fit, less) >= SMALLEST_SHARE
            if visible or taken_up(away, less, final.fit, final.noise, position):
                return False
        rest = bench.fit(others, selection.final.noise, start=less.parameters, tangents=False)
        return not lets_go_late(bench, rest, final.fit.effects[position])

    weak = [k for k, out in enumerate(side_by_side(is_weak, range(first, len(final.fit.effects)))) if out]
    found = Confirmed(selection, away, start, final)
    return found.less(without(bench, selection, weak)) if weak else found


def _begun(far: Bench, confirmed: Confirmed, before: Settled) -> Selection | None:
    """What a search with fewer samples begins with: nothing, or what was found if it explains nearly all there.

    With what was taken out of it again, where that explains nearly all of what is left: the samples that spoke against
    it may be those that are compared no longer.

    Args:
        far: the recording with these samples.
        confirmed: what was found with more of them.
        before: the model with that, settled there.
    """
    found, there, whole = confirmed.selection, before, confirmed.selection.whole
    if whole is not None and found.added < whole.added < MOST_EFFECTS:
        more = settle_again(far, whole.final.fit)
        if more.fit.excess < (1.0 - NEARLY_ALL) * there.fit.excess:
            found, there = whole, more
    return found if explains_nearly_all(far, confirmed.start.fit, there) else None


def explains_nearly_all(bench: Bench, start: Fit, final: Settled) -> bool:
    """Whether what was found explains so much that another search may begin with it.

    Args:
        bench: the recording.
        start: the model without anything added.
        final: the model with the effects added.
    """
    nothing = bench.fit(bench.effects, final.noise, start=start.parameters)
    return final.fit.excess < (1.0 - NEARLY_ALL) * nothing.excess


def without_the_slow(bench: Bench, confirmed: Confirmed) -> Confirmed | None:
    """Search again without the samples in which a motor hardly moves.

    Where a motor lingers at a speed that is hardly more than its noise, friction depends on that speed so steeply that
    no model of the mean is right there. What that leaves can hide an effect that the rest of the motion shows plainly.

    Args:
        bench: the recording.
        confirmed: what was found with these samples, and does not explain the recording.

    Returns:
        What is found without them; None where it explains the rest no better.
    """
    data = away_from_reversals(bench.data, FAR)
    if np.any(np.mean(data.left_out, axis=0) > MOST_LEFT_OUT):
        return None
    far = bench.comparing(data)
    before = settle_again(far, confirmed.final.fit)
    first = before.fit
    most = max((candidate.gain for candidate in scan(far, first, before.noise)), default=0.0)
    # a search gives up where the next effect leaves so much: none need begin
    given_up = confirmed.selection.added > 0 and first.statistic > HOPELESS * first.dof
    if most < (1.0 - SLOW if given_up else PROMISING) * first.excess:
        return None
    begun = _begun(far, confirmed, before)
    # among other samples another effect may do better after all
    found = search(far, bench.effects, None if begun is None else replace(begun, tried={}))
    fit = found.final.fit
    explained = lack_of_fit(far, found.final)[2] >= LACK_LEVEL
    if not found.added or not (explained or fit.excess < RESOLVED * first.excess):
        return None
    # with the usual samples freed: what a judge of the model would take out is just what must not be forgotten here
    usual = bench.comparing(away_from_reversals(bench.data))
    left = remainder_share(usual, settle_again(usual, fit))
    return Confirmed(found, far, found.start, found.final, left)
