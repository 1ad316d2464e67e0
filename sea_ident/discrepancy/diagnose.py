"""`diagnose`: where a model and a recording disagree, and which effect is missing."""

import warnings as python_warnings
from collections.abc import Collection
from dataclasses import replace

from sea_ident.arguments import expect, expect_number
from sea_ident.discrepancy import words
from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.columns import Key, effect_key
from sea_ident.discrepancy.bench.gap import torque_by_joint
from sea_ident.discrepancy.bench.judge import FEWEST_TO_SEARCH
from sea_ident.discrepancy.bench.lack import LACK_LEVEL, lack_of_fit
from sea_ident.discrepancy.changing import Changing, followed
from sea_ident.discrepancy.compared.against import against
from sea_ident.discrepancy.compared.decide import Alternatives, decide, declared, simplest_first
from sea_ident.discrepancy.compared.heldout import HeldOut, held_out
from sea_ident.discrepancy.compared.resting import resting, with_constants_at_rest
from sea_ident.discrepancy.conclude import FEWEST_PERIODS, beyond_the_library, conclude
from sea_ident.discrepancy.evidence import assess
from sea_ident.discrepancy.evidence.next_experiment import with_next_experiment
from sea_ident.discrepancy.evidence.sensor_limits import limits
from sea_ident.discrepancy.measured import check
from sea_ident.discrepancy.measured.circular import circular_springs
from sea_ident.discrepancy.measured.data import period_data, wide_processing
from sea_ident.discrepancy.measured.own_zeros import own_zeros
from sea_ident.discrepancy.measured.same import not_the_same
from sea_ident.discrepancy.nameless.drifting import drifting
from sea_ident.discrepancy.nameless.stand_ins import stand_ins
from sea_ident.discrepancy.nameless.unnamed import Unnamed, unnamed
from sea_ident.discrepancy.result.diagnosis import Diagnosis
from sea_ident.discrepancy.result.findings import Verdict
from sea_ident.discrepancy.search.base_model import completed
from sea_ident.discrepancy.search.breakaway import stiction
from sea_ident.discrepancy.search.confirm import Confirmed, confirm, explains_nearly_all
from sea_ident.discrepancy.search.edges import stays_on_the_centre
from sea_ident.discrepancy.search.search import Selection, search, without
from sea_ident.discrepancy.searching import Progress, compared, searched_with_possible_springs, unsearched
from sea_ident.discrepancy.simulated.repaired import repair, with_repaired
from sea_ident.discrepancy.trends.trend import TrendTest
from sea_ident.discrepancy.unrepeated import diagnose_pushed, diagnose_unrepeated, pushes_between_passes
from sea_ident.effects import Effect, spring_effects
from sea_ident.effects.motor_encoder_offset import MotorEncoderOffset
from sea_ident.effects.spring_hysteresis import SpringHysteresis
from sea_ident.effects.spring_offset import SpringOffset
from sea_ident.estimation import Model
from sea_ident.estimation.observations import Observations
from sea_ident.estimation.scales import doubts_of_springs
from sea_ident.estimation.spring_zero import zeros_apart
from sea_ident.estimation.torque_units import other_torque_units
from sea_ident.estimation.turned_zeros import turned_zeros
from sea_ident.estimation.unknown_zeros import unknown_zeros, with_its_zeros, with_zeros
from sea_ident.exceptions import SeaIdentWarning
from sea_ident.one_thread import one_thread
from sea_ident.processing import ProcessedRecording, filter_recording
from sea_ident.processing.doubt import DoubtKind, texts_of
from sea_ident.recordings import Recording
from sea_ident.side_by_side import follows, shared
from sea_ident.simulation import Controller


