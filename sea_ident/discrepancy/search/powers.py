"""Saturation by another power than a cube, where the cube leaves too much, and springs that stiffen by another.

The cube is the first term of any saturation that is the same both ways, and a power that is a little off does worse on
larger torques than the cube does. So the power is found only where that takes away most of what the cube leaves. It is
asked beside a settled model: how much is taken away, and in which noise, follows the power.
"""

from dataclasses import replace

import numpy as np

from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.fit import Fit
from sea_ident.discrepancy.bench.judge import EQUALLY_GOOD
from sea_ident.discrepancy.bench.lack import LACK_LEVEL, lack_of_fit
from sea_ident.discrepancy.bench.settle import Settled, settle_again
from sea_ident.discrepancy.measured.noise import NoiseFloor
from sea_ident.effects.spring_stiffening import BESIDE_CUBIC, SpringStiffening
from sea_ident.effects.torque_saturation import CUBE, TorqueSaturation

OTHER_POWER = 1.2
"""Factor between the cube and the powers, a higher and a lower one, from which another is found."""

WORTH_A_POWER = 0.5
"""Share of what the cube leaves that another power may leave [-], ..."""

PROMISES_A_POWER = 0.8
"""... and that it may leave at first, in the noise of the cube: one that is worth it leaves about a tenth there too."""

ANOTHER_POWER = 0.99
"""Factor between a power of the deflection that a search tried and the one from which its own is found."""

MOST_ROUNDS = 3
"""Rounds in which what is taken away, the power and the noise follow each other."""


def with_their_powers(bench: Bench, now: Settled, first: int) -> Settled:
    """A settled model in which a saturation has another power than three where that explains much more.

    And in which a spring stiffens by its own power where that is told from the one that a search tried.

    Args:
        bench: the recording.
        now: the model with what was found.
        first: position of the first effect that was found.

    Returns:
        The model, settled; the same one where no power is worth it.
    """
    for position in range(first, len(now.fit.effects)):
        effect = now.fit.effects[position]
        own = with_its_power(bench, now.fit, now.noise, position)
        if now.fit.statistic - own.statistic > EQUALLY_GOOD * own.unit:
            now = settle_again(bench, own)
        if not isinstance(effect, TorqueSaturation) or effect.exponent != CUBE:
            continue
        if lack_of_fit(bench, now)[2] >= LACK_LEVEL:
            break
        found = [_from_a_power(bench, now, position, factor * CUBE) for factor in (OTHER_POWER, 1.0 / OTHER_POWER)]
        best = min(found, key=lambda fit: fit.excess)
        if best.excess > PROMISES_A_POWER * now.fit.excess:
            continue
        other = Settled(best, now.noise)
        for _ in range(MOST_ROUNDS):
            other = settle_again(bench, other.fit)
        if other.fit.excess < WORTH_A_POWER * now.fit.excess:
            now = other
    return now


def with_its_power(bench: Bench, fit: Fit, noise: NoiseFloor, position: int) -> Fit:
    """A model in which a spring stiffens by the power that explains most, not by one of those that a search tried.

    A spring that is stiffer one way than the other has a free power, and is the same as one that stiffens where a
    motion bends it to one side only: held to a round power, the one that is there may look much worse.

    Args:
        bench: the recording.
        fit: the model.
        noise: noise floor.
        position: of any effect in the model.
    """
    effect = fit.effects[position]
    if not isinstance(effect, SpringStiffening) or effect.exponent not in BESIDE_CUBIC:
        return fit
    effects = list(fit.effects)
    effects[position] = replace(effect, exponent=ANOTHER_POWER * effect.exponent)
    other = bench.refine(effects, noise, start=fit.parameters, only=len(bench.effects))
    return other if other.statistic < fit.statistic else fit


def with_open_powers(bench: Bench, now: Settled) -> Settled:
    """The same model, to the last digit, with the powers free by which springs stiffen.

    A search holds them to those that it tried: what is known of a stiffness depends on what is known of its power.
    """
    open_ = tuple(
        replace(effect, exponent=float(np.nextafter(effect.exponent, np.inf)))
        if isinstance(effect, SpringStiffening) and effect.exponent in BESIDE_CUBIC
        else effect
        for effect in now.fit.effects
    )
    if open_ == now.fit.effects:
        return now
    return Settled(bench.fit(open_, now.noise, start=now.fit.parameters, known=now.fit.known), now.noise)


def _from_a_power(bench: Bench, now: Settled, position: int, power: float) -> Fit:
    """A model with a saturation whose power is found from a given one."""
    effects = list(now.fit.effects)
    effects[position] = replace(effects[position], exponent=power)  # type: ignore[call-arg]
    return bench.refine(effects, now.noise, start=now.fit.parameters)
