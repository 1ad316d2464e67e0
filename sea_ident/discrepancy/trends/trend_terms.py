"""What changes in the course of a recording, as a model holds it."""

from collections.abc import Sequence

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.fit import Fit
from sea_ident.discrepancy.trends.trend import Trend
from sea_ident.discrepancy.trends.trend_within import changes
from sea_ident.effects.drift import TrendEffect
from sea_ident.estimation import TrendTerm


def trend_terms(
    bench: Bench, fit: Fit, trends: Sequence[Trend], temperature: FloatArray | None = None
) -> tuple[TrendTerm, ...]:
    """Trends beside a model of the mean: none at the moment of which that is.

    Args:
        bench: the recording.
        fit: the model.
        trends: of its periods.
        temperature: (P, n) mean temperature of every period [degC], None where it was not measured.

    Returns:
        What a model holds of them.
    """
    found = []
    for trend in trends:
        effect = bench.anchored((*fit.effects, trend.effect), fit.parameters)[-1]
        if not isinstance(effect, TrendEffect):
            continue
        level = float(np.mean(changes(bench.data, effect, temperature)))
        values = effect.referred(trend.values, -level)
        # d (v / (1 + v c)) = (1 / (1 + v c))^2 dv, where columns drift themselves
        share = np.divide(values, trend.values, out=np.ones_like(values), where=trend.values != 0.0)
        stds = trend.stds * share**2
        found.append(TrendTerm(effect.about(level), tuple(map(float, values)), tuple(map(float, stds))))
    return tuple(found)
