"""Encoders whose readings are filtered: their delays spread, where that takes away much of what one delay leaves."""

from dataclasses import replace

from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.lack import LACK_LEVEL, lack_of_fit
from sea_ident.discrepancy.bench.settle import Settled, settle_again
from sea_ident.effects.position_delay import PositionDelay

USEFUL = 0.2
"""Share of what a model with one delay leaves that their spread must take away: as much as an effect must [-]."""

BEGIN = 0.5
"""Spread that is begun with, as a share of the delay [-]."""

SHORTEST = 1e-3
"""Delay from which on their spread may show [s]."""


def with_their_lags(bench: Bench, now: Settled, first: int) -> Settled:
    """A settled model in which the delays of a late encoder spread where that explains much more.

    Args:
        bench: the recording.
        now: the model with what was found.
        first: position of the first effect that was found.

    Returns:
        The model, settled; the same one where no spread is worth it.
    """
    for position in range(first, len(now.fit.effects)):
        effect = now.fit.effects[position]
        if not isinstance(effect, PositionDelay) or effect.lag > 0.0 or effect.delay < SHORTEST:
            continue
        if lack_of_fit(bench, now)[2] >= LACK_LEVEL:
            break
        effects = list(now.fit.effects)
        effects[position] = replace(effect, lag=BEGIN * effect.delay)
        spread = bench.refine(effects, now.noise, start=now.fit.parameters, only=len(bench.effects))
        if now.fit.statistic - spread.statistic > USEFUL * now.fit.excess:
            now = settle_again(bench, spread)
    return now
