"""`diagnose`: where a model and a recording disagree, and which effect is missing."""

import warnings as python_warnings
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.discrepancy import assess, check, words
from sea_ident.discrepancy.base_model import BASIC, completed
from sea_ident.discrepancy.bench import Bench
from sea_ident.discrepancy.candidates import scan
from sea_ident.discrepancy.circular import circular_springs
from sea_ident.discrepancy.confirm import Confirmed, confirm
from sea_ident.discrepancy.data import PeriodData, period_data, waveform, wide_processing
from sea_ident.discrepancy.diagnosis import Diagnosis
from sea_ident.discrepancy.findings import Alternative, LackOfFit, MissingEffect, MissingParameter, Verdict, Waveforms
from sea_ident.discrepancy.fit import Fit
from sea_ident.discrepancy.forward import SimulationGap, simulation_gap
from sea_ident.discrepancy.gap import gap_of
from sea_ident.discrepancy.heldout import HeldOut, held_out
from sea_ident.discrepancy.judge import own_torque
from sea_ident.discrepancy.lack import lack_of_fit, remainder_share
from sea_ident.discrepancy.locate import locate
from sea_ident.discrepancy.next_experiment import with_next_experiment
from sea_ident.discrepancy.noise import NoiseFloor
from sea_ident.discrepancy.reference import ParameterChange, compare_with_reference
from sea_ident.discrepancy.repair import repaired_model
from sea_ident.discrepancy.search import Selection, search, without
from sea_ident.discrepancy.settle import settle
from sea_ident.discrepancy.trend import Trend, TrendTest, compare_periods
from sea_ident.discrepancy.unrepeated import diagnose_unrepeated, pushes_between_passes
from sea_ident.effects import Effect, spring_effects
from sea_ident.effects.signal import SignalEffect
from sea_ident.estimation import Model
from sea_ident.exceptions import DiagnosisError, SeaIdentWarning
from sea_ident.processing import ProcessedRecording, filter_recording, process
from sea_ident.recordings import Recording
from sea_ident.robot import Robot
from sea_ident.simulation import Controller

FEWEST_PERIODS = 10
"""Periods from which on an effect is named without reservation."""

FEWEST_TO_SEARCH = 3
"""Periods below which no finer effect is looked for: one difference of two periods is no noise floor."""

LARGEST_LEFT = 0.1
"""Share of the torque that may be left beside what few periods name [-]."""

LACK_LEVEL = 1e-3
"""Probability below which a remainder counts as something that is missing."""

LARGEST_REMAINDER = 3e-3
"""Share of the torque that may be left as what no model has [-]."""

WORTH_A_NAME = 1e-2
"""Share of the torque from which on what is left would be an effect of its own [-]: then no other name explains it."""

UNEXPLAINED = 0.5
"""Share of the excess from which on the effects found are no explanation of it [-]."""

Progress = Callable[[str, float], None]


