"""What a search, its confirmation and the held-out data add up to: the verdict and its evidence."""

from collections.abc import Collection, Mapping
from dataclasses import replace

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.discrepancy import words
from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.contribution import contribution, torque_std
from sea_ident.discrepancy.bench.fit import Fit
from sea_ident.discrepancy.bench.gap import Gap, drowned, gap_of, noise_of_residual, torque_by_joint
from sea_ident.discrepancy.bench.lack import LACK_LEVEL, lack_of_fit, remainder_share
from sea_ident.discrepancy.bench.settle import Settled
from sea_ident.discrepancy.compared.heldout import HeldOut
from sea_ident.discrepancy.compared.reference import ParameterChange
from sea_ident.discrepancy.compared.transfer import TRANSFERS, TRANSFERS_ALONE
from sea_ident.discrepancy.evidence import assess
from sea_ident.discrepancy.evidence.foretold import FAR_BEYOND, Left, left_of
from sea_ident.discrepancy.evidence.locate import locate
from sea_ident.discrepancy.evidence.named import named_effects, named_trend
from sea_ident.discrepancy.measured import check
from sea_ident.discrepancy.measured.data import waveform
from sea_ident.discrepancy.measured.noise import NoiseFloor
from sea_ident.discrepancy.measured.standing import held_still, longest_standing
from sea_ident.discrepancy.nameless.unnamed import LEAVES, Unnamed
from sea_ident.discrepancy.result.diagnosis import Diagnosis
from sea_ident.discrepancy.result.findings import (
    Alternative,
    LackOfFit,
    Location,
    MissingEffect,
    Verdict,
    Waveforms,
)
from sea_ident.discrepancy.search.base_model import BASIC, FRICTION
from sea_ident.discrepancy.search.confirm import Confirmed
from sea_ident.discrepancy.search.search import Selection
from sea_ident.discrepancy.trends.trend import TrendTest
from sea_ident.effects.orders import motors_too_fast
from sea_ident.effects.state import State

FEWEST_PERIODS = 10
"""Periods from which on an effect is named without reservation."""

LARGEST_LEFT = 0.1
"""Share of the torque that may be left beside what few periods name [-]."""

LARGEST_REMAINDER = 3e-3
"""Share of the torque that may be left as what no model has [-]."""

WORTH_A_NAME = 1e-2
"""Share of the torque from which on what is left would be an effect of its own [-]: then no other name explains it."""

GOES = 0.5
"""Where a gap on other data is far beyond the noise: shrink of that on the recording itself from which on it should go
there too [-], ..."""

STAYS = 0.3
"""... and share of that shrink below which it does not [-]."""

FORETELLS = (Verdict.NONE, Verdict.NAMED, Verdict.NAMED_WITH_REMAINDER, Verdict.AMBIGUOUS, Verdict.SUSPECT)
"""Verdicts with a model that should tell what another motion takes."""

UNEXPLAINED = 0.25
"""Share of the excess from which on the effects found are no explanation of it [-]: as large as an effect by itself,
half as large in torque as what was there, and nothing of the library does that, ..."""

UNEXPLAINED_BY_FRICTION = 0.5
"""... and the same beside a friction that the model did not have at all, and where what is nearest does not hold on
other data either [-]."""


