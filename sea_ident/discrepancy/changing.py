"""What changes from period to period of one recording, for all that is asked about it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.discrepancy import words
from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.fit import Fit
from sea_ident.discrepancy.bench.gap import Gap
from sea_ident.discrepancy.bench.judge import EQUALLY_GOOD
from sea_ident.discrepancy.compared.heldout import HeldOut
from sea_ident.discrepancy.measured import check
from sea_ident.discrepancy.measured.data import PeriodData, spectrum
from sea_ident.discrepancy.measured.noise import ComplexArray, stacked
from sea_ident.discrepancy.simulated.forward import Present
from sea_ident.discrepancy.trends.trend import TrendTest, compare_periods
from sea_ident.discrepancy.trends.trend_directions import Name, steady_rows
from sea_ident.discrepancy.trends.trend_gap import trend_gap
from sea_ident.discrepancy.trends.trend_terms import trend_terms
from sea_ident.discrepancy.trends.trend_within import mean_course, of_joint, within_periods
from sea_ident.effects import Effect
from sea_ident.effects.drift import TrendEffect
from sea_ident.estimation import Model, TrendTerm
from sea_ident.processing import ProcessedRecording
from sea_ident.recordings import Recording
from sea_ident.robot import Robot
from sea_ident.simulation import PlantedEffect


@dataclass(frozen=True, eq=False)
class Changed:
    """A trend of a model, and how far it has changed in the mean of another recording.

    Attributes:
        term: the trend, none in the mean of the recording that it was found in.
        course: (N,) its change over the mean period there.
        torque: (N, E) what it does there beyond a model that is that of the mean here [N m] or [N].
    """

    term: TrendTerm
    course: FloatArray
    torque: FloatArray


@dataclass(frozen=True, eq=False)
class Elsewhere:
    """What has changed in another recording.

    Attributes:
        changed: what is known to have.
        notes: what a user should know.
    """

    changed: tuple[Changed, ...] = ()
    notes: tuple[str, ...] = ()

    def present(self, robot: Robot) -> Present:
        """The same for a simulation of its mean."""
        effects: list[PlantedEffect] = []
        delivered = np.ones(robot.n)
        for one in self.changed:
            effect, values, change = one.term.effect, np.array(one.term.values), float(np.mean(one.course))
            effects.extend(PlantedEffect(*each) for each in effect.throughout(values, change))
            delivered *= effect.delivered_share(robot, values, change)
        return Present(tuple(effects), delivered)


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

    def elsewhere(self, bench: Bench, fit: Fit, trends: TrendTest, held: HeldOut | None) -> Elsewhere:
        """What has changed by how much in the mean of data that were held out, as far as that is known.

        What follows a measured signal is. A drift by time may go on from anywhere; whether it began anew with the
        recording, those data say: it did if it explains more of them than if nothing drifted.
        """
        if held is None or held.recording is None or not trends.trends:
            return Elsewhere()
        data, after = held.bench.data, held.after
        temperature = check.temperatures(held.recording, data)
        found = []
        for term in self.terms(bench, fit, trends):
            if not _measured(data, term.effect, temperature):
                continue
            course = mean_course(data, term.effect, temperature)
            rows = data.rows(steady_rows(held.bench, after, term.effect))
            found.append(Changed(term, course, course[:, None] * (rows @ np.array(term.values))))
        known = tuple(one for one in found if one.term.effect.follows is not None)
        apart = _left(held, found) - _left(held, known)
        if apart < 0.0:
            return Elsewhere(tuple(found))
        by_time = [one.term.effect.title for one in found if one not in known]
        told = (words.did_not_begin_anew(by_time, held.source),) if apart > EQUALLY_GOOD * held.now.fit.unit else ()
        return Elsewhere(known, told)

    def gaps(self, bench: Bench, fit: Fit, trends: TrendTest, held: HeldOut | None) -> dict[str, Gap]:
        """How far periods differ before and after it is known what changes, here and in another recording."""
        found = {"training": trend_gap(bench, fit, trends.trends, self.temperature)}
        if held is not None and held.recording is not None:
            temperature = check.temperatures(held.recording, held.bench.data)
            effects = [trend.effect for trend in trends.trends]
            if all(_measured(held.bench.data, effect, temperature) for effect in effects):
                found["holdout"] = trend_gap(held.bench, held.after, trends.trends, temperature)
        return {label: gap for label, gap in found.items() if gap is not None}


def followed(held: HeldOut | None, changed: Sequence[Changed]) -> HeldOut | None:
    """Data that were held out, with what has changed there in a model that is that of the mean of another recording."""
    if held is None or not changed:
        return held
    residual = _residual(held, changed)
    return replace(held, after=replace(held.after, residual=residual, whitened=stacked(residual)))


def _residual(held: HeldOut, changed: Sequence[Changed]) -> ComplexArray:
    """(H + 1, E) what is left of data that were held out where that has changed [N m] or [N]."""
    torque = np.zeros((held.bench.data.samples, len(held.bench.data.equations)))
    for one in changed:
        torque += one.torque
    return np.asarray(held.after.residual - spectrum(torque, held.bench.data.harmonics))


def _left(held: HeldOut, changed: Sequence[Changed]) -> float:
    """The same in terms of the noise there, squared and summed [-]."""
    left = held.bench.whitening(held.noise).flat(_residual(held, changed) * held.after.scale)
    return float(np.sum(left**2))


def _measured(data: PeriodData, effect: Effect, temperature: FloatArray | None) -> bool:
    """Whether what a trend follows was measured in every period, where it follows anything."""
    if not isinstance(effect, TrendEffect) or effect.follows is None:
        return True
    own = of_joint(data, effect, temperature)
    return own is not None and bool(np.all(np.isfinite(own)))
