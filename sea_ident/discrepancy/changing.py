"""What changes from period to period of one recording, for all that is asked about it."""

from dataclasses import dataclass, replace

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.discrepancy import check, words
from sea_ident.discrepancy.bench import Bench
from sea_ident.discrepancy.data import PeriodData, spectrum
from sea_ident.discrepancy.findings import Gap
from sea_ident.discrepancy.fit import Fit
from sea_ident.discrepancy.heldout import HeldOut
from sea_ident.discrepancy.noise import stacked
from sea_ident.discrepancy.trend import TrendTest, compare_periods
from sea_ident.discrepancy.trend_directions import Name, steady_rows
from sea_ident.discrepancy.trend_gap import trend_gap
from sea_ident.discrepancy.trend_terms import trend_terms
from sea_ident.discrepancy.trend_within import changes, of_joint, within_periods
from sea_ident.effects import Effect
from sea_ident.effects.drift import TrendEffect
from sea_ident.estimation import Model, TrendTerm
from sea_ident.processing import ProcessedRecording
from sea_ident.recordings import Recording


@dataclass(frozen=True, eq=False)
class Changing:
    """What is known beforehand of what changes.

    Attributes:
        temperature: (P, n) mean temperature of every period [degC], None where it was not measured.
        known: trends that the model has.
    """

    temperature: FloatArray | None
    known: tuple[Name, ...] = ()

    @classmethod
    def of(cls, model: Model, recording: Recording | ProcessedRecording, data: PeriodData) -> "Changing":
        """By a model and a recording."""
        known = tuple((term.effect.name, term.effect.joint) for term in model.trends)
        return cls(check.temperatures(recording, data), known)

    def compared(self, bench: Bench, fit: Fit) -> TrendTest:
        """The periods, compared with a model."""
        return compare_periods(bench, fit, self.temperature, self.known)

    def not_shown_by(self, trends: TrendTest) -> tuple[str, ...]:
        """Trends of the model that a comparison of periods does not show, in words."""
        return tuple(words.does_not_drift(*name) for name in self.known if name not in trends.names)

    def less(self, bench: Bench, fit: Fit, trends: TrendTest) -> Bench:
        """The recording without what trends of a model do within a period."""
        if not trends.trends:
            return bench
        known = within_periods(bench, fit, trends.trends, self.temperature)
        return bench.comparing(replace(bench.data, known=known))

    def terms(self, bench: Bench, fit: Fit, trends: TrendTest) -> tuple[TrendTerm, ...]:
        """Trends as a model holds them."""
        return trend_terms(bench, fit, trends.trends, self.temperature)

    def followed(self, bench: Bench, fit: Fit, trends: TrendTest, held: HeldOut | None) -> HeldOut | None:
        """Data that were held out, with what a measured signal makes of a model there that is that of the mean here.

        A drift by time may go on from anywhere, so that it predicts nothing of another recording.
        """
        if held is None or held.recording is None or not trends.trends:
            return held
        data, after = held.bench.data, held.after
        temperature = check.temperatures(held.recording, data)
        torque = np.zeros((data.samples, len(data.equations)))
        for term in self.terms(bench, fit, trends):
            if term.effect.follows is None or not _measured(data, term.effect, temperature):
                continue
            change = changes(data, term.effect, temperature).mean(axis=0)
            rows = data.rows(steady_rows(held.bench, after, term.effect))
            torque += change[:, None] * (rows @ np.array(term.values))
        residual = after.residual - spectrum(torque, data.harmonics)
        return replace(held, after=replace(after, residual=residual, whitened=stacked(residual)))

    def gaps(self, bench: Bench, fit: Fit, trends: TrendTest, held: HeldOut | None) -> dict[str, Gap]:
        """How far periods differ before and after it is known what changes, here and in another recording."""
        found = {"training": trend_gap(bench, fit, trends.trends, self.temperature)}
        if held is not None and held.recording is not None:
            temperature = check.temperatures(held.recording, held.bench.data)
            effects = [trend.effect for trend in trends.trends]
            if all(_measured(held.bench.data, effect, temperature) for effect in effects):
                found["holdout"] = trend_gap(held.bench, held.after, trends.trends, temperature)
        return {label: gap for label, gap in found.items() if gap is not None}


def _measured(data: PeriodData, effect: Effect, temperature: FloatArray | None) -> bool:
    """Whether what a trend follows was measured in every period, where it follows anything."""
    if not isinstance(effect, TrendEffect) or effect.follows is None:
        return True
    own = of_joint(data, effect, temperature)
    return own is not None and bool(np.all(np.isfinite(own)))