def conclude(
    bench: Bench,
    confirmed: Confirmed,
    trends: TrendTest,
    alternatives: dict[int, tuple[Alternative, ...]],
    held: HeldOut | None,
    change: ParameterChange | None,
    notes: check.Findings,
    nameless: tuple[Unnamed, ...] = (),
) -> Diagnosis:
    """Put together what is known of one recording.

    Args:
        bench: the recording.
        confirmed: what was found in the mean, as far as it holds away from the reversals.
        trends: what changes from period to period.
        alternatives: what else each effect could be, by its position in the model.
        held: the data that were not used.
        change: against an earlier model, where one was given.
        notes: what is wrong with the data.
        nameless: what explains the recording better in the place of an effect that was found, and has no name.

    Returns:
        The diagnosis, without model and forward simulation.
    """
    selection = confirmed.selection
    start, final = selection.start, selection.final
    statistic, dof, p_value = lack_of_fit(confirmed.bench, confirmed.start)
    left, left_dof, left_p = lack_of_fit(confirmed.bench, confirmed.final)
    remainder = remainder_share(confirmed.bench, confirmed.final) if left_p < LACK_LEVEL else 0.0
    missing = named_effects(bench, selection, alternatives, held, trends.trends)
    missing.extend(named_trend(bench, trend) for trend in trends.trends if not trend.in_model)
    # what drifts differs from its first value in the mean too
    missing = [m for m in missing if (f"{m.effect}_drift", m.joint) not in trends.names]
    if change is not None:
        missing.extend(change.missing)
    missing.sort(key=lambda m: -m.torque_share)
    unexplained = max(left - left_dof, 0.0) / max(statistic - dof, 1.0) if selection.added else 1.0
    gap = gap_of(bench, start.fit, final.fit, final.noise)
    held_gap = None if held is None else gap_of(held.bench, held.before, held.after, held.noise)
    still = held_still(bench.data)
    holds = held is None or held_gap is None or goes_there(gap, held_gap, torque_by_joint(held.bench), still)
    sound = notes
    notes = drowned(notes, gap, torque_by_joint(bench), still)
    lost = notes is not sound
    if lost:
        remainder = 0.0
    verdict = verdict_of(bench, missing, trends, change, remainder, unexplained, notes, holds)
    # names and gaps of another motion than the robot's would be absurd
    doubted = notes.doubtful and verdict is not Verdict.NONE
    if doubted:
        verdict, lost, remainder = Verdict.CANNOT_TELL, True, 0.0
    if verdict is Verdict.NAMED and confirmed.among_the_slow > LARGEST_REMAINDER:
        verdict, remainder = Verdict.NAMED_WITH_REMAINDER, confirmed.among_the_slow
    without_doubt = (Verdict.NAMED, Verdict.NAMED_WITH_REMAINDER, Verdict.AMBIGUOUS)
    if nameless and (verdict in without_doubt or (verdict is Verdict.SUSPECT and _known_better(missing, nameless))):
        verdict = Verdict.NOT_IN_LIBRARY
    if notes.limited and verdict is Verdict.NOT_IN_LIBRARY:
        verdict = Verdict.CANNOT_TELL
    apart = notes.apart and verdict in (Verdict.NOT_IN_LIBRARY, Verdict.SUSPECT)
    if apart:
        verdict, lost, remainder = Verdict.CANNOT_TELL, True, 0.0
    left_there: dict[str, Left] = {}
    if verdict in FORETELLS and held is not None and held_gap is not None:
        left_there = left_of(bench, final, held, held_gap)
        if verdict is Verdict.SUSPECT:  # why is said already, but for what a recording hardly tells
            left_there = {joint: left for joint, left in left_there.items() if left.as_unsure}
    judged = confirmed.beside or (confirmed.bench, confirmed.final)
    standing = longest_standing(judged[0].data)
    facts = words.Facts(
        verdict=verdict, missing=tuple(missing), gap=gap, held=held_gap, remainder=remainder,
        periods=bench.data.periods, p_value=p_value, trend=trends, change=change,
        units=check.torque_units(bench.robot),
        kind=None if held is None else held.kind, nameless=nameless, sound=not (notes.fatal or doubted or apart),
        standing=standing, motors_too_fast=motors_too_fast(State(bench.robot, bench.data.motion)),
        left_there=left_there, still=still,
    )  # fmt: skip
    # what follows from such positions is no further fault of the recording
    warnings = (*notes.warnings, *trends.notes, *words.reservations(facts))
    found = Diagnosis(
        verdict=verdict,
        text=words.paragraph(facts),
        lack_of_fit=LackOfFit(
            statistic, dof, p_value, trends.p_value, _per_joint(confirmed.bench, confirmed.start), remainder
        ),
        locations=_locations(bench, confirmed),
        missing=tuple(missing),
        training=gap,
        holdout=held_gap,
        detectability=assess.detectability(bench, final.fit, final.noise, selection.candidates, judged),
        warnings=tuple(dict.fromkeys(bench.data.warnings if doubted else warnings)),
        waveforms=_waveforms(bench, start.fit, final.fit, final.noise, selection),
        recording=bench.data.source,
        holdout_source=None if held is None else held.source,
    )
    return without_sizes(found) if lost else found