@one_thread
@shared
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

    On Linux a second core is used where there is one, to the same result; the environment variable
    `LOKY_MAX_CPU_COUNT`, set to 1, keeps it to one, and in a worker process of several it has but one.

    With a model that was identified with `unknown_zero`, every recording is read with the zero of its own.

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
        DiagnosisError: the recordings prove nothing (the same twice, another robot, time in another unit).
        RecordingError: a recording lacks what is needed.
    """
    expect(model, "diagnose: model", Model)
    expect(recording, "diagnose: recording", Recording, ProcessedRecording)
    expect_number(period, "diagnose: period", "s")
    tell = progress if progress is not None and not follows() else (lambda what, share: None)
    tell("reading the periods", 0.0)
    robot = model.robot
    check.models_match(model, reference)
    for given in (recording, holdout):
        if given is not None:
            check.columns_match(robot, given)
            check.channels_move(robot, given)
            check.clock_in_seconds(given)
    if holdout is not None:
        not_the_same(recording, holdout)
    period = period or _period_of(model, recording)
    elsewhere: dict[str, float] = {}
    recording, zeros = with_its_zeros(model, recording, period)
    if holdout is not None:
        holdout, elsewhere = with_its_zeros(model, holdout, None)
    diagnosis = _diagnosed(model, recording, holdout, reference, period, controller, tell)
    said = words.fitted_zeros(robot, zeros, elsewhere)
    found = diagnosis.model
    diagnosis = replace(
        diagnosis,
        warnings=(*said, *diagnosis.warnings),
        model=None if found is None else with_zeros(found, zeros),
    )
    tell("done", 1.0)
    for text in diagnosis.warnings:
        python_warnings.warn(text, SeaIdentWarning, stacklevel=4)
    return diagnosis


def _diagnosed(
    model: Model,
    recording: Recording | ProcessedRecording,
    holdout: Recording | ProcessedRecording | None,
    reference: Model | None,
    period: float | None,
    controller: Controller | None,
    tell: Progress,
) -> Diagnosis:
    """The diagnosis of recordings in which theta and q have common zeros, but for what it finds."""
    robot = model.robot
    with python_warnings.catch_warnings():
        python_warnings.simplefilter("ignore", SeaIdentWarning)
        processed = wide_processing(recording, robot, period)
    if processed.period is None or processed.periods < 2:
        return diagnose_unrepeated(model, processed, recording)
    recording = processed.used_of(recording)
    if processed.periods < FEWEST_PERIODS and isinstance(recording, Recording):
        pushes = pushes_between_passes(model, recording, processed)
        if pushes:
            with python_warnings.catch_warnings():
                python_warnings.simplefilter("ignore", SeaIdentWarning)
                stretch = filter_recording(recording, robot)
            diagnosis = diagnose_pushed(model, stretch, recording, round(processed.period / stretch.interval))
            if diagnosis is not None:
                return diagnosis
    whole = period_data(processed, robot)
    data, notes = check.cleaned(whole, recording)
    as_identified = check.as_identified(recording, processed, robot)
    wrong = (*check.wrong_columns(robot, model.effects, as_identified), *other_torque_units(model, processed))
    notes = check.Findings((*notes.warnings, *wrong), fatal=notes.fatal or bool(wrong))
    notes = replace(notes, doubtful=bool(texts_of(processed.doubts, DoubtKind.POSITION)))
    changing = Changing.of(model, recording, data)
    bench = Bench(data, model_effects(model))
    apart = zeros_apart(Observations(robot, model.effects, model.base, as_identified), unknown_zeros(model))
    tell("searching", 0.1)
    basic = completed(bench)
    if basic is not None:
        found = compared(bench, confirm(bench, basic.selection), changing)
    elif data.periods < FEWEST_TO_SEARCH or wrong or notes.doubtful:
        found = unsearched(bench, changing)
    else:
        zeros = (
            *turned_zeros(robot, model.effects, as_identified),
            *(MotorEncoderOffset(other.joint, offset=other.zero) for other in apart),
        )
        found = searched_with_possible_springs(bench, changing, tell, zeros)
    bench, confirmed, trends = found.bench, found.confirmed, found.trends
    tell("looking for alternatives", 0.6)
    alternatives: Alternatives = {}
    if basic is None:
        selection, alternatives = _with_alternatives(bench, confirmed.selection)
        confirmed = confirmed if selection is confirmed.selection else confirmed.less(selection)
    tell("testing on held-out data", 0.75)
    confirmed, alternatives, held, held_notes = _tested(bench, confirmed, alternatives, trends, holdout)
    selection, alternatives, held = with_constants_at_rest(bench, confirmed.selection, alternatives, held)
    confirmed = confirmed if selection is confirmed.selection else confirmed.less(selection)
    nameless: tuple[Unnamed, ...] = ()
    if basic is None:
        drifts = drifting(confirmed.bench, confirmed.final, trends, changing.temperature)
        away = (confirmed.bench, confirmed.final)
        nameless = (*unnamed(bench, selection, held, away), *stand_ins(bench, selection), *drifts)
    change, change_notes = against(reference, bench, selection.final, as_identified)
    tell("simulating", 0.85)
    after = (as_identified, selection.final.fit)
    before = (processed, selection.start.fit) if selection.added else None
    there = changing.elsewhere(bench, selection.final.fit, trends, held)
    repaired = repair(model, after, before, held, recording, processed, controller, there.present(robot))
    spoken = (*_sticking(bench, selection), *_at_rest(selection, held), *_on_centres(bench, selection))
    of_springs = (
        *doubts_of_springs(robot, model.springs),
        *(other.text for other in apart),
        *circular_springs(robot, recording),
    )
    of_sensors, limited = limits(confirmed.bench, confirmed.start, processed.encoder_steps, confirmed.final)
    basic_notes = (*of_sensors, *of_springs, *(() if basic is None else basic.warnings))
    of_drifts = (*changing.not_shown_by(trends), *there.notes)
    said = (
        *notes.warnings,
        *found.notes,
        *basic_notes,
        *spoken,
        *of_drifts,
        *held_notes,
        *change_notes,
        *repaired.notes,
    )
    notes = replace(notes, warnings=said, limited=limited, apart=bool(apart))
    tell("writing it down", 0.95)
    held = followed(held, there.changed)
    diagnosis = conclude(bench, confirmed, trends, alternatives, held, change, notes, nameless)
    if diagnosis.training is not None:
        repaired = repaired.changing(changing.terms(bench, selection.final.fit, trends))
        diagnosis = with_repaired(diagnosis, repaired, torque_by_joint(bench))
        diagnosis = replace(diagnosis, trend_gap=changing.gaps(bench, selection.final.fit, trends, held))
    if diagnosis.verdict is Verdict.AMBIGUOUS:
        tell("designing the next experiment", 0.97)
        diagnosis = with_next_experiment(diagnosis, bench, selection, alternatives)
    return replace(diagnosis, units=check.torque_units(robot))


def _tested(
    bench: Bench,
    confirmed: Confirmed,
    alternatives: Alternatives,
    trends: TrendTest,
    holdout: Recording | ProcessedRecording | None,
) -> tuple[Confirmed, Alternatives, HeldOut | None, tuple[str, ...]]:
    """What was found, tested on data that were not used.

    Another motion decides between equals, and what does not hold on it beside what does was the form of the latter, no
    effect of its own. Where nothing holds, the worst is what spoils the others, for each is tried beside all of them.
    Where something is ruled out beside what holds, what it stood in for is looked for, once.
    """
    held, notes = held_out(bench, confirmed.selection, holdout)
    if held is None or not held.other_motion:
        return confirmed, declared(alternatives), held, notes
    constant, slipping = (confirmed.selection.joints_of(kind) for kind in (SpringOffset, SpringHysteresis))
    if beyond_the_library(confirmed, trends):
        alternatives = declared(alternatives)
    elif alternatives:
        selection, alternatives, held = decide(bench, confirmed.selection, alternatives, held)
        confirmed = confirmed if selection is confirmed.selection else confirmed.less(selection)
    searched = False
    while weak := _out(held, len(trends.trends), _elsewhere(confirmed.selection, held, trends)):
        left = without(bench, confirmed.selection, weak)
        ruled_out = {effect_key(confirmed.selection.effects[k]) for k in weak}
        other = None if searched else _searched_beside(bench, left, ruled_out)
        searched = True
        confirmed = (other or confirmed).less(left if other is None else other.selection)
        held, alternatives = held.again(confirmed.selection), {}
        if not beyond_the_library(confirmed, trends):
            selection, alternatives = _with_alternatives(bench, confirmed.selection)
            held = held if selection is confirmed.selection else held.again(selection)
            selection, alternatives, held = decide(bench, selection, alternatives, held)
            confirmed = confirmed if selection is confirmed.selection else confirmed.less(selection)
    read_there = confirmed.selection.joints_of(SpringHysteresis) & (constant - slipping)
    told = tuple(words.told_by_the_other_motion(joint) for joint in sorted(read_there))
    return confirmed, alternatives, held, (*notes, *told)


def _searched_beside(bench: Bench, left: Selection, ruled_out: set[Key]) -> Confirmed | None:
    """What is found beside what is left where the rest was ruled out; None where nothing is, or little was left.

    What spoke for an effect that does not hold is still there, and another one may stand behind it.
    """
    lacks = left.added > 0 and lack_of_fit(bench, left.final)[2] < LACK_LEVEL
    if not lacks or not explains_nearly_all(bench, left.start.fit, left.final):
        return None
    found = confirm(bench, search(bench, bench.effects, left, ruled_out))
    return found if found.selection.added > left.added else None


def _elsewhere(selection: Selection, held: HeldOut, trends: TrendTest) -> set[int]:
    """Which of the effects that were added need not be the same on another motion.

    Where dry friction in a spring rests, and what drifts: its mean is another one over every recording.
    """
    drifting = {k for k, e in enumerate(selection.effects) if (f"{e.name}_drift", e.joint) in trends.names}
    return drifting | set(resting(selection, held))


def _out(held: HeldOut, drifting: int, elsewhere: Collection[int]) -> list[int]:
    """Which effects do not hold on another motion, of those of which something is left beside as many that drift.

    Args:
        held: the other motion.
        drifting: number of effects that drift.
        elsewhere: effects that need not be the same there.
    """
    tried = [k for k in range(len(held.transfers)) if k not in elsewhere]
    weak = [k for k in tried if held.transfers[k].ruled_out]
    if len(weak) < len(tried) + drifting:
        return weak
    return [min(weak, key=lambda k: held.transfers[k].share)] if len(weak) > 1 else []


def _with_alternatives(bench: Bench, selection: Selection) -> tuple[Selection, Alternatives]:
    """What was found, the simplest of what this motion does not tell apart, and what else it could be."""
    return simplest_first(bench, selection, assess.rivals(bench, selection))


def _sticking(bench: Bench, selection: Selection) -> tuple[str, ...]:
    """What the passes say of the stiction that was found, in words."""
    final, units = selection.final, check.torque_units(bench.robot)
    count = len(final.fit.effects)
    shown = [stiction(bench, final.fit, k, final.noise) for k in range(count - selection.added, count)]
    return tuple(words.stiction(each, units[each.joint]) for each in shown if each is not None)


def _at_rest(selection: Selection, held: HeldOut | None) -> tuple[str, ...]:
    """Where the dry friction of springs rests, in words."""
    constants = (selection.effects[k] for k in resting(selection, held))
    return tuple(words.at_rest(effect.required_joint) for effect in constants if isinstance(effect, SpringOffset))


def _on_centres(bench: Bench, selection: Selection) -> tuple[str, ...]:
    """Which pushes are told as if on the centre of mass, in words."""
    fit, count = selection.final.fit, len(selection.final.fit.effects)
    told = [k for k in range(count - selection.added, count) if stays_on_the_centre(bench, fit, k)]
    return tuple(words.on_the_centre(fit.effects[k].joint or "") for k in told)


def model_effects(model: Model) -> tuple[Effect, ...]:
    """Effects of a model with its springs, and what else is in them, among them."""
    return (*model.effects, *spring_effects(model.robot), *model.spring_effects, *own_zeros(model))


def _period_of(model: Model, recording: Recording | ProcessedRecording) -> float | None:
    """The period of the recording that the model was identified from, if this is the same one."""
    if isinstance(recording, Recording) and recording.source == model.recording:
        return model.fit.period
    return None
