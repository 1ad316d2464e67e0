"""`identify`: from a recording to a model."""

import warnings as python_warnings
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import scipy.linalg

from sea_ident._typing import FloatArray
from sea_ident.arguments import expect, expect_number, expect_optional
from sea_ident.base_parameters import BaseParameters, find_base_parameters, group_columns
from sea_ident.effects import Effect, JointEffect, base_effects
from sea_ident.effects.coulomb_friction import CoulombFriction
from sea_ident.effects.drift import TrendEffect
from sea_ident.effects.state import Side
from sea_ident.estimation.described_friction import described_friction
from sea_ident.estimation.estimators import Estimate, Estimator, InstrumentalVariables, PerSampleWLS
from sea_ident.estimation.long_recording import identify_long
from sea_ident.estimation.misplaced import misplaced_columns
from sea_ident.estimation.model import Excerpt, Fit, Model
from sea_ident.estimation.observations import Observations, stands
from sea_ident.estimation.repeated_steps import repeated_steps
from sea_ident.estimation.scales import doubts_of_springs
from sea_ident.estimation.separability import unseparated_friction
from sea_ident.estimation.signs import check_signs
from sea_ident.estimation.solve import condition_number, solve_weighted
from sea_ident.estimation.spring_result import Verdict
from sea_ident.estimation.spring_zero import other_zeros
from sea_ident.estimation.springs import springs_from
from sea_ident.estimation.uncertainty import Uncertainty, honest_uncertainty
from sea_ident.estimation.update import left_behind, updated
from sea_ident.exceptions import IdentificationError, SeaIdentWarning
from sea_ident.motion import Motion
from sea_ident.one_thread import one_thread
from sea_ident.processing import ProcessedRecording, process
from sea_ident.recordings import Recording
from sea_ident.regressor import regressor_chunks
from sea_ident.robot import Robot

VISIBLE = 1e-7
"""Singular values of the column-normalised regressor below this share of the largest tell nothing."""

SLOW = 0.01
"""v_off of Coulomb friction as a share of the largest speed, at joints where the usual v_off is more than 5 % of it."""

DENSE = 200 * 2**20
"""Bytes of regressor beyond which one stretch is reduced piece by piece."""

UNSAFE = (Verdict.CIRCULAR, Verdict.NOT_EXCITED)
"""Verdicts on springs of which a user is warned."""

Progress = Callable[[str, float], None]

EXCERPT = 500
"""Samples of the mean period that a model keeps."""


@one_thread
def identify(
    robot: Robot,
    recording: Recording | ProcessedRecording,
    *,
    effects: Sequence[Effect] | None = None,
    estimator: Estimator | None = None,
    period: float | None = None,
    link_harmonics: int | None = None,
    motor_harmonics: int | None = None,
    unknown_zero: Sequence[str] = (),
    prior: Model | None = None,
    progress: Progress | None = None,
) -> Model:
    """Identify the dynamic model of a robot, then its springs (paper, II.B and II.E).

    Args:
        robot: the robot.
        recording: what was measured, as it was read or already processed.
        effects: the model; bodies, rotors, viscous and Coulomb friction of every motor where None. Every spring is
            identified in the second step by its stiffness, cubic stiffness and damping, which are not to be given
            here; further effects in a spring (hysteresis, play, an offset) may be, and are fitted together with these.
        estimator: how; where None, the paper's weighting per sample, smoothed, with instruments from other periods
            against noise in the regressor where there are at least two periods.
        period: [s], of a recording that is not processed yet; found from the data where None.
        link_harmonics: harmonics of q; chosen from the data where None.
        motor_harmonics: harmonics of theta; chosen from the data where None.
        unknown_zero: joints whose encoders of theta and q have different, unknown zeros.
        prior: an earlier model of the robot, with the same effects; what has not changed since is taken from both.
        progress: called with what is being done and the share that is done.

    Returns:
        The model. Its standard deviations are those that the spread between periods shows, with what the model leaves
        beyond its noise and how friction may turn over besides.

    Raises:
        RecordingError: the recording lacks what is needed.
        IdentificationError: the data do not determine the model, or contradict its physics in every joint.
    """
    expect(robot, "identify: robot", Robot)
    expect(recording, "identify: recording", Recording, ProcessedRecording)
    expect_number(period, "identify: period", "s")
    for each in effects or ():
        expect(each, "identify: each of effects", Effect)
    if effects is not None and not effects:
        raise IdentificationError("effects is empty; name those of the model, or leave it out")
    expect_optional(estimator, "identify: estimator", Estimator)
    expect_optional(prior, "identify: prior", Model)
    tell = progress or (lambda what, share: None)
    if isinstance(recording, ProcessedRecording):
        processed = recording
    else:
        tell("averaging the periods", 0.0)
        processed = process(
            recording, robot, period=period, link_harmonics=link_harmonics, motor_harmonics=motor_harmonics
        )
    if processed.joint_names != robot.joint_names:
        raise IdentificationError(
            f"{processed.source} was processed for the joints {', '.join(processed.joint_names)}; {robot.name} has "
            f"{', '.join(robot.joint_names)}"
        )
    model, _, new = identify_observed(robot, processed, effects, estimator, unknown_zero, prior, tell)
    for text in new:
        python_warnings.warn(text, SeaIdentWarning, stacklevel=3)
    return model


