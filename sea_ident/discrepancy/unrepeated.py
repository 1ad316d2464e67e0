"""Recordings without periods, and recordings in which something pushes: a weaker comparison of one stretch.

Without repetition nothing tells noise from what a model lacks. So what the model leaves is the noise, nothing is said
about lack of fit, and the words are limited: `none` and `named` are never said. An effect is told only if

- it explains more of the residual than one of the library would by chance in noise of that spectrum, and
- with it, blocks of the recording are predicted better from the other blocks, in three blocks of four, and
- what is explained matters: at least a tenth of the power of the residual.
"""

import warnings as python_warnings
from dataclasses import dataclass, replace

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.discrepancy import words
from sea_ident.discrepancy.bench.fit import Fit
from sea_ident.discrepancy.bench.gap import Gap
from sea_ident.discrepancy.bench.judge import SMALLEST_SHARE, at_a_bound, own_torque, significance, torque_change
from sea_ident.discrepancy.bench.lacking import candidate_effects
from sea_ident.discrepancy.bench.physics import physical
from sea_ident.discrepancy.bench.settle import Settled, settle, settle_again
from sea_ident.discrepancy.bench.stretch import BETTER, BLOCKS, StretchBench, block_errors, full_residual, stretch_data
from sea_ident.discrepancy.conclude import without_sizes
from sea_ident.discrepancy.evidence import assess
from sea_ident.discrepancy.evidence.named import named_effect
from sea_ident.discrepancy.measured import circular
from sea_ident.discrepancy.measured.check import torque_units
from sea_ident.discrepancy.measured.pushes import FEWEST_PASSES, Push, departure_p, find_pushes, pushed
from sea_ident.discrepancy.result.diagnosis import Diagnosis
from sea_ident.discrepancy.result.findings import (
    Alternative,
    LackOfFit,
    Location,
    MissingEffect,
    MissingParameter,
    Verdict,
)
from sea_ident.discrepancy.result.repair import repaired_model
from sea_ident.discrepancy.search.base_model import completed
from sea_ident.discrepancy.search.candidates import Candidate, scan
from sea_ident.discrepancy.search.next_effect import FAMILY_LEVEL
from sea_ident.discrepancy.simulated.repaired import no_model
from sea_ident.effects import Effect, make_effect, spring_effects
from sea_ident.estimation import Model
from sea_ident.estimation.scales import doubts_of_springs
from sea_ident.exceptions import SeaIdentError, SeaIdentWarning
from sea_ident.plain import plain
from sea_ident.processing import ProcessedRecording, filter_recording
from sea_ident.processing.doubt import DoubtKind, texts_of
from sea_ident.processing.variance import noise_from_curvature
from sea_ident.recordings import Recording
from sea_ident.robot import Robot

SMALLEST_GAIN = 0.1
"""Share of the squared error of blocks left out that an effect must take away."""

MOST_FOUND = 3
"""Largest number of effects that are told of one stretch, beside basic terms."""

TRIED = 4
"""Candidates that are tried in every step."""

AFTER_PUSH = 0.05
"""Time after a push that says nothing about the model [s]."""

MOST_ALIKE = 0.05
"""A candidate that comes within this share of the gain of the best is not told from it."""

VISIBLE = 0.1
"""Share of the torque of an effect that the rest of the model must not take up for it to be named [-]."""


@dataclass(frozen=True, eq=False)
class _Found:
    """An effect that one stretch speaks for."""

    effect: Effect
    p_value: float
    better: int
    gain: float
    alternatives: tuple[Alternative, ...]


def pushes_between_passes(model: Model, recording: Recording, processed: ProcessedRecording) -> tuple[Push, ...]:
    """Pushes in a recording whose motion repeats itself: they come once, at other phases, and spoil every mean.

    Args:
        model: the model.
        recording: the recording.
        processed: the same, cut to periods.

    Returns:
        Pushes; none where there are too few passes to tell, or where the model cannot be compared.
    """
    if processed.period is None or recording.duration < FEWEST_PASSES * processed.period:
        return ()
    try:
        with python_warnings.catch_warnings():
            python_warnings.simplefilter("ignore", SeaIdentWarning)
            whole = filter_recording(recording, model.robot)
        predicted = model.predict(whole.motion, whole.channels)
    except SeaIdentError:
        return ()
    samples = round(processed.period / whole.interval)
    left = whole.tau_motor - predicted
    return find_pushes(whole.motion.time, left, whole.motion.dtheta, samples, _least(whole.tau_motor))


