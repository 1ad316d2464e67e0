"""Errors of the sizes that a diagnosis gives, in standard deviations of its own, where the truth has the same form."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from sea_ident.effects import Effect, Side
from sea_ident.robot import Robot
from tests.benchmarks.hidden_effects.case import Case, FloatArray, Planted
from tests.benchmarks.hidden_effects.mjcf import COUPLED_SHARE
from tests.benchmarks.hidden_effects.plants import Truth, nominal_robot
from tests.benchmarks.hidden_effects.project_engine import planted_effects

OTHERWISE_BUILT = ("link_flexibility",)
"""Effects that the other engine has in another form: there what turns with the encoder has an inertia of its own."""

NOT_OF_THE_EFFECT = {
    "presliding_friction": ("",),
    "backlash": ("", "_cubic"),
}
"""Parameters that are friction or stiffness of the base model, by what follows the name of the effect."""

OF_THE_RECORD = ("torque_constant", "torque_constant_drift", "torque_saturation")
"""Effects at the motor that are shares of its torque, or of what the record has of it, and no torque of their own."""

HOW_IT_TURNS = ("_smoothing", "_softness")
"""Shapes of how friction turns over, or play ends: each engine has its own form."""


def size_errors(planted: Planted, entry: Mapping[str, Any], case: Case, truth: Truth) -> list[float]:
    """Errors over standard deviations [-] of what an entry of `missing` says of an effect that it names rightly.

    Args:
        planted: the truth.
        entry: with its parameters.
        case: that it was planted in.
        truth: the base model.

    Returns:
        One for every parameter that is comparable and was not held; none where the form of the truth is another.
    """
    if planted.form != "library" or planted.effect in OTHERWISE_BUILT:
        return []
    told = {p["name"]: (float(p["value"]), float(p["std"])) for p in entry.get("parameters", ())}
    free = {name for name, (_, std) in told.items() if std > 0.0}
    if planted.effect == "external_force" and not any("_point_" in name for name in free):
        return []  # on a point that is only assumed, a force is as large as that is far from the joint
    known = true_parameters(planted, case, truth)
    return [(told[name][0] - value) / told[name][1] for name, value in known.items() if name in free]


def true_parameters(planted: Planted, case: Case, truth: Truth) -> dict[str, float]:
    """Parameters that the library would tell of a planted effect, by their names.

    Args:
        planted: the effect, in the library's form.
        case: that it was planted in.
        truth: the base model.
    """
    robot = truth.robot
    (there, *_) = planted_effects(planted, truth, case.friction_smoothing, case.period, case.periods)
    effect, stem = there.effect, there.effect.parameter_name()
    recorded = _recorded_share(effect, case, truth)
    known = {column.name: recorded * float(v) for column, v in zip(effect.columns(robot), there.values, strict=True)}
    known |= {effect.parameter_name(shape.name): float(getattr(effect, shape.name)) for shape in effect.ranges}
    if planted.effect == "external_force":
        # it meets the link at its true centre of mass, and is told from where the description has it
        away = _centre(robot, planted.joint) - _centre(nominal_robot(case.robot), planted.joint)
        known |= {f"{stem}_point_{axis}": float(distance) for axis, distance in zip("xyz", away, strict=True)}
    if planted.effect == "transmission_coupling" and case.engine == "mujoco":
        # there with what the motor has, not with what its description says, and with most of its inertia
        i, other = robot.index(str(planted.joint)), robot.joint_names[int(planted.shape["other"])]
        known[f"{stem}_inertia_from_{other}"] *= COUPLED_SHARE
        for kind, friction in (("viscous", truth.viscous), ("coulomb", truth.coulomb)):
            known[f"{stem}_{kind}_from_{other}"] = planted.size * float(friction[i])
    left_out = {f"{stem}{label}" for label in (*HOW_IT_TURNS, *NOT_OF_THE_EFFECT.get(planted.effect, ()))}
    return {name: value for name, value in known.items() if name.partition("_from_")[0] not in left_out}


def _recorded_share(effect: Effect, case: Case, truth: Truth) -> float:
    """Share of the torque of an effect at a motor that the record has, where the torque constant is another one."""
    if effect.side is not Side.MOTOR or effect.name in OF_THE_RECORD:
        return 1.0
    share = 1.0
    for planted in case.planted:
        if planted.effect == "torque_constant" and planted.joint == effect.joint:
            (there, *_) = planted_effects(planted, truth, case.friction_smoothing, case.period, case.periods)
            share += float(there.values[0])
    return share


def _centre(robot: Robot, joint: str | None) -> FloatArray:
    """(3,) centre of mass of the link that a joint moves [m]."""
    model = robot.extended_model
    body = next(int(k) for k in robot.body_indices if model.names[int(k)] == joint)
    return np.array(model.inertias[body].lever)