def identify_observed(
    robot: Robot,
    processed: ProcessedRecording,
    effects: Sequence[Effect] | None = None,
    estimator: Estimator | None = None,
    unknown_zero: Sequence[str] = (),
    prior: Model | None = None,
    tell: Progress = lambda what, share: None,
) -> tuple[Model, Observations, tuple[str, ...]]:
    """What `identify` does with a processed recording: the model, the equations it was found from, and what to warn of.

    The equations serve `with_values`, which otherwise would have to be built for every period again.
    """
    chosen, in_springs = _split_springs(default_effects(robot, processed) if effects is None else tuple(effects))
    how = default_estimator(processed) if estimator is None else estimator
    found: list[str] = list(processed.warnings)
    first = len(found)
    tell("finding base parameters", 0.15)
    base, lost = visible_parameters(robot, chosen, processed)
    found.extend(lost)
    observations = Observations(robot, chosen, base, processed)
    tell(f"estimating {base.rank} base parameters", 0.2)
    if processed.periods == 1 and processed.samples * robot.n * base.rank * 8 > DENSE and not in_springs:
        model, more = identify_long(observations, how, unknown_zero)
        found.extend([*more, *_doubts(model)])
        return _told(model, found, processed.notes), observations, tuple(found[first:])
    estimate = how.estimate(observations)
    tell("comparing the periods", 0.75)
    uncertainty = honest_uncertainty(observations, estimate)
    found.extend([*estimate.warnings, *uncertainty.warnings])
    found.extend(check_signs(observations, misplaced_columns(robot, chosen, processed)))
    steps = repeated_steps(observations, how)
    model = _model(observations, estimate, uncertainty if steps is None else steps.widened(uncertainty), how.name)
    if prior is not None:
        model = _refitted(updated(model, prior), observations)
    tell("identifying springs", 0.85)
    if steps is None:
        springs = springs_from(observations, model.values, model.uncertainty, unknown_zero, in_springs)
    else:
        found.append(steps.text)
        # what steps do to the springs by way of the base parameters is counted with what they do to them directly
        known = uncertainty if prior is None else model.uncertainty
        springs = springs_from(observations, model.values, known, unknown_zero, in_springs)
        springs = steps.widened_springs(springs, model.values, known, unknown_zero, in_springs)
    model = replace(model, springs=springs)
    notes = (*processed.notes, *estimate.notes, *(() if prior is None else left_behind(prior)))
    found.extend([*_doubts(model), *other_zeros(observations, model.values, springs)])
    found.extend(described_friction(robot, chosen, springs))
    return _told(model, found, notes), observations, tuple(found[first:])


def _told(model: Model, found: Sequence[str], notes: tuple[str, ...]) -> Model:
    """The model with what a user should know of it."""
    return replace(model, warnings=tuple(dict.fromkeys(found)), notes=notes)


def _doubts(model: Model) -> list[str]:
    """What a user should know before trusting the numbers, from the numbers."""
    found = [*unseparated_friction(model.base, model.values, model.uncertainty)]
    found.extend(f"spring of {s.joint}: {s.note}" for s in model.springs if s.verdict in UNSAFE)
    found.extend(text for text in (spring.doubt() for spring in model.springs) if text is not None)
    found.extend(
        f"spring of {s.joint}: {t.effect.name} never slips in this motion, all of it or a part: that part is told from "
        "the stiffness by where it rests alone, which the motion does not show. Standard deviations count all of it; "
        "excite this joint more"
        for s in model.springs
        for t in s.terms
        if t.by_rest
    )
    found.extend(doubts_of_springs(model.robot, model.springs))
    return found


