"""Effects that were added to a model, in the form that they need beside all others."""

from sea_ident.discrepancy.bench import Bench
from sea_ident.discrepancy.edges import sharpened
from sea_ident.discrepancy.kinks import at_its_kink
from sea_ident.discrepancy.lags import with_their_lags
from sea_ident.discrepancy.powers import with_their_powers
from sea_ident.discrepancy.settle import Settled, settle_again, settled_in_form
from sea_ident.discrepancy.slips import without_what_sticks


def formed(bench: Bench, now: Settled) -> Settled:
    """Pushes with their edges and springs with their kinks where they belong, saturation and delays as they need."""
    first = len(bench.effects)
    sharp = sharpened(bench, now.fit, now.noise, first)
    now = settled_in_form(bench, now if sharp is now.fit else settle_again(bench, sharp), first, at_its_kink)
    now = settled_in_form(bench, now, first, without_what_sticks)
    return with_their_lags(bench, with_their_powers(bench, now, first), first)