def diagnose(
    model: Model,
    recording: Recording | ProcessedRecording,
    *,
    holdout: Recording | ProcessedRecording | None = None,
    reference: Model | None = None,
    period: float | None = None,
    controller: Controller | None = None,
    progress: Progress | None = None,
) -> Diagnosis:
    """Find where a model and a recording disagree beyond noise, name the missing effect, and test the name.

    Args:
        model: the model; its effects are refitted to the recording, so a model from CAD serves as well.
        recording: what was measured; ten periods or more for a name without reservation.
        holdout: another motion of the same robot, on which what is found must hold.
        reference: an earlier model of the same robot; shows what a refit absorbs (a payload, a changed inertia).
        period: [s]; found from the data by default.
        controller: what drove the motors, for the gap in forward simulation; where None, the velocity controller of
            `simulate` if it gives the measured torque, else the measured motion and torque stand in.
        progress: called with what is being done and the share that is done.

    Returns:
        The diagnosis.

    Raises:
        DiagnosisError: the recordings prove nothing (the same twice, another robot).
        RecordingError: a recording lacks what is needed.
    """
    tell = progress or (lambda what, share: None)
    tell("reading the periods", 0.0)
    robot = model.robot
    check.models_match(model, reference)
    check.columns_match(robot, recording)
    if holdout is not None:
        check.columns_match(robot, holdout)
        check.not_the_same(recording, holdout)
    with python_warnings.catch_warnings():
        python_warnings.simplefilter("ignore", SeaIdentWarning)
        processed = wide_processing(recording, robot, period or _period_of(model, recording))
    if processed.period is None or processed.periods < 2:
        return diagnose_unrepeated(model, processed, recording)
    if processed.periods < FEWEST_PERIODS and isinstance(recording, Recording):
        pushes = pushes_between_passes(model, recording, processed)
        if pushes:
            with python_warnings.catch_warnings():
                python_warnings.simplefilter("ignore", SeaIdentWarning)
                stretch = filter_recording(recording, robot)
            return diagnose_unrepeated(model, stretch, recording, round(processed.period / stretch.interval))
    whole = period_data(processed, robot)
    temperature = check.temperatures(recording, whole)
    data, notes = check.cleaned(whole, recording)
    if temperature is not None and len(temperature) != data.periods:
        temperature = None
    bench = Bench(data, model_effects(model))
    tell("searching", 0.1)
    basic = completed(bench)
    if basic is not None:
        selection = basic.selection
    elif data.periods < FEWEST_TO_SEARCH:
        selection = _unsearched(bench)
    else:
        selection = search(bench, bench.effects)
    confirmed = confirm(bench, selection)
    selection = confirmed.selection
    tell("comparing the periods", 0.5)
    trends = compare_periods(confirmed.bench, confirmed.final.fit, confirmed.final.noise, temperature)
    tell("looking for alternatives", 0.6)
    alternatives = assess.rivals(bench, selection) if basic is None else {}
    tell("testing on held-out data", 0.75)
    held, held_notes = held_out(bench, selection, holdout)
    weak = [] if held is None else [k for k, found in enumerate(held.transfers) if not found.holds]
    if held is not None and 0 < len(weak) < selection.added and held.other_motion:
        # what does not hold elsewhere beside what does was the form of the latter, no effect of its own
        confirmed = confirmed.less(without(bench, selection, weak))
        selection = confirmed.selection
        alternatives = assess.rivals(bench, selection)
        held, held_notes = held_out(bench, selection, holdout)
    change = compare_with_reference(bench, selection.start.fit, selection.start.noise, reference)
    tell("simulating", 0.85)
    repaired = repaired_model(model, _as_identified(recording, processed, robot), selection.final.fit)
    forward = _forward(model, repaired, selection, held, recording, processed, controller)
    basic_notes = (*circular_springs(robot, recording), *(() if basic is None else basic.warnings))
    notes = replace(notes, warnings=(*notes.warnings, *basic_notes, *held_notes, *forward.notes))
    tell("writing it down", 0.95)
    diagnosis = _conclude(bench, confirmed, trends, alternatives, held, change, notes)
    diagnosis = replace(diagnosis, model=repaired, simulation_gap=forward.gaps)
    if diagnosis.verdict is Verdict.AMBIGUOUS:
        tell("designing the next experiment", 0.97)
        diagnosis = with_next_experiment(diagnosis, bench, selection, alternatives)
    tell("done", 1.0)
    for text in diagnosis.warnings:
        python_warnings.warn(text, SeaIdentWarning, stacklevel=2)
    return diagnosis


def _unsearched(bench: Bench) -> Selection:
    """The model as it is, and what could have been seen beside it."""
    start = settle(bench, bench.effects)
    candidates = tuple(scan(bench, start.fit, start.noise))
    return Selection(start, start, 0, (), candidates, max(sum(c.tests for c in candidates), 1))


def _as_identified(
    recording: Recording | ProcessedRecording, processed: ProcessedRecording, robot: Robot
) -> ProcessedRecording:
    """The recording as `identify` processes it: with the harmonics that the data ask for, not those compared here."""
    if isinstance(recording, ProcessedRecording):
        return recording
    with python_warnings.catch_warnings():
        python_warnings.simplefilter("ignore", SeaIdentWarning)
        return process(recording, robot, period=processed.period)


def _forward(
    model: Model,
    repaired: Model | None,
    selection: Selection,
    held: HeldOut | None,
    recording: Recording | ProcessedRecording,
    processed: ProcessedRecording,
    controller: Controller | None,
) -> SimulationGap:
    """Forward simulation before and after, on another motion where there is one; nothing where nothing was added."""
    before = repaired_model(model, processed, selection.start.fit) if selection.added else None
    if before is None or repaired is None:
        return SimulationGap({}, ())
    if held is not None and held.processed is not None and held.recording is not None:
        return simulation_gap(before, repaired, held.recording, held.processed, controller)
    found = simulation_gap(before, repaired, recording, processed, controller)
    same = ("no other motion was given: forward simulation is compared on the motion that was used in the fit",)
    return replace(found, notes=(*same, *found.notes))