def _locations(bench: Bench, confirmed: Confirmed) -> tuple[Location, ...]:
    """Where model and data disagree among what is tested: away from reversals, where the mean of signs is no model.

    What was found mostly near them has its place there.
    """
    away = locate(confirmed.bench, confirmed.start.fit, confirmed.start.noise)
    if away or not confirmed.selection.added:
        return away
    start = confirmed.selection.start
    return locate(bench, start.fit, start.noise)


def without_sizes(diagnosis: Diagnosis) -> Diagnosis:
    """A diagnosis of data of which nothing can be told: no gap, no place and no name, whose numbers would be absurd."""
    return replace(
        diagnosis,
        lack_of_fit=replace(diagnosis.lack_of_fit, per_joint={}, remainder=0.0),
        locations=(), missing=(), training=None, holdout=None, simulation_gap={}, detectability=(), model=None,
        waveforms=None,
    )  # fmt: skip


def unexplained(confirmed: Confirmed) -> bool:
    """Whether more is left than may be left as what no model has."""
    if lack_of_fit(confirmed.bench, confirmed.final)[2] >= LACK_LEVEL:
        return False
    return remainder_share(confirmed.bench, confirmed.final) > LARGEST_REMAINDER


def beyond_the_library(confirmed: Confirmed, trends: TrendTest) -> bool:
    """Whether what was found leaves so much that, whatever of its equals it is called, the library does not have it."""
    if not confirmed.selection.added or not unexplained(confirmed):
        return False
    if trends.may_leave(remainder_share(confirmed.bench, confirmed.final)):
        return False
    return confirmed.final.fit.excess > UNEXPLAINED_BY_FRICTION * max(confirmed.start.fit.excess, 1.0)


def goes_there(training: Gap, held: Gap, torque: Mapping[str, float], still: Collection[str]) -> bool:
    """Whether a gap is what another recording allows it to be, if what was found on the one is right.

    Where a joint that stood (`still`) moves there, what it carries asks for other torques of all joints: that is no
    fault of what was found, of which the other recording judges by itself.
    """
    return bool(still) or (explains(training, held) and predicts(held, torque))


def explains(training: Gap, held: Gap) -> bool:
    """Whether a gap that goes on one recording goes on the other too, where it is far beyond the noise."""
    return held.within_noise(FAR_BEYOND) or training.shrink < GOES or held.shrink > STAYS * training.shrink


def predicts(held: Gap, torque: Mapping[str, float]) -> bool:
    """Whether a model is better than none on other data: what it leaves is less than the rms torque by joint.

    Wrong units, exchanged joints or another robot leave more.
    """
    return all(left <= torque[joint] for joint, left in held.after.items())


