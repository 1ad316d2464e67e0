"""A plant out of a model: effects and the values of their parameters."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.effects import Effect, make_effect
from sea_ident.estimation import Model, physical_parameters
from sea_ident.exceptions import SimulationError
from sea_ident.robot import Robot
from sea_ident.simulation.friction import FrictionLaw, SmoothCoulomb
from sea_ident.simulation.plant import Plant, PlantedEffect

_AS_NUMBERS = {
    "viscous_friction": ("viscous_friction",),
    "coulomb_friction": ("coulomb_friction",),
    "spring_stiffness": ("stiffness",),
    "spring_stiffening": ("cubic_stiffness",),
    "spring_damping": ("spring_damping",),
}


@dataclass(frozen=True, eq=False)
class ModelPlant:
    """What `simulate` needs to simulate a model m: ``plant=m.plant, friction=m.friction, effects=m.effects``.

    Attributes:
        plant: bodies, rotors, springs and friction.
        friction: (n,) friction laws, with the smoothing of the model.
        effects: all other effects of the model.
    """

    plant: Plant
    friction: tuple[FrictionLaw, ...]
    effects: tuple[PlantedEffect, ...]


def plant_from_identified(model: Model, beside: Sequence[PlantedEffect] = ()) -> ModelPlant:
    """The plant that behaves as an identified model says.

    What the data leave free of the bodies has the physically consistent values nearest to those of the description.

    Args:
        model: the model.
        beside: effects that act beside those of the model.

    Returns:
        The plant, its friction laws and the effects that act beside it, those in the springs included.

    Raises:
        IdentificationError: no physically consistent parameters are found.
        SimulationError: a spring was not excited, so that its stiffness is not positive.
    """
    physical = physical_parameters(model)
    robot, values = model.robot, [physical.values]
    effects: list[Effect] = [*model.effects]
    for spring in model.springs:
        names = ("spring_stiffness", "spring_stiffening", "spring_damping")
        effects.extend(make_effect(name, spring.joint) for name in names)
        values.append(np.array(spring.law))
        for term in spring.terms:
            effects.append(term.effect)
            values.append(np.array(term.values))
    for trend in model.trends:
        effects.append(trend.effect)
        values.append(np.array(trend.values))
    for planted in beside:
        effects.append(planted.effect)
        values.append(planted.values)
    return plant_from_model(robot, effects, np.concatenate(values))


def plant_from_model(robot: Robot, effects: Sequence[Effect], parameters: FloatArray) -> ModelPlant:
    """The plant that behaves as a model says.

    Args:
        robot: the robot; what the model does not hold of bodies and rotors comes from its description.
        effects: effects of the model.
        parameters: (p,) values of all parameters in the order of the model's columns (standard inertial parameters
            for the bodies, not base parameters).

    Returns:
        The plant, its friction laws and the effects that act beside it.

    Raises:
        SimulationError: wrong number of values, a value that is missing, a body without mass, a rotor of negative
            inertia, a spring that the model does not hold.
    """
    counts = [len(effect.columns(robot)) for effect in effects]
    if parameters.shape != (sum(counts),):
        raise SimulationError(f"the model has {sum(counts)} parameters, {parameters.shape} values were given")
    if not np.all(np.isfinite(parameters)):
        names = [c.name for effect in effects for c in effect.columns(robot)]
        bad = int(np.flatnonzero(~np.isfinite(parameters))[0])
        raise SimulationError(f"the model has no value for {names[bad]!r}; a simulation needs all of them")
    n = robot.n
    numbers = {name: np.zeros(n) for name in Plant.numbers()}
    numbers["efficiency"][:] = 1.0
    numbers["torque_constant"][:] = np.nan
    for i, joint in enumerate(robot.joints):
        if joint.actuator is not None:
            numbers["efficiency"][i] = 1.0 if joint.actuator.efficiency is None else joint.actuator.efficiency
            constant = joint.actuator.torque_constant
            numbers["torque_constant"][i] = np.nan if constant is None else constant
    friction: list[FrictionLaw] = [SmoothCoulomb() for _ in range(n)]
    others: list[PlantedEffect] = []
    inertial, rotors = robot.inertial_parameters, robot.rotor_inertias()
    start = 0
    for effect, count in zip(effects, counts, strict=True):
        values = parameters[start : start + count]
        start += count
        if effect.name == "rigid_bodies":
            inertial = values
        elif effect.name == "rotor_inertia":
            groups = robot.rotor_groups
            rotors = np.array([values[groups.index(f"{rotor.rotor_group}.rotor_inertia")] for rotor in robot.rotors])
        elif effect.name in _AS_NUMBERS and effect.shape_values.get("exponent", 3.0) == 3.0:
            i = robot.index(str(effect.joint))
            for name, value in zip(_AS_NUMBERS[effect.name], values, strict=True):
                numbers[name][i] += value
            if effect.name == "coulomb_friction":
                friction[i] = SmoothCoulomb(effect.shape_values["smoothing"])
        else:
            others.append(PlantedEffect(effect, values))
    inertial = robot.of_positive_mass(inertial)
    for k, body in enumerate(robot.bodies):
        mass, moments = inertial[10 * k], inertial[10 * k + 1 : 10 * k + 4]
        if mass == 0.0 and np.any(moments != 0.0):
            raise SimulationError(f"the model gives body {body!r} first moments and no mass; give it one")
    if np.any(rotors < 0.0):
        k = int(np.argmin(rotors))
        raise SimulationError(
            f"the model gives the rotor of {robot.rotors[k].joint!r} the inertia {rotors[k]:g} kg m2; it cannot "
            "be negative"
        )
    return ModelPlant(
        Plant(
            robot.with_inertial_parameters(inertial, rotors),
            numbers["viscous_friction"],
            numbers["coulomb_friction"],
            numbers["link_viscous_friction"],
            numbers["link_coulomb_friction"],
            numbers["stiffness"],
            numbers["cubic_stiffness"],
            numbers["spring_damping"],
            numbers["efficiency"],
            numbers["torque_constant"],
        ),
        tuple(friction),
        tuple(others),
    )