def _least(torque: FloatArray) -> FloatArray:
    """(n,) smallest push that matters beside the torque of the motors (N, n) [N m]."""
    return np.asarray(SMALLEST_SHARE * np.sqrt(np.mean(torque**2, axis=0)), dtype=np.float64)


def diagnose_unrepeated(
    model: Model, processed: ProcessedRecording, recording: Recording | ProcessedRecording
) -> Diagnosis:
    """Say what can still be said of one stretch.

    Args:
        model: the model; its parameters are refitted.
        processed: the stretch.
        recording: what it comes from.

    Returns:
        The diagnosis, in weaker words.
    """
    return _diagnosed(model, processed, recording, _settled_beside_pushes(model, processed, 0))


def diagnose_pushed(
    model: Model, processed: ProcessedRecording, recording: Recording, pass_samples: int
) -> Diagnosis | None:
    """Say what can be said where pushes spoil the mean of a motion that repeats itself.

    Args:
        model: the model; its parameters are refitted.
        processed: the recording as one stretch.
        recording: what it comes from.
        pass_samples: samples of one pass.

    Returns:
        The diagnosis, in weaker words; None where nothing pushes beside the model refitted, for then the mean tells
        more.
    """
    settled = _settled_beside_pushes(model, processed, pass_samples)
    return _diagnosed(model, processed, recording, settled) if settled.pushes else None


@dataclass(frozen=True, eq=False)
class _Stretch:
    """One stretch and the model refitted to it, where nothing pushes."""

    bench: StretchBench
    start: Settled
    pushes: tuple[Push, ...]


def _settled_beside_pushes(model: Model, processed: ProcessedRecording, pass_samples: int) -> _Stretch:
    robot = model.robot
    springs = spring_effects(robot) if robot.elastic_indices.size else ()
    effects = (*model.effects, *springs)
    motion = processed.motion
    pushes: tuple[Push, ...] = ()
    bench = StretchBench(stretch_data(processed, robot), effects)
    start = settle(bench, effects)
    for _ in range(2):
        basic = completed(bench)
        now = start if basic is None else basic.selection.final
        left = full_residual(bench, now.fit)
        found_now = find_pushes(motion.time, left, motion.dtheta, pass_samples, _least(processed.tau_motor))
        if found_now == pushes:
            break
        pushes = found_now
        left_out = np.stack([pushed(pushes, motion.time, i, AFTER_PUSH) for i in range(robot.n)], axis=1)
        bench = StretchBench(stretch_data(processed, robot, left_out), effects)
        start = settle(bench, effects)
    return _Stretch(bench, start, pushes)


def _diagnosed(
    model: Model, processed: ProcessedRecording, recording: Recording | ProcessedRecording, settled: _Stretch
) -> Diagnosis:
    robot, bench, start, pushes = model.robot, settled.bench, settled.start, settled.pushes
    basic = completed(bench)
    if basic is None:
        now, found = _search(bench, start)
        added = len(found)
    else:
        now, added = basic.selection.final, basic.selection.added
        found = _confirmed(bench, start, now, basic.selection.p_values)
    missing = [*_missing(bench, now.fit, found, added), *_missing_pushes(processed, robot, pushes)]
    missing.sort(key=lambda m: -m.torque_share)
    verdict = _verdict(missing)
    gap = _gap(bench, start.fit, now.fit, pushes)
    notes = [text for text in processed.warnings if "no period" not in text]
    notes.extend(() if basic is None else basic.warnings)
    notes.extend((*doubts_of_springs(robot, model.springs), *circular.circular_springs(robot, recording)))
    notes.append(
        "one stretch without a mean of periods: what the model leaves counts as noise, nothing is said about lack of "
        f"fit, and what is told rests on the prediction of {BLOCKS} blocks from each other, which is weaker than "
        "periods. If the motion repeats, give its period (period=, on the command line --period); else record the same "
        "motion ten times or more"
    )
    repaired = None if pushes else repaired_model(model, processed, now.fit)
    if isinstance(repaired, str):
        notes.append(no_model(repaired))
    diagnosis = Diagnosis(
        verdict=verdict,
        text=_text(robot, verdict, missing, gap, pushes, found),
        lack_of_fit=LackOfFit(0.0, 0, 1.0, 1.0, {joint: {} for joint in robot.joint_names}),
        locations=tuple(
            Location(
                robot.joint_names[p.joint], "link" if robot.elastic[p.joint] else "sum",
                f"push, time {p.start:.4g} to {p.stop:.4g} s", abs(p.force), p.z,
            )
            for p in pushes
        ),
        missing=tuple(missing),
        training=gap,
        detectability=assess.detectability(bench, now.fit, now.noise, _candidates(bench, now), (bench, now)),
        warnings=tuple(dict.fromkeys(notes)),
        model=None if isinstance(repaired, str) else repaired,
        recording=processed.source,
        units=torque_units(robot),
    )  # fmt: skip
    if texts_of(processed.doubts, DoubtKind.POSITION):
        unsound = replace(diagnosis, verdict=Verdict.CANNOT_TELL, text=words.UNSOUND, warnings=processed.warnings)
        diagnosis = without_sizes(unsound)
    return diagnosis


