"""The model with what was found."""

import warnings as python_warnings
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.bench.fit import Fit
from sea_ident.discrepancy.measured.own_zeros import OwnZero, joints_with_own_zeros
from sea_ident.discrepancy.result.untold import BesideFit, in_base, widened
from sea_ident.effects import Anchor, Effect, Side, spring_effects
from sea_ident.estimation import Model
from sea_ident.estimation.identify import default_estimator, doubted_anew, identify_observed, with_values
from sea_ident.estimation.knowledge import regular_covariance
from sea_ident.estimation.observations import Observations
from sea_ident.exceptions import SeaIdentError, SeaIdentWarning
from sea_ident.processing import ProcessedRecording
from sea_ident.robot import Robot

OPEN = 0.5
"""Standard deviation, in logarithms or in shares of its range, from which on a recording leaves a shape open [-]."""

BLIND = 5.0
"""Times the standard deviation in the fit beyond which that of the model says that it does not see a parameter [-]."""


def repaired_model(model: Model, processed: ProcessedRecording, fit: Fit) -> Model | str:
    """The model identified anew with the effects that were found.

    `identify` weighs the sum of both equations of a joint sample by sample, without those beside a reversal. What a
    link equation tells, without any noise of torque, and what a friction does that falls within these samples is in the
    fit of the diagnosis: both are put together, weighted by their covariances. What the sum does not tell at all is
    that of the fit. A shape that the recording leaves open stays as the model had it.

    Args:
        model: the model that was diagnosed.
        processed: the recording.
        fit: the fit with the effects.

    Returns:
        A model like any other; why there is none, where that is not possible.
    """
    law = set(spring_effects(model.robot))
    known = (*model.effects, *model.spring_effects)
    found = with_open_shapes(model.robot, fit, known)
    unknown = joints_with_own_zeros(found)
    found = tuple(effect for effect in found if not isinstance(effect, OwnZero))
    effects = tuple(effect for effect in found if effect.side is not Side.SPRING or effect not in law)
    try:
        return identified_beside(model.robot, processed, effects, fit, sorted(unknown))
    except SeaIdentError as error:
        return str(error)


def identified_beside(
    robot: Robot,
    processed: ProcessedRecording,
    effects: Sequence[Effect],
    fit: Fit,
    unknown_zero: Sequence[str] = (),
) -> Model:
    """A model identified with what the motor torques do not tell from the fit of a diagnosis.

    Args:
        robot: the robot.
        processed: the recording.
        effects: as `identify` takes them.
        fit: to link and motor equations of the same recording, with the same parameters.
        unknown_zero: joints whose encoders of theta and q have different, unknown zeros.

    Returns:
        The model.

    Raises:
        IdentificationError: the recording does not determine it.
    """
    with python_warnings.catch_warnings():
        python_warnings.simplefilter("ignore", SeaIdentWarning)
        how = default_estimator(processed)
        # one stretch may be so long that its equations are never there at once
        beside = BesideFit(how, fit) if processed.periods > 1 else how
        found, observations, _ = identify_observed(robot, processed, effects, beside, unknown_zero)
        own = found if beside is how else widened(replace(found, estimator=how.name), observations, fit)
        return doubted_anew(with_what_it_misses(own, observations, fit), found)


def with_open_shapes(robot: Robot, fit: Fit, known: Sequence[Effect]) -> tuple[Effect, ...]:
    """The effects of a fit, with the shapes that it leaves open as in the effects that are known.

    What takes over such a shape from another effect follows: friction that builds up over a distance tells nothing of
    the speed at which the sign in its place turns over, and takes away that very sign.
    """
    effects = list(fit.effects)
    usual = {(type(effect), effect.joint): effect for effect in known}
    for k, (position, shape) in enumerate(fit.free_shapes):
        effect = effects[position]
        before = usual.get((type(effect), effect.joint))
        if before is not None and fit.std(len(fit.columns) + k) > OPEN:
            effects[position] = replace(effect, **{shape.name: getattr(before, shape.name)})
    if tuple(effects) == fit.effects:
        return fit.effects
    anchor = Anchor(robot, tuple(effects), fit.parameters)
    return tuple(effect.anchored(anchor) for effect in effects)


def with_what_it_misses(model: Model, observations: Observations, fit: Fit) -> Model:
    """A model with what the fit of a diagnosis tells of bodies, of friction at links and of what the model hardly sees.

    Both know the torques of the motors, so that what both see of a motor is not put together: it would count twice.

    Args:
        model: identified from the motor torques.
        observations: the equations that it was identified from.
        fit: to link and motor equations of the same recording, with the same parameters.

    Returns:
        The model; as it is where the fit tells nothing more.
    """
    base, known = model.base, in_base(fit, model.base)
    if known is None:
        return model
    there, factor = known
    own, fitted = regular_covariance(model), factor @ factor.T
    deviations = np.linalg.norm(factor, axis=1)
    blind = np.sqrt(np.diag(own)) > BLIND * deviations
    linked = model.robot.elastic_indices.size > 0
    sides = [base.columns[i].side for i in base.independent]
    told = [k for k, side in enumerate(sides) if blind[k] or (linked and side is not Side.MOTOR)]
    # of what acts in no sample that is compared the fit knows nothing, not even by how much
    told = [k for k in told if deviations[k] > 0.0]
    if not told:
        return model
    gain = own[:, told] @ np.linalg.inv((own + fitted)[np.ix_(told, told)])
    values = model.values + gain @ (there[told] - model.values[told])
    left = np.eye(len(values))
    left[:, told] -= gain
    # the fit knows all that the model knows: errors of the model are those of the fit, and some of its own beside them
    covariance = fitted + left @ _positive(own - fitted) @ left.T
    repeatability = left @ model.uncertainty.repeatability @ left.T  # of periods the fit has no influences
    uncertainty = replace(
        model.uncertainty,
        covariance=repeatability + _positive(covariance - repeatability),
        repeatability=repeatability,
        influences=model.uncertainty.influences @ left.T,
    )
    information = model.information.copy()
    information[np.ix_(told, told)] += np.linalg.inv(fitted[np.ix_(told, told)])
    return with_values(replace(model, uncertainty=uncertainty, information=information), observations, values)


def _positive(symmetric: FloatArray) -> FloatArray:
    """The part (b, b) of a symmetric matrix that is a covariance, in units in which its diagonal is one."""
    scale = np.sqrt(np.maximum(np.abs(np.diag(symmetric)), 1e-300))
    strength, directions = np.linalg.eigh(symmetric / np.outer(scale, scale))
    root = scale[:, None] * directions * np.sqrt(np.maximum(strength, 0.0))
    return np.asarray(root @ root.T, dtype=np.float64)
