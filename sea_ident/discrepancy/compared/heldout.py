"""Data that were not used in the fit: another recording, or where none was given, every other period."""

import warnings as python_warnings
from collections.abc import Collection
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.fit import Fit
from sea_ident.discrepancy.bench.gap import drowned, gap_of, torque_by_joint
from sea_ident.discrepancy.bench.judge import EQUALLY_GOOD
from sea_ident.discrepancy.bench.settle import Settled, settle_again
from sea_ident.discrepancy.compared.transfer import Transfer, far_behind, transfer
from sea_ident.discrepancy.measured import check
from sea_ident.discrepancy.measured.data import PeriodData, away_from_reversals, period_data, wide_processing
from sea_ident.discrepancy.measured.noise import NoiseFloor, stacked
from sea_ident.discrepancy.measured.own_zeros import joints_with_own_zeros
from sea_ident.discrepancy.measured.same import RUNS_DIFFER, same_motion
from sea_ident.discrepancy.measured.standing import (
    BESIDE_REVERSALS,
    compared_beside_reversals,
    held_still,
    no_slower_than,
    not_compared_at,
)
from sea_ident.discrepancy.search.search import Selection
from sea_ident.effects.spring_hysteresis import SpringHysteresis
from sea_ident.effects.spring_offset import SpringOffset
from sea_ident.exceptions import SeaIdentWarning
from sea_ident.processing import ProcessedRecording
from sea_ident.processing.doubt import DoubtKind, texts_of
from sea_ident.recordings import Recording

FEWEST_TO_SPLIT = 6
"""Periods from which on half of them are held out where no other motion is given."""