def _candidates(bench: StretchBench, now: Settled) -> list[Candidate]:
    """Every effect of the library but pushes, which are looked for in time."""
    wanted = [effect for effect in candidate_effects(bench, now.fit.effects) if effect.name != "external_force"]
    return scan(bench, now.fit, now.noise, wanted)


def _search(bench: StretchBench, start: Settled) -> tuple[Settled, list[_Found]]:
    """Effects that one stretch speaks for, one after the other."""
    now = start
    found: list[_Found] = []
    while len(found) < MOST_FOUND:
        candidates = _candidates(bench, now)
        tests = max(sum(c.tests for c in candidates), 1)
        without = block_errors(bench, now.fit.effects, now.noise)
        passed: list[tuple[float, Fit, _Found]] = []
        for candidate in candidates[:TRIED]:
            if candidate.gain <= 0.0:
                break
            fit = now.fit
            new = bench.refine((*fit.effects, candidate.effect), now.noise, start=fit.parameters, only=len(fit.effects))
            gain = fit.statistic - new.statistic
            p_value = significance(gain, candidate.columns, tests, fit, now.noise)
            if p_value > FAMILY_LEVEL or not physical(bench, new, -1) or at_a_bound(new.effects[-1]):
                continue
            if torque_change(bench, fit, new) < VISIBLE * own_torque(bench, new, -1):
                continue
            errors = block_errors(bench, new.effects, now.noise)
            better = int(np.count_nonzero(errors < without))
            share = 1.0 - float(errors.sum() / without.sum())
            if better < BETTER * BLOCKS or share < SMALLEST_GAIN:
                continue
            passed.append((gain, new, _Found(new.effects[-1], p_value, better, share, ())))
        if not passed:
            break
        passed.sort(key=lambda item: -item[0])
        gain, new, best = passed[0]
        alike = tuple(
            Alternative(other.effect.name, other.effect.joint, float(other_gain / gain))
            for other_gain, _, other in passed[1:]
            if other_gain > (1.0 - MOST_ALIKE) * gain
        )
        found.append(replace(best, alternatives=alike))
        now = settle_again(bench, new)
    return now, found


def _confirmed(bench: StretchBench, start: Settled, now: Settled, p_values: tuple[float, ...]) -> list[_Found]:
    """Basic terms, with what they are worth for the prediction of blocks from each other."""
    effects = now.fit.effects
    with_all = block_errors(bench, effects, now.noise)
    found = []
    for k, p_value in enumerate(p_values):
        position = len(start.fit.effects) + k
        without = block_errors(bench, [e for i, e in enumerate(effects) if i != position], now.noise)
        better = int(np.count_nonzero(with_all < without))
        found.append(_Found(effects[position], p_value, better, 1.0 - float(with_all.sum() / without.sum()), ()))
    return found


def _missing(bench: StretchBench, fit: Fit, found: list[_Found], added: int) -> list[MissingEffect]:
    """What was found; what the model leaves counts as noise already."""
    first, stds = len(fit.effects) - added, np.linalg.norm(fit.covariance_factor, axis=1)
    return [named_effect(bench, fit, first + k, stds, item.p_value, item.alternatives) for k, item in enumerate(found)]