def model_effects(model: Model) -> tuple[Effect, ...]:
    """Effects of a model with its springs, and what else is in them, among them."""
    return (*model.effects, *spring_effects(model.robot), *model.spring_effects)


def _period_of(model: Model, recording: Recording | ProcessedRecording) -> float | None:
    """The period of the recording that the model was identified from, if this is the same one."""
    if isinstance(recording, Recording) and recording.source == model.recording:
        return model.fit.period
    return None


def _conclude(
    bench: Bench,
    confirmed: Confirmed,
    trends: TrendTest,
    alternatives: dict[int, tuple[Alternative, ...]],
    held: HeldOut | None,
    change: ParameterChange | None,
    notes: check.Findings,
) -> Diagnosis:
    selection = confirmed.selection
    start, final = selection.start, selection.final
    statistic, dof, p_value = lack_of_fit(confirmed.bench, confirmed.start)
    left, left_dof, left_p = lack_of_fit(confirmed.bench, confirmed.final)
    remainder = remainder_share(confirmed.bench, confirmed.final) if left_p < LACK_LEVEL else 0.0
    missing = [*_missing(bench, selection, alternatives, held), *(_missing_trend(bench, t) for t in trends.trends)]
    # what drifts differs from its first value in the mean too
    drifting = {(t.effect.name, t.effect.joint) for t in trends.trends}
    missing = [m for m in missing if (f"{m.effect}_drift", m.joint) not in drifting]
    if change is not None:
        missing.extend(change.missing)
    missing.sort(key=lambda m: -m.torque_share)
    unexplained = max(left - left_dof, 0.0) / max(statistic - dof, 1.0) if selection.added else 1.0
    verdict = _verdict(bench, missing, trends, change, remainder, unexplained, notes)
    gap = gap_of(bench, start.fit, final.fit, final.noise)
    held_gap = None if held is None else gap_of(held.bench, held.before, held.after, held.noise)
    facts = words.Facts(
        verdict=verdict, missing=tuple(missing), gap=gap, held=held_gap, remainder=remainder,
        periods=bench.data.periods, p_value=p_value, trend=trends, change=change,
        other_motion=held is not None and held.other_motion,
    )  # fmt: skip
    return Diagnosis(
        verdict=verdict,
        text=words.paragraph(facts),
        lack_of_fit=LackOfFit(
            statistic, dof, p_value, trends.p_value, _per_joint(bench, start.fit, start.noise), remainder
        ),
        locations=locate(bench, start.fit, start.noise),
        missing=tuple(missing),
        training=gap,
        holdout=held_gap,
        detectability=assess.detectability(bench, final.fit, final.noise, selection.candidates),
        warnings=tuple(dict.fromkeys((*notes.warnings, *trends.notes, *words.reservations(facts, held is not None)))),
        waveforms=_waveforms(bench, start.fit, final.fit, final.noise, selection),
        recording=bench.data.source,
        holdout_source=None if held is None else held.source,
    )


def _verdict(
    bench: Bench,
    missing: list[MissingEffect],
    trends: TrendTest,
    change: ParameterChange | None,
    remainder: float,
    unexplained: float,
    notes: check.Findings,
) -> Verdict:
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
    if any(m.transfer is not None and m.transfer <= 0.5 for m in structural):
        return Verdict.SUSPECT
    if remainder > LARGEST_LEFT and bench.data.periods < FEWEST_PERIODS:
        return Verdict.CANNOT_TELL
    nameless = remainder > WORTH_A_NAME and not all(m.effect in BASIC for m in structural)
    if large and (unexplained > UNEXPLAINED or nameless) and not trends.trends:
        return Verdict.NOT_IN_LIBRARY
    if any(m.alternatives for m in structural):
        return Verdict.AMBIGUOUS
    if large or trends.unnamed:
        return Verdict.NAMED_WITH_REMAINDER
    return Verdict.NAMED