def default_estimator(processed: ProcessedRecording) -> Estimator:
    """The paper's weighting; with instruments from other periods where there are others."""
    return InstrumentalVariables() if processed.periods > 1 else PerSampleWLS()


def default_effects(robot: Robot, processed: ProcessedRecording) -> tuple[Effect, ...]:
    """Bodies, rotors, viscous and Coulomb friction, with v_off small against the speeds of the recording.

    Args:
        robot: the robot.
        processed: the recording.

    Returns:
        The effects.
    """
    found: list[Effect] = []
    for effect in base_effects(robot):
        if isinstance(effect, CoulombFriction):
            fastest = float(np.abs(processed.motion.dtheta[:, robot.index(effect.required_joint)]).max())
            if 0.0 < 5.0 * SLOW * fastest < effect.smoothing:
                effect = replace(effect, smoothing=float(f"{SLOW * fastest:.2g}"))
        found.append(effect)
    return tuple(found)


def visible_parameters(
    robot: Robot, effects: tuple[Effect, ...], processed: ProcessedRecording
) -> tuple[BaseParameters, tuple[str, ...]]:
    """Base parameters of the robot, or of what this motion shows of it.

    Args:
        robot: the robot.
        effects: the model.
        processed: the recording.

    Returns:
        The base parameters, and a warning that names what this motion cannot tell apart.

    Raises:
        IdentificationError: the motion shows nothing.
    """
    with python_warnings.catch_warnings():
        python_warnings.simplefilter("ignore", SeaIdentWarning)
        base = find_base_parameters(robot, effects)
    motion = _thinned(processed.motion, 600)
    triangle = np.zeros((0, len(base.columns)))
    for part in regressor_chunks(robot, effects, motion):
        rows = part.sum.reshape(-1, len(base.columns))
        triangle = np.asarray(scipy.linalg.qr(np.vstack([triangle, rows]), mode="r")[0][: len(base.columns)])
    held = {robot.joint_names[int(i)] for i in np.flatnonzero(stands(robot, processed))}
    # what follows a speed that is noise would be anything, and what does not may be what friction holds against
    hidden = [k for k, column in enumerate(base.columns) if column.joint in held and column.side is Side.MOTOR]
    triangle[:, hidden] = 0.0
    own = triangle[:, base.independent]
    norms = np.linalg.norm(own, axis=0)
    strength = np.linalg.svd(own / np.where(norms > 0.0, norms, 1.0), compute_uv=False)
    if norms.min() > 0.0 and strength[-1] > VISIBLE * strength[0]:
        return base, base.warnings
    with python_warnings.catch_warnings():
        python_warnings.simplefilter("ignore", SeaIdentWarning)
        less = group_columns(base.columns, triangle, VISIBLE)
    kept = set(less.independent.tolist())
    missing = [base.columns[k].name for k in base.independent if int(k) not in kept]
    return less, (
        f"{processed.source}: this motion tells {less.rank} of {base.rank} base parameters; not told, or told only in "
        f"sum with others: {', '.join(missing)}. Excite all joints",
    )


