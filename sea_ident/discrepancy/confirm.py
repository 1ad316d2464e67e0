"""Whether what was found holds away from the reversals too."""

from dataclasses import dataclass, replace

from sea_ident.discrepancy.bench import Bench
from sea_ident.discrepancy.data import away_from_reversals
from sea_ident.discrepancy.judge import significance, torque_change
from sea_ident.discrepancy.search import FAMILY_LEVEL, SMALLEST_SHARE, Selection, without
from sea_ident.discrepancy.settle import Settled, settle_again


@dataclass(frozen=True, eq=False)
class Confirmed:
    """A selection that holds away from the reversals, and its models there.

    Attributes:
        selection: what is left of what was found.
        bench: the recording with more left out around the reversals.
        start: the model without anything added, there.
        final: the model with the effects added, there.
    """

    selection: Selection
    bench: Bench
    start: Settled
    final: Settled

    def less(self, selection: Selection) -> "Confirmed":
        """The same with less found."""
        final = settle_again(self.bench, selection.final.fit) if selection.added else self.start
        return replace(self, selection=selection, final=final)


def confirm(bench: Bench, selection: Selection) -> Confirmed:
    """Take out the effects that only the samples near reversals speak for.

    Args:
        bench: the recording.
        selection: what was found.

    Returns:
        What is left.
    """
    away = Bench(away_from_reversals(bench.data), bench.effects)
    start = settle_again(away, selection.start.fit)
    final = settle_again(away, selection.final.fit) if selection.added else start
    weak = []
    first = len(final.fit.effects) - selection.added
    for k in range(selection.added):
        others = [e for position, e in enumerate(final.fit.effects) if position != first + k]
        less = away.refine(others, final.noise, start=final.fit.parameters, only=len(away.effects))
        loss = less.statistic - final.fit.statistic
        columns = max(len(final.fit.effects[first + k].columns(away.robot)), 1)
        p_value = significance(loss, columns, selection.tests, less, final.noise)
        if p_value > FAMILY_LEVEL or torque_change(away, final.fit, less) < SMALLEST_SHARE:
            weak.append(k)
    found = Confirmed(selection, away, start, final)
    return found.less(without(bench, selection, weak)) if weak else found