def _missing(
    bench: Bench,
    selection: Selection,
    alternatives: dict[int, tuple[Alternative, ...]],
    held: HeldOut | None,
) -> list[MissingEffect]:
    fit = selection.final.fit
    first = len(fit.effects) - selection.added
    counts = bench.counts(fit.effects)
    out = []
    for k, position in enumerate(range(first, len(fit.effects))):
        effect = fit.effects[position]
        begin = sum(counts[:position])
        columns = fit.columns[begin : begin + counts[position]]
        parameters = [
            MissingParameter(c.name, float(fit.values[begin + i]), fit.std(begin + i), c.unit)
            for i, c in enumerate(columns)
        ]
        parameters.extend(_shape_parameters(bench, fit, position))
        transfer = held.transfers[k] if held is not None and held.transfers else None
        out.append(
            MissingEffect(
                effect=effect.name,
                joint=effect.joint,
                parameters=tuple(parameters),
                torque_share=own_torque(bench, fit, position),
                p_value=selection.p_values[k],
                alternatives=alternatives.get(position, ()),
                transfer=None if transfer is None or not transfer.tested else transfer.share,
                detail=effect,
                values=tuple(float(v) for v in fit.values[begin : begin + counts[position]]),
            )
        )
    return out


def _shape_parameters(bench: Bench, fit: Fit, position: int) -> list[MissingParameter]:
    effect = fit.effects[position]
    shapes = effect.amounts if isinstance(effect, SignalEffect) else effect.shapes
    out = []
    for shape in shapes:
        value = float(getattr(effect, shape.name))
        std = 0.0
        for k, (owner, free) in enumerate(fit.free_shapes):
            if owner == position and free.name == shape.name:
                step = fit.std(len(fit.columns) + k)
                std = step * abs(value) if shape.logarithmic else step * (shape.upper - shape.lower)
        out.append(
            MissingParameter(effect.parameter_name(shape.name), value, std, effect.shape_unit(shape, bench.robot))
        )
    return out


def _missing_trend(bench: Bench, trend: Trend) -> MissingEffect:
    effect = trend.effect
    parameters = [
        MissingParameter(c.name, float(v), float(s), c.unit)
        for c, v, s in zip(effect.columns(bench.robot), trend.values, trend.stds, strict=True)
    ]
    parameters.extend(
        MissingParameter(effect.parameter_name(s.name), float(getattr(effect, s.name)), 0.0, s.unit)
        for s in effect.shapes
    )
    others = tuple(Alternative(e.name, e.joint, share) for e, share in trend.alternatives)
    return MissingEffect(
        effect=effect.name,
        joint=effect.joint,
        parameters=tuple(parameters),
        torque_share=trend.torque_change,
        p_value=trend.p_value,
        alternatives=others,
        detail=effect,
        values=tuple(float(v) for v in trend.values),
    )


def _per_joint(bench: Bench, fit: Fit, noise: NoiseFloor) -> dict[str, dict[str, float]]:
    """Energy of the residual over that of the noise by joint and equation."""
    clean = np.sum(np.abs(bench.clean_residual(fit, noise)) ** 2, axis=0)
    out: dict[str, dict[str, float]] = {joint: {} for joint in bench.robot.joint_names}
    for e, equation in enumerate(bench.data.equations):
        out[equation.joint][str(equation.kind)] = float(clean[e] / max(noise.std[e] ** 2, 1e-300))
    return out


def _waveforms(bench: Bench, before: Fit, after: Fit, noise: NoiseFloor, selection: Selection) -> Waveforms:
    data = bench.data
    labels = tuple(f"{eq.joint} {eq.kind}" for eq in data.equations)
    explained: dict[str, FloatArray] = {}
    bands: dict[str, FloatArray] = {}
    first = len(after.effects) - selection.added
    for position in range(first, len(after.effects)):
        effect = after.effects[position]
        label = effect.name if effect.joint is None else f"{effect.name} at {effect.joint}"
        explained[label] = waveform(assess.contribution(bench, after, [position]), data.samples)
        bands[label] = assess.torque_std(bench, after, position)
    return Waveforms(
        time=data.motion.time - data.motion.time[0],
        equations=labels,
        before=waveform(bench.clean_residual(before, noise), data.samples),
        after=waveform(bench.clean_residual(after, noise), data.samples),
        noise=noise.std,
        q=data.motion.q,
        dtheta=data.motion.dtheta,
        deflection=data.motion.deflection,
        explained=explained,
        bands=bands,
    )


__all__ = ["DiagnosisError", "HeldOut", "PeriodData", "diagnose", "model_effects", "replace"]
