"""Effects that were added to a model, in the form that they need beside all others."""

from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.settle import Settled, settle_again, settled_in_form
from sea_ident.discrepancy.search.edges import sharpened
from sea_ident.discrepancy.search.kinks import at_its_kink
from sea_ident.discrepancy.search.lags import with_their_lags
from sea_ident.discrepancy.search.powers import with_their_powers
from sea_ident.discrepancy.search.slips import without_what_sticks


def formed(bench: Bench, now: Settled) -> Settled:
    """Pushes with their edges and springs with their kinks where they belong, saturation and delays as they need."""
    first = len(bench.effects)
    sharp = sharpened(bench, now.fit, now.noise, first)
    now = settled_in_form(bench, now if sharp is now.fit else settle_again(bench, sharp), first, at_its_kink)
    now = settled_in_form(bench, now, first, without_what_sticks)
    return with_their_lags(bench, with_their_powers(bench, now, first), first)