def verdict_of(
    bench: Bench,
    missing: list[MissingEffect],
    trends: TrendTest,
    change: ParameterChange | None,
    remainder: float,
    unexplained: float,
    notes: check.Findings,
    holds: bool = True,
) -> Verdict:
    """The verdict.

    Args:
        bench: the recording.
        missing: what is named.
        trends: what changes from period to period.
        change: against an earlier model; what is missing by it alone does not count as missing from the model.
        remainder: rms of what is left, as a share of the torque [-].
        unexplained: share of the excess that is left [-].
        notes: what is wrong with the data.
        holds: whether what was found explains other data too, as far as can be told.

    Returns:
        The verdict.
    """
    if notes.fatal:
        return Verdict.CANNOT_TELL
    structural = [m for m in missing if change is None or m not in change.missing]
    large = remainder > LARGEST_REMAINDER
    if not structural:
        if large or trends.unnamed:
            return Verdict.NOT_IN_LIBRARY if bench.data.periods >= FEWEST_PERIODS else Verdict.CANNOT_TELL
        if change is not None and change.changed:
            return Verdict.ONLY_AGAINST_REFERENCE
        return Verdict.NONE
    drifts = trends.may_leave(remainder)
    if not holds:
        return Verdict.SUSPECT
    if large and unexplained > UNEXPLAINED_BY_FRICTION and not drifts and bench.data.periods >= FEWEST_PERIODS:
        # whether what is nearest holds on other data or not
        return Verdict.NOT_IN_LIBRARY
    least = TRANSFERS_ALONE if len(structural) == 1 else TRANSFERS
    if any(m.transfer is not None and m.transfer <= least for m in structural):
        return Verdict.SUSPECT
    if remainder > LARGEST_LEFT and bench.data.periods < FEWEST_PERIODS:
        return Verdict.CANNOT_TELL
    # beside a friction that the model did not have at all more is left: finer effects come after it
    basic = all(m.effect in BASIC for m in structural) and any(m.effect in FRICTION for m in structural)
    nameless = remainder > WORTH_A_NAME and not basic
    unlike = unexplained > (UNEXPLAINED_BY_FRICTION if basic else UNEXPLAINED)
    if large and (unlike or nameless) and not drifts:
        return Verdict.NOT_IN_LIBRARY
    if any(m.alternatives for m in structural):
        return Verdict.AMBIGUOUS
    if large or trends.unnamed:
        return Verdict.NAMED_WITH_REMAINDER
    return Verdict.NAMED


def _known_better(missing: list[MissingEffect], nameless: tuple[Unnamed, ...]) -> bool:
    """Whether it is known what explains nearly all in the place of everything that does not hold on other data."""
    known = {(each.effect, each.joint) for each in nameless if each.share <= LEAVES}
    weak = {(m.effect, m.joint) for m in missing if m.transfer is not None and m.transfer <= TRANSFERS}
    return bool(known) and weak <= known


def _per_joint(bench: Bench, settled: Settled) -> dict[str, dict[str, float]]:
    """Energy of the residual over that of the noise by joint and equation."""
    clean = np.sum(np.abs(bench.clean_residual(settled.fit)) ** 2, axis=0)
    noise = noise_of_residual(settled.fit, settled.noise)
    out: dict[str, dict[str, float]] = {joint: {} for joint in bench.robot.joint_names}
    for e, equation in enumerate(bench.data.equations):
        out[equation.joint][str(equation.kind)] = float(clean[e] / max(noise[e] ** 2, 1e-300))
    return out


def _waveforms(bench: Bench, before: Fit, after: Fit, noise: NoiseFloor, selection: Selection) -> Waveforms:
    data = bench.data
    labels = tuple(f"{eq.joint} {eq.kind}" for eq in data.equations)
    explained: dict[str, FloatArray] = {}
    bands: dict[str, FloatArray] = {}
    first = len(after.effects) - selection.added
    for position in range(first, len(after.effects)):
        effect = after.effects[position]
        explained[effect.title] = waveform(contribution(bench, after, [position]), data.samples)
        bands[effect.title] = torque_std(bench, after, position)
    return Waveforms(
        time=data.motion.time - data.motion.time[0],
        equations=labels,
        before=waveform(bench.clean_residual(before), data.samples),
        after=waveform(bench.clean_residual(after), data.samples),
        noise=noise_of_residual(after, noise),
        q=data.motion.q,
        dtheta=data.motion.dtheta,
        deflection=data.motion.deflection,
        explained=explained,
        bands=bands,
    )
