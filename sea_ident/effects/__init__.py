"""Physical effects, one per file.

Every module of this package that defines an `Effect` with a name is found by itself; other packages add theirs by an
entry point of the group ``sea_ident.effects`` that names the class.
"""

import math
from collections.abc import Mapping
from functools import cache
from importlib import import_module, metadata
from inspect import getmembers, isabstract, isclass
from numbers import Real
from pkgutil import iter_modules
from typing import Any

from sea_ident.effects.acting import Action, SimulationState
from sea_ident.effects.base import Anchor, Column, Effect, JointEffect, Shape, smooth_sign
from sea_ident.effects.load import Term
from sea_ident.effects.signal import corrected_motion, measured_signals
from sea_ident.effects.state import Contribution, Side, State
from sea_ident.exceptions import EffectError
from sea_ident.robot import Robot

__all__ = [
    "Action",
    "Anchor",
    "Column",
    "Contribution",
    "Effect",
    "JointEffect",
    "Shape",
    "Side",
    "SimulationState",
    "State",
    "base_effects",
    "corrected_motion",
    "effect_classes",
    "effect_from_dict",
    "make_effect",
    "measured_signals",
    "smooth_sign",
    "spring_effects",
]


@cache
def effect_classes() -> Mapping[str, type[Effect]]:
    """All known effects by name: those of this package, then those that other packages add.

    Raises:
        EffectError: if two effects share a name, or an entry point does not name an effect.
    """
    found: dict[str, type[Effect]] = {}
    for module_info in iter_modules(__path__):
        module = import_module(f"{__name__}.{module_info.name}")
        for _, member in getmembers(module, isclass):
            if issubclass(member, Effect) and not isabstract(member) and member.__module__ == module.__name__:
                _register(found, member, module.__name__)
    for entry_point in metadata.entry_points(group="sea_ident.effects"):
        member = entry_point.load()
        if not (isclass(member) and issubclass(member, Effect)):
            raise EffectError(f"entry point {entry_point.value!r} of sea_ident.effects is not an Effect class")
        _register(found, member, entry_point.value)
    return found


def _register(found: dict[str, type[Effect]], effect: type[Effect], where: str) -> None:
    if effect.name in found and found[effect.name] is not effect:
        raise EffectError(f"{where}: an effect named {effect.name!r} exists already; rename it")
    found[effect.name] = effect


def make_effect(name: str, joint: str | None = None, **shape: Any) -> Effect:
    """An effect by its name.

    Args:
        name: name of the effect, as in `effect_classes`.
        joint: joint at which it acts.
        **shape: values of its shape parameters; defaults where left out.

    Returns:
        The effect.

    Raises:
        EffectError: if there is no such effect or shape parameter, or its value is none that it can have.
    """
    classes = effect_classes()
    if name not in classes:
        raise EffectError(f"no effect is named {name!r}; known effects: {', '.join(sorted(classes))}")
    try:
        effect = classes[name](joint=joint, **shape)
    except TypeError as error:
        raise EffectError(f"effect {name!r}: {error}") from None
    for known in effect.shapes:
        value = getattr(effect, known.name)
        if not isinstance(value, Real) or not math.isfinite(value) or (known.logarithmic and value <= 0.0):
            unit = "" if known.unit in ("-", "1") else f" {known.unit}"
            expected = "a positive number" if known.logarithmic else "a finite number"
            raise EffectError(
                f"effect {name!r} at {joint!r}: {known.name} = {value}{unit} is not {expected}; usual are "
                f"{known.lower:g} to {known.upper:g}{unit}"
            )
    return effect


def effect_from_dict(record: Mapping[str, Any]) -> Effect:
    """The effect that `Effect.to_dict` wrote.

    Raises:
        EffectError: if it is not one.
    """
    if not isinstance(record, Mapping) or "effect" not in record:
        raise EffectError(f"not the record of an effect: {record!r}")
    shape = record.get("shape") or {}
    if not isinstance(shape, Mapping):
        raise EffectError(f"effect {record['effect']!r}: shape is not a mapping")
    if "terms" in shape:
        if not isinstance(shape["terms"], list):
            raise EffectError(f"effect {record['effect']!r}: terms {shape['terms']!r} is not a list of effects")
        shape = {**shape, "terms": tuple(_term_from_dict(term) for term in shape["terms"])}
    return make_effect(str(record["effect"]), record.get("joint"), **shape)


def _term_from_dict(record: Mapping[str, Any]) -> Term:
    effect, values = effect_from_dict(record), record.get("values")
    if not isinstance(values, list) or not all(isinstance(value, Real) for value in values):
        raise EffectError(f"effect {effect.title!r} in the load of another: values {values!r} is not a list of numbers")
    return Term(effect, tuple(float(value) for value in values))


def base_effects(robot: Robot) -> tuple[Effect, ...]:
    """The model that identification starts from: bodies, rotors, viscous and Coulomb friction of every motor."""
    from sea_ident.effects.coulomb_friction import CoulombFriction
    from sea_ident.effects.rigid_bodies import RigidBodies
    from sea_ident.effects.rotor_inertia import RotorInertia
    from sea_ident.effects.viscous_friction import ViscousFriction

    return (
        *RigidBodies.instances(robot),
        *RotorInertia.instances(robot),
        *ViscousFriction.instances(robot),
        *CoulombFriction.instances(robot),
    )


def spring_effects(robot: Robot) -> tuple[Effect, ...]:
    """The springs of the paper: stiffness, cubic stiffness and damping of every elastic joint (eq. 21)."""
    from sea_ident.effects.spring_damping import SpringDamping
    from sea_ident.effects.spring_stiffening import SpringStiffening
    from sea_ident.effects.spring_stiffness import SpringStiffness

    return (
        *SpringStiffness.instances(robot),
        *SpringStiffening.instances(robot),
        *SpringDamping.instances(robot),
    )
