"""Models that were identified without knowing the zeros of their motor encoders: every recording has its own."""

from collections.abc import Collection
from dataclasses import dataclass

from sea_ident.effects import Effect
from sea_ident.effects.spring_offset import SpringOffset
from sea_ident.estimation import Model
from sea_ident.estimation.unknown_zeros import unknown_zeros


@dataclass(frozen=True)
class OwnZero(SpringOffset):
    """What is left of a zero that is not known: a constant in the spring, another one in every recording."""


def own_zeros(model: Model) -> tuple[OwnZero, ...]:
    """The constants that stand for the zeros that a model does not know."""
    given = {effect.joint for effect in model.spring_effects if isinstance(effect, SpringOffset)}
    return tuple(OwnZero(joint) for joint in unknown_zeros(model) if joint not in given)


def joints_with_own_zeros(effects: Collection[Effect]) -> set[str]:
    """Joints whose zero is another one in every recording."""
    return {effect.required_joint for effect in effects if isinstance(effect, OwnZero)}
