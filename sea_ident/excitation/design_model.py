"""Which columns a design is about: base parameters of the model, springs, and the target of a discrimination."""

from dataclasses import dataclass

import numpy as np
import scipy.linalg

from sea_ident._typing import FloatArray, IntArray
from sea_ident.base_parameters import find_base_parameters, random_motion
from sea_ident.effects import Effect, Side
from sea_ident.effects.coulomb_friction import CoulombFriction
from sea_ident.effects.rigid_bodies import RigidBodies
from sea_ident.effects.rotor_inertia import RotorInertia
from sea_ident.effects.viscous_friction import ViscousFriction
from sea_ident.exceptions import ExcitationError
from sea_ident.excitation.columns import ModelColumns
from sea_ident.excitation.criteria import Criterion, Discrimination
from sea_ident.excitation.springs import PredictedMotors, SpringTorque
from sea_ident.motion import Motion
from sea_ident.regressor import model_columns
from sea_ident.robot import Robot

# A column whose part outside the span of the others is below this share of its norm cannot be told from them.
_INVISIBLE = 1e-7


@dataclass(frozen=True, eq=False)
class DesignModel:
    """The columns that a design is about.

    Attributes:
        columns: the columns.
        names: (p,) names of their parameters.
        springs: springs that predict theta from q; None where theta = q.
    """

    columns: ModelColumns
    names: tuple[str, ...]
    springs: SpringTorque | None


def reduced_effects(robot: Robot) -> tuple[Effect, ...]:
    """The model that an excitation can be designed for before anything is known (paper, eq. 14).

    Bodies, and viscous and Coulomb friction lumped at the joints; no springs and no motor inertia.
    """
    return (*RigidBodies.instances(robot), *ViscousFriction.instances(robot), *CoulombFriction.instances(robot))


def design_model(
    robot: Robot, effects: tuple[Effect, ...], criterion: Criterion, motors: PredictedMotors | None
) -> tuple[DesignModel, Criterion]:
    """Choose the columns of a design.

    Args:
        robot: the robot.
        effects: the model.
        criterion: what is to be raised.
        motors: how theta follows from q.

    Returns:
        The columns, and the criterion for them.

    Raises:
        ExcitationError: effects that no such motion can show.
    """
    springs = None if motors is None else motors.springs(robot)
    if not isinstance(criterion, Discrimination):
        columns, names = _independent(robot, effects, springs is not None)
        return DesignModel(columns, names, springs), criterion
    known = tuple(dict.fromkeys((*effects, *criterion.against)))
    if criterion.target in known:
        raise ExcitationError(
            f"the target {criterion.target.parameter_name()} of the discrimination is part of the model already"
        )
    rest, names = _independent(robot, known, springs is not None)
    labels = [column.name for column in criterion.target.columns(robot)]
    start = len(model_columns(robot, known))
    chosen = np.concatenate([rest.chosen, start + np.arange(len(labels))])
    columns = ModelColumns(robot, (*known, criterion.target), chosen, rest.elastic, rest.separate)
    _check_visible(columns, len(labels), criterion)
    return DesignModel(columns, (*names, *labels), springs), criterion.bind(len(labels))


def _independent(robot: Robot, effects: tuple[Effect, ...], elastic: bool) -> tuple[ModelColumns, tuple[str, ...]]:
    """Columns that are linearly independent in the motions that the design can choose."""
    labels = model_columns(robot, effects)
    spring = sorted({label.effect for label in labels if label.side is Side.SPRING})
    if spring and not elastic:
        raise ExcitationError(
            f"the effects {', '.join(spring)} act in springs, which a motion with theta = q does not bend; give "
            f"motors=PredictedMotors()"
        )
    if not spring:
        motion = None
        if not elastic and any(isinstance(effect, RotorInertia) for effect in effects):
            states = random_motion(robot, max(40, 4 * (len(labels) // robot.n + 1)))
            motion = Motion.rigid(states.time, states.q, states.dq, states.ddq)
        base = find_base_parameters(robot, effects, motion)
        return ModelColumns(robot, effects, base.independent, elastic), base.names
    # the sum of link and motor rows hides the springs; they are independent of all else in rows that are kept apart
    others = tuple(effect for effect in effects if effect.side is not Side.SPRING)
    base = find_base_parameters(robot, others)
    named = dict(zip((labels_of.name for labels_of in base.columns), range(len(base.columns)), strict=True))
    kept = {base.columns[int(k)].name: name for k, name in zip(base.independent, base.names, strict=True)}
    chosen = [k for k, label in enumerate(labels) if label.name in kept or label.name not in named]
    names = tuple(kept.get(labels[k].name, labels[k].name) for k in chosen)
    return ModelColumns(robot, effects, np.array(chosen, dtype=np.intp), elastic=True, separate=True), names


def _check_visible(columns: ModelColumns, target: int, criterion: Discrimination) -> None:
    """Refuse a target that no motion tells from the rest."""
    motion = random_motion(columns.robot, 200)
    if not columns.elastic:
        motion = Motion.rigid(motion.time, motion.q, motion.dq, motion.ddq)
    phi: FloatArray = columns.at(motion).columns().transpose(0, 2, 1).reshape(-1, len(columns.chosen))
    norms = np.linalg.norm(phi, axis=0)
    phi = phi / np.where(norms > 0.0, norms, 1.0)
    upper: FloatArray = scipy.linalg.qr(phi, mode="r")[0]
    left: IntArray = np.flatnonzero(np.abs(np.diag(upper))[-target:] < _INVISIBLE)
    if len(left):
        against = ", ".join(effect.parameter_name() for effect in criterion.against) or "the model"
        raise ExcitationError(
            f"no motion tells {criterion.target.parameter_name()} from {against}: its column lies in the span of theirs"
        )