class Kind(StrEnum):
    """What data are held out, in words."""

    OTHER_MOTION = "the motion that was held out"
    SAME_MOTION = "the recording that was held out"
    OTHER_PERIODS = "periods that were held out"


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Data that were not used, and what the found effects are worth there.

    Attributes:
        bench: the data.
        before: the model without the effects on them.
        after: the model with the effects on them.
        noise: noise floor there.
        now: the model with the effects fitted to them.
        transfers: one per effect that was added.
        source: what the data are.
        processed: the other recording; None where other periods of the same one were held out.
        recording: as it was given; None where other periods of the same one were held out.
        kind: another motion, the same one recorded again, or other periods.
    """

    bench: Bench
    before: Fit
    after: Fit
    noise: NoiseFloor
    now: Settled
    transfers: tuple[Transfer, ...]
    source: str
    processed: ProcessedRecording | None = None
    recording: Recording | ProcessedRecording | None = None
    kind: Kind = Kind.OTHER_PERIODS

    @property
    def other_motion(self) -> bool:
        """Whether it is another motion, not the same one again."""
        return self.kind is Kind.OTHER_MOTION

    def again(self, selection: Selection) -> "HeldOut":
        """The same data with another selection."""
        found = tried(self.bench, selection, self.source)
        return replace(found, processed=self.processed, recording=self.recording, kind=self.kind)

    def foretell_the_same(self, one: Selection, other: Selection) -> bool:
        """Whether two selections say the same of these data, all parameters as they were found.

        Then nothing here tells them apart: what a fit to these data does for one of them and not for the other is a
        matter of which parameters are held in it.
        """
        fits = [_as_found(self.bench, each.final.fit, each) for each in (one, other)]
        left = [self.bench.whitening(self.now.noise).flat(fit.residual * fit.scale) for fit in fits]
        return float(np.sum((left[0] - left[1]) ** 2)) < EQUALLY_GOOD * self.now.fit.unit

    def worth(self, selection: Selection, position: int, beside: Transfer | None = None) -> Transfer:
        """What one effect of another selection is worth on the same data, by its position in the model.

        Whatever other selections were tried before it, or are at the same time. What is far behind another effect
        (`beside`) is not fitted anew. All are compared in the noise floor of this selection: floors of two models
        differ by some percent, and the statistics of models that do the same would as well.
        """
        if beside is not None:
            behind = far_behind(self.bench, selection, self.now, position, beside)
            if behind is not None:
                return behind
        bench = self.bench.apart()
        _, now = _fitted_anew(bench, selection, self.now.noise)
        (found,) = transfer(bench, selection, now, [position])
        return found


def held_out(
    bench: Bench, selection: Selection, holdout: Recording | ProcessedRecording | None
) -> tuple[HeldOut | None, tuple[str, ...]]:
    """Try what was found on data that were not used.

    Args:
        bench: the recording that was used.
        selection: what was found on it.
        holdout: another recording; every other period of the same one where None.

    Returns:
        The outcome, None where there is nothing to try it on, and warnings.
    """
    if holdout is None:
        return other_periods(bench, selection), ()
    with python_warnings.catch_warnings():
        python_warnings.simplefilter("ignore", SeaIdentWarning)
        processed = wide_processing(holdout, bench.robot, None)
        if processed.period is None and bench.data.period <= 0.5 * processed.interval * processed.samples:
            # what drifts is found by no search for a period, but other motions mostly have the same
            again = wide_processing(holdout, bench.robot, bench.data.period)
            processed = again if _repeats(again) else processed
    if processed.period is None or processed.periods < 2:
        return other_periods(bench, selection), (
            f"the held-out recording {processed.source} holds less than two periods of a motion: nothing can be tested "
            "on it. Record it periodically, several periods",
        )
    holdout = processed.used_of(holdout)
    data, findings = check.cleaned(period_data(processed, bench.robot), holdout)
    warnings = [f"held-out data: {text}" for text in findings.warnings]
    wrong = check.wrong_columns(bench.robot, bench.effects, check.as_identified(holdout, processed, bench.robot))
    warnings.extend(f"held-out data: {text}" for text in wrong)
    doubted = bool(texts_of(processed.doubts, DoubtKind.POSITION))
    if findings.fatal or data.periods < 2 or wrong or doubted:
        warnings.append(f"the held-out recording {processed.source} cannot be used; nothing was tested on it")
        return other_periods(bench, selection), tuple(warnings)
    if bench.data.caution > data.caution:
        data = away_from_reversals(data, bench.data.caution)
    elif bench.data.caution == BESIDE_REVERSALS:
        data = compared_beside_reversals(data)
    # what the recording does not tell would leave so much there that nothing else could be tested
    data = no_slower_than(not_compared_at(data, held_still(bench.data)), bench.data)
    found = tried(Bench(data, bench.effects), selection, processed.source)
    gap = gap_of(found.bench, found.before, found.after, found.noise)
    lost = drowned(check.Findings(), gap, torque_by_joint(found.bench), held_still(data))
    if lost.fatal:
        warnings.extend(f"held-out data: {text}" for text in lost.warnings)
        warnings.append(f"the held-out recording {processed.source} cannot be used; nothing was tested on it")
        return other_periods(bench, selection), tuple(warnings)
    kind = Kind.SAME_MOTION if same_motion(bench.data, data) else Kind.OTHER_MOTION
    return replace(found, processed=processed, recording=holdout, kind=kind), tuple(warnings)


def _repeats(processed: ProcessedRecording) -> bool:
    """Whether the periods of a recording are those of one motion."""
    motions = processed.period_motions
    if len(motions) < 2:
        return False
    theta = np.stack([motion.theta for motion in motions])
    range_of, apart = np.std(np.mean(theta, axis=0), axis=0), np.std(theta - np.mean(theta, axis=0), axis=(0, 1))
    return bool(np.all(apart < RUNS_DIFFER * range_of))


def other_periods(bench: Bench, selection: Selection) -> HeldOut | None:
    """Fit what was found to every other period, and try it on those between.

    That is weaker than another motion: all that repeats from period to period transfers, rightly named or not.
    """
    data = bench.data
    if data.periods < FEWEST_TO_SPLIT or not selection.added:
        return None
    used, left = (_every_other(data, first) for first in (0, 1))
    part = Bench(used, bench.effects)
    start, final = (settle_again(part, settled.fit) for settled in (selection.start, selection.final))
    numbers = ", ".join(str(p + 1) for p in range(1, data.periods, 2)[:3])
    source = f"periods {numbers}, ... of {data.source}"
    return tried(Bench(left, bench.effects), replace(selection, start=start, final=final), source)


def tried(other: Bench, selection: Selection, source: str) -> HeldOut:
    """A selection on data that it was not fitted to."""
    start = selection.start.fit
    before = _as_found(other, start, selection)
    after, now = _fitted_anew(other, selection)
    transfers = tuple(transfer(other, selection, now)) if selection.added else ()
    return HeldOut(other, before, after, other.noise(after), now, transfers, source)


def _fitted_anew(other: Bench, selection: Selection, noise: NoiseFloor | None = None) -> tuple[Fit, Settled]:
    """What was found on data that it was not fitted to: with its parameters as they are, and fitted to them."""
    after = _as_found(other, selection.final.fit, selection)
    return after, settle_again(other, after, noise)


def _as_found(other: Bench, fit: Fit, selection: Selection) -> Fit:
    """One of the models of a selection with its parameters as they are."""
    joints = selection.joints_of(SpringHysteresis) | joints_with_own_zeros(fit.effects)
    return without_history(other, other.predicted(fit.effects, fit.parameters), joints)


def without_history(bench: Bench, fit: Fit, joints: Collection[str]) -> Fit:
    """A model with given parameters less what springs with dry friction may remember of the time before.

    Where such a spring rests depends on how it was loaded last: a constant that no periodic motion tells, and none
    takes along to another. So is the zero of an encoder that counts from where it was switched on.

    Args:
        bench: the recording.
        fit: the model on it.
        joints: those with such a spring.

    Returns:
        The same with a residual that has no constant torque of these springs in it.
    """
    if not joints:
        return fit
    columns = np.concatenate(
        [bench.column_spectra(SpringOffset(joint), fit.effects) for joint in sorted(joints)], axis=2
    )
    amounts = np.linalg.lstsq(stacked(columns), stacked(fit.residual), rcond=None)[0]
    residual = fit.residual - columns @ amounts
    return replace(fit, residual=residual, whitened=stacked(residual))


def _every_other(data: PeriodData, first: int) -> PeriodData:
    return check.subset(data, list(range(first, data.periods, 2)))
