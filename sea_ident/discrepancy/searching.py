"""What the mean of the periods lacks: with springs that can be, beyond steps of encoders, and less what drifts."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from sea_ident.discrepancy import words
from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.lack import remainder_share
from sea_ident.discrepancy.bench.settle import Settled, settle
from sea_ident.discrepancy.beside_reversals import friction_of_the_slow, searched_beside_reversals
from sea_ident.discrepancy.changing import Changing
from sea_ident.discrepancy.conclude import unexplained
from sea_ident.discrepancy.evidence.sensor_limits import steps_cover
from sea_ident.discrepancy.search.candidates import scan
from sea_ident.discrepancy.search.confirm import Confirmed, confirm, explains_nearly_all, without_the_slow
from sea_ident.discrepancy.search.possible_springs import (
    begun_with_zeros,
    impossible_springs,
    left_without_cubic,
    with_fitted_zeros,
    without_cubic,
)
from sea_ident.discrepancy.search.search import Selection, search, still_needed
from sea_ident.discrepancy.trends.trend import TrendTest
from sea_ident.effects.offset import Offset

Progress = Callable[[str, float], None]


@dataclass(frozen=True, eq=False)
class Found:
    """What the mean of the periods and their comparison show, on which bench, and what a user should know of it."""

    bench: Bench
    confirmed: Confirmed
    trends: TrendTest
    notes: tuple[str, ...] = ()


def compared(bench: Bench, confirmed: Confirmed, changing: Changing, notes: tuple[str, ...] = ()) -> Found:
    """What was found in the mean, and what the periods say beside it."""
    return Found(bench, confirmed, changing.compared(confirmed.bench, confirmed.final.fit), notes)


def searched_with_possible_springs(bench: Bench, changing: Changing, tell: Progress, zeros: Sequence[Offset]) -> Found:
    """Search, and once more without the cubic terms of springs that are impossible with what was found.

    Args:
        bench: the recording.
        changing: what changes from period to period.
        tell: progress.
        zeros: what is plain before anything is searched, about as large as it is.
    """
    begun = begun_with_zeros(bench, zeros) if zeros else None
    found = _searched_beyond_steps(bench, changing, tell, begun)
    impossible = impossible_springs(bench, found.confirmed.final.fit)
    if not impossible:
        return found
    without = without_cubic(bench, impossible)
    other = _searched_beyond_steps(without, changing, tell, with_fitted_zeros(without, impossible))
    if any(other.confirmed.final.fit.parameters[f"{joint}.spring_stiffness"] < 0.0 for joint in impossible):
        return found
    return replace(other, notes=(*other.notes, *left_without_cubic(bench.robot, impossible)))


def _searched_beyond_steps(bench: Bench, changing: Changing, tell: Progress, begun: Selection | None = None) -> Found:
    """Search, unless the steps of the encoders may be all that is left."""
    if bench.data.step_errors is not None and steps_cover(bench, settle(bench, bench.effects)):
        return unsearched(bench, changing)
    return _searched(bench, changing, tell, begun)


def _searched(bench: Bench, changing: Changing, tell: Progress, begun: Selection | None = None) -> Found:
    """Search the mean, less what drifts within a period: periods are compared before, and after once more."""
    start = settle(bench, bench.effects) if begun is None else begun.start
    seen = start.fit if begun is None else begun.final.fit
    before = changing.compared(bench, seen)
    less = changing.less(bench, seen, before)
    found = _searched_mean(less, changing, tell, begun, start if less is bench else None)
    if found.trends.names != before.names and not (less is bench and _lacks_more(found)):
        first = found.confirmed
        nearly = explains_nearly_all(found.bench, first.selection.start.fit, first.selection.final)
        again = changing.less(bench, first.final.fit, found.trends)
        found = _searched_mean(again, changing, tell, still_needed(again, first.selection) if nearly else None)
    bench, confirmed = searched_beside_reversals(found.bench, found.confirmed)
    return replace(found, bench=bench, confirmed=confirmed)


def _lacks_more(found: Found) -> bool:
    """Whether so much is left that what drifts is not what kept the rest from being found."""
    confirmed = found.confirmed
    return unexplained(confirmed) and remainder_share(confirmed.bench, confirmed.final) > found.trends.torque_change


def _searched_mean(
    bench: Bench,
    changing: Changing,
    tell: Progress,
    begun: Selection | None = None,
    start: Settled | None = None,
) -> Found:
    confirmed = confirm(bench, search(bench, bench.effects, begun, start=start))
    notes: tuple[str, ...] = ()
    if unexplained(confirmed):
        tell("searching without what is slow", 0.35)
        second = without_the_slow(bench, confirmed)
        if second is not None:
            with_them = friction_of_the_slow(bench, second)
            bench, confirmed = with_them or (second.bench, second)
            notes = () if with_them else (words.slow_samples(bench.data),)
    tell("comparing the periods", 0.5)
    return compared(bench, confirmed, changing, notes)


def unsearched(bench: Bench, changing: Changing) -> Found:
    """The model as it is, and what could have been seen beside it."""
    start = settle(bench, bench.effects)
    candidates = tuple(scan(bench, start.fit, start.noise))
    selection = Selection(start, start, 0, (), candidates, max(sum(c.tests for c in candidates), 1))
    return compared(bench, confirm(bench, selection), changing)