def _missing_pushes(processed: ProcessedRecording, robot: Robot, pushes: tuple[Push, ...]) -> list[MissingEffect]:
    """One `external_force` per joint: how many pushes, and when the first, the last and the strongest began."""
    out = []
    rms = np.sqrt(np.mean(processed.tau_motor**2, axis=0))
    for i, joint in enumerate(robot.joint_names):
        own = [p for p in pushes if p.joint == i]
        if not own:
            continue
        strongest = max(own, key=lambda p: p.z)
        stem = f"{joint}.external_force"
        interval = processed.interval
        out.append(
            MissingEffect(
                effect="external_force",
                joint=joint,
                parameters=(
                    MissingParameter(f"{stem}_pushes", float(len(own)), 0.0, "-"),
                    MissingParameter(f"{stem}_first_start", own[0].start, interval, "s"),
                    MissingParameter(f"{stem}_last_start", own[-1].start, interval, "s"),
                    MissingParameter(f"{stem}_strongest_start", strongest.start, interval, "s"),
                    MissingParameter(
                        f"{stem}_strongest",
                        strongest.force,
                        abs(strongest.force / strongest.z),
                        robot.joints[i].torque_unit,
                    ),
                ),
                torque_share=float(abs(strongest.force) / max(rms[i], 1e-300)),
                p_value=departure_p(strongest.z, processed.samples),
                alternatives=(),
                detail=make_effect("external_force", joint, start=strongest.start, stop=strongest.stop),
            )
        )
    return out


def _verdict(missing: list[MissingEffect]) -> Verdict:
    """`none` and `named` need a noise floor, which one stretch has not."""
    if not missing:
        return Verdict.CANNOT_TELL
    return Verdict.AMBIGUOUS if any(m.alternatives for m in missing) else Verdict.NAMED_WITH_REMAINDER


def _gap(bench: StretchBench, before: Fit, after: Fit, pushes: tuple[Push, ...]) -> Gap:
    """Rms beyond the fast part of the residual, away from pushes."""
    names, time = bench.robot.joint_names, bench.data.motion.time
    keep = np.stack([~pushed(pushes, time, i, AFTER_PUSH) for i in range(len(names))], axis=1)
    noise = np.sqrt(noise_from_curvature(full_residual(bench, after)))

    def beyond(fit: Fit) -> dict[str, float]:
        power = np.mean(np.where(keep, full_residual(bench, fit), 0.0) ** 2, axis=0) / np.maximum(
            keep.mean(axis=0), 0.1
        )
        rms: FloatArray = np.sqrt(np.maximum(power - noise**2, 0.0))
        return {name: float(value) for name, value in zip(names, rms, strict=True)}

    of_noise = {name: float(v) for name, v in zip(names, noise, strict=True)}
    return Gap(beyond(before), beyond(after), of_noise, torque_units(bench.robot))


def _text(
    robot: Robot,
    verdict: Verdict,
    missing: list[MissingEffect],
    gap: Gap,
    pushes: tuple[Push, ...],
    found: list[_Found],
) -> str:
    parts = ["There is no mean over periods to judge the residual by, so these are hints and not names."]
    if not missing:
        parts.append(
            "No effect of the library predicts blocks of the recording better from the other blocks. That does not "
            "say that nothing is missing."
        )
    for m in missing:
        if m.effect == "external_force":
            own = [p for p in pushes if robot.joint_names[p.joint] == m.joint]
            times = ", ".join(f"{p.start:.3f}" for p in own[:6])
            more = f" and {len(own) - 6} more" if len(own) > 6 else ""
            parts.append(
                f"Something that does not belong to the model pushes {len(own)} time(s) at {m.joint} (external_force), "
                f"beginning at {times} s{more}; these parts were left out."
            )
            continue
        item = next(f for f in found if f.effect.title == m.title)
        others = "".join(f" or {a.title}" for a in m.alternatives)
        parts.append(
            f"The data speak for {m.title}{others} ({plain(100 * m.torque_share)} % of torque): with it "
            f"{item.better} of {BLOCKS} blocks are predicted better, {100 * item.gain:.0f} % less squared error."
        )
    parts.extend(
        f"{joint.name}: {gap.after[joint.name]:.3g} {joint.torque_unit} rms is left beyond a fast part of "
        f"{gap.noise[joint.name]:.2g} {joint.torque_unit}; slow noise and missing effects cannot be told apart in it."
        for joint in robot.joints
    )
    return " ".join(parts)
