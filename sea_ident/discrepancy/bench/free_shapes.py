"""Nonlinear parameters of a model: which are free, and how they move."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from sea_ident.effects import Effect, JointEffect, Shape
from sea_ident.effects.asymmetric_spring import AsymmetricSpring
from sea_ident.effects.coulomb_friction import CoulombFriction
from sea_ident.effects.external_force import POINT, WHEN, ExternalForce
from sea_ident.effects.link_friction import LinkFriction
from sea_ident.effects.signal import SignalEffect
from sea_ident.effects.spring_stiffening import BESIDE_CUBIC, CUBIC, SpringStiffening
from sea_ident.effects.state import Side
from sea_ident.effects.torque_saturation import CUBE, TorqueSaturation

IN_SIGHT = 2.5
"""Least speed that is compared, over that at which friction turns over, from which on a step may not lead back [-]: it
did not from 5, and did from 3."""

SHAPES_THAT_STAY = {
    "asymmetric_spring": ("kink",),
    "external_force": WHEN,
}
"""Shape parameters that are not refined: they come from elsewhere."""

LARGEST_STEP = 100.0
"""Step of a logarithm that leads beyond any range: what is not known at all asks for more than numbers can hold [-]."""


def is_signal(effect: Effect) -> bool:
    """Whether an effect sits in the chain of signals."""
    return _is_signal_kind(type(effect))


@cache
def _is_signal_kind(kind: type[Effect]) -> bool:
    return issubclass(kind, SignalEffect)


def signal_effects(effects: Sequence[Effect]) -> tuple[Effect, ...]:
    """Those effects that sit in the chain of signals."""
    return tuple(effect for effect in effects if is_signal(effect))


def moving(signals: Sequence[Effect]) -> tuple[Effect, ...]:
    """Those effects in the chain of signals that change the motion: what only changes the torque does not."""
    return tuple(signal for signal in signals if _moves(type(signal)))


@cache
def _moves(kind: type[Effect]) -> bool:
    return kind.corrected is not Effect.corrected


def nearly(effects: Sequence[Effect], digits: int) -> tuple[Effect, ...]:
    """The same effects, with amounts in the chain of signals rounded: what hardly depends on them is then found again.

    Args:
        effects: the effects.
        digits: that are kept of every amount.
    """
    return tuple(_rounded(effect, digits) if isinstance(effect, SignalEffect) else effect for effect in effects)


def _rounded(effect: SignalEffect, digits: int) -> SignalEffect:
    amounts = {a.name: float(f"{getattr(effect, a.name):.{digits - 1}e}") for a in effect.amounts}
    return replace(effect, **amounts)  # type: ignore[arg-type]


def seen_by(effect: Effect, signals: tuple[Effect, ...]) -> tuple[Effect, ...]:
    """Those effects in the chain of signals that change the columns of an effect: what is of one joint sees its own."""
    if not isinstance(effect, JointEffect):
        return signals
    return tuple(signal for signal in signals if signal.joint is None or signal.joint == effect.joint)


def free_shapes(effects: Sequence[Effect]) -> tuple[tuple[int, Shape], ...]:
    """Shape parameters that a fit is free to change, and amounts of signal effects.

    A push on the very centre of mass of a link stays there, a saturation by a cube one, a spring that stiffens by the
    power that a search tried, and both sides of a spring with a kink elsewhere than at rest straight.
    """
    found: list[tuple[int, Shape]] = []
    for position, effect in enumerate(effects):
        stay = SHAPES_THAT_STAY.get(effect.name, ())
        if isinstance(effect, ExternalForce) and not any(getattr(effect, name) for name in POINT):
            stay = (*stay, *POINT)
        if isinstance(effect, TorqueSaturation) and effect.exponent == CUBE:
            stay = (*stay, "exponent")
        if isinstance(effect, SpringStiffening) and effect.exponent in (CUBIC, *BESIDE_CUBIC):
            stay = (*stay, "exponent")
        if isinstance(effect, AsymmetricSpring) and effect.kink != 0.0:
            stay = (*stay, "exponent")
        found.extend((position, shape) for shape in effect.ranges if shape.name not in stay)
    return tuple(found)


def moved(effect: Effect, shape: Shape, step: float) -> Effect:
    """The effect with one shape moved: by a factor exp(step), or by `step` of its range, within its range.

    A shape that was given outside its range stays where it is on one side.
    """
    value = float(getattr(effect, shape.name))
    new = value * np.exp(min(step, LARGEST_STEP)) if shape.logarithmic else value + step * (shape.upper - shape.lower)
    within = float(np.clip(new, min(shape.lower, value), max(shape.upper, value)))
    return replace(effect, **{shape.name: within})  # type: ignore[arg-type]


def moved_within(effects: Sequence[Effect], position: int, shape: Shape, step: float) -> tuple[Effect, ...]:
    """A model with one shape of one effect moved, and with it what is anchored in that shape.

    What turns over at the speed that the Coulomb friction of its motor does moves along: by itself it would follow one
    fit too late, and where it is much larger than that friction, the speed would swing from fit to fit.
    """
    there = moved(effects[position], shape, step)
    return tuple(
        there if k == position else _along(effect, effects[position], there) for k, effect in enumerate(effects)
    )


def _along(effect: Effect, one: Effect, there: Effect) -> Effect:
    """An effect of the same joint where another one moved."""
    if not (isinstance(one, CoulombFriction) and isinstance(there, CoulombFriction) and effect.joint == one.joint):
        return effect
    own = all(shape.name != "smoothing" for shape in effect.shapes)
    if own and getattr(effect, "smoothing", None) == one.smoothing:
        return replace(effect, smoothing=there.smoothing)  # type: ignore[call-arg]
    return effect


def turning_in_sight(
    effects: Sequence[Effect], slowest: Mapping[tuple[str, Side], float], only: int = 0
) -> tuple[Effect, ...]:
    """A model whose friction turns over no further below all speeds that are compared than a step leads back from.

    Friction that a model lacks may sharpen the turn of what it has without an end. Once it is there, the turn is where
    it was: no sample is slower, and none tells that it lies elsewhere.

    Args:
        effects: the model.
        slowest: least speed that is compared, by joint and side.
        only: position from which on shapes may move.
    """
    for position, effect in enumerate(effects):
        if position < only or not isinstance(effect, (CoulombFriction, LinkFriction)):
            continue
        least = slowest.get((effect.required_joint, effect.side), np.inf) / IN_SIGHT
        (shape,) = effect.shapes
        if np.isfinite(least) and effect.smoothing < least:
            effects = moved_within(effects, position, shape, float(np.log(least / effect.smoothing)))
    return tuple(effects)


def room(effect: Effect, shape: Shape) -> tuple[float, float]:
    """How far `moved` can move a shape down and up, in its steps; one that was given outside its range only inwards."""
    value = float(getattr(effect, shape.name))
    ends = min(shape.lower, value), max(shape.upper, value)
    if shape.logarithmic:
        low, high = (float(np.log(end / value)) if end > 0.0 else -np.inf for end in ends)
    else:
        low, high = ((end - value) / (shape.upper - shape.lower) for end in ends)
    return low, high


def distance(low: Effect, high: Effect, shape: Shape) -> float:
    """How far a shape moved from one effect to another, in the coordinates of `moved`: less at the end of its range."""
    first, last = float(getattr(low, shape.name)), float(getattr(high, shape.name))
    return float(np.log(last / first)) if shape.logarithmic else (last - first) / (shape.upper - shape.lower)