def _thinned(motion: Motion, samples: int) -> Motion:
    return motion[:: max(1, len(motion) // samples)]


def _split_springs(effects: tuple[Effect, ...]) -> tuple[tuple[Effect, ...], tuple[JointEffect, ...]]:
    """Effects that the motor torque shows, and those in springs, which cancel in it.

    Raises:
        IdentificationError: one is part of the law of every spring, changes in time, or stands at no single joint.
    """
    inside = []
    for effect in effects:
        if effect.side is not Side.SPRING:
            continue
        law = effect.name in ("spring_stiffness", "spring_damping") or (
            effect.name == "spring_stiffening" and effect.shape_values["exponent"] == 3.0
        )
        if law or isinstance(effect, TrendEffect) or not isinstance(effect, JointEffect):
            reason = "is part of the law of every spring" if law else "is none that one mean period shows"
            raise IdentificationError(
                f"the effect {effect.name!r} acts in a spring, which the motor torque does not show (it cancels in the "
                f"sum of link and motor rows), and {reason}: leave it out"
            )
        inside.append(effect)
    return tuple(effect for effect in effects if effect.side is not Side.SPRING), tuple(inside)


def _model(observations: Observations, estimate: Estimate, uncertainty: Uncertainty, name: str) -> Model:
    processed, rows = observations.processed, observations.rows
    residual, scatter = observations.residual(estimate.values), observations.period_residuals(estimate.values)
    plain = solve_weighted(rows, observations.torque)
    fit = Fit(
        rms_residual=np.sqrt(np.mean(residual**2, axis=0)),
        noise_std=np.sqrt(processed.raw_tau_variance.mean(axis=0) / processed.periods),
        rms_torque=np.sqrt(np.mean(observations.torque**2, axis=0)),
        condition_number=condition_number(plain.triangle),
        log_det=plain.log_det,
        log_det_weighted=estimate.log_det_weighted,
        samples=processed.samples,
        periods=processed.periods,
        period=processed.period,
        agreement=observations.agreement(residual, scatter),
    )
    weighted = rows * estimate.weights[:, :, None]
    count = rows.shape[-1]
    information = rows.reshape(-1, count).T @ weighted.reshape(-1, count)
    model = Model(
        robot=observations.robot,
        effects=observations.effects,
        base=observations.base,
        values=estimate.values,
        model_covariance=estimate.covariance,
        uncertainty=uncertainty,
        information=0.5 * (information + information.T),
        estimator=name,
        springs=(),
        fit=fit,
        excerpt=_no_excerpt(observations.robot.n),
        recording=processed.source,
    )
    thin = slice(None, None, max(1, -(-processed.samples // EXCERPT)))
    motion = processed.motion[thin]
    spring = observations.spring_torque(observations.mean, processed.tau_motor, estimate.values)[thin]
    excerpt = Excerpt(
        motion=motion,
        tau_motor=processed.tau_motor[thin],
        tau_std=np.sqrt(processed.raw_tau_variance[thin]),
        tau_model=processed.tau_motor[thin] - residual[thin],
        tau_spring=spring,
        residual_std=_spread(scatter, processed)[thin],
    )
    return replace(model, excerpt=excerpt)


def with_values(model: Model, observations: Observations, values: FloatArray) -> Model:
    """A model with other values (b,) of its base parameters, its residuals and its springs by these.

    Args:
        model: the model.
        observations: the equations that it was identified from.
        values: (b,) base parameters.
    """
    changed = _refitted(replace(model, values=values), observations)
    inside = tuple(effect for effect in model.spring_effects if isinstance(effect, JointEffect))
    zeros = [spring.joint for spring in model.springs if spring.zero != 0.0]
    return replace(changed, springs=springs_from(observations, values, model.uncertainty, zeros, inside))


def doubted_anew(model: Model, before: Model) -> Model:
    """A model whose numbers were changed, without the doubts about those before, with what is to be doubted now.

    Args:
        model: the model.
        before: as it was identified, with all of its warnings.
    """
    gone = set(_doubts(before))
    kept = [text for text in model.warnings if text not in gone]
    return replace(model, warnings=tuple(dict.fromkeys([*kept, *_doubts(model)])))


def _refitted(model: Model, observations: Observations) -> Model:
    """The residuals of a model whose values were changed after the fit."""
    residual, scatter = observations.residual(model.values), observations.period_residuals(model.values)
    thin = slice(None, None, max(1, -(-len(residual) // EXCERPT)))
    return replace(
        model,
        fit=replace(
            model.fit,
            rms_residual=np.sqrt(np.mean(residual**2, axis=0)),
            agreement=observations.agreement(residual, scatter),
        ),
        excerpt=replace(
            model.excerpt,
            tau_model=observations.torque[thin] - residual[thin],
            tau_spring=observations.spring_torque(observations.mean, observations.torque, model.values)[thin],
            residual_std=_spread(scatter, observations.processed)[thin],
        ),
    )


def _spread(residuals: FloatArray, processed: ProcessedRecording) -> FloatArray:
    """(N, n) standard deviation of the residuals (P, N, n) of the periods; of the torque where there is one only."""
    if len(residuals) < 2:
        return np.sqrt(processed.raw_tau_variance)
    return np.asarray(residuals.std(axis=0, ddof=1), dtype=np.float64)


def _no_excerpt(n: int) -> Excerpt:
    empty = np.zeros((0, n))
    return Excerpt(Motion.rigid(np.zeros(0), empty, empty, empty), empty, empty, empty, empty, empty)
