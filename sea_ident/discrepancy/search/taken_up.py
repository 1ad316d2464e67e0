"""An effect that hardly shows because another one that was found takes up its torque."""

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.columns import effect_key
from sea_ident.discrepancy.bench.fit import Fit
from sea_ident.discrepancy.bench.judge import COMPLETE, is_push
from sea_ident.discrepancy.bench.lack import LACK_LEVEL, lack_of_fit
from sea_ident.discrepancy.bench.settle import Settled
from sea_ident.discrepancy.measured.noise import NoiseFloor
from sea_ident.effects import Effect
from sea_ident.effects.signal import SignalEffect

ANOTHER = 0.1
"""Share of its amount by which an effect must be another one without a second for that to matter [-]."""


def taken_up(bench: Bench, less: Fit, fit: Fit, noise: NoiseFloor, position: int) -> bool:
    """Whether an effect matters for what another one at its joint is beside it, however little it changes the torque.

    Beside an eccentric encoder another zero of it is nearly nothing but more eccentricity, which is then told as of
    another size, and sure. What it is not explains all that is left.

    Args:
        bench: the recording.
        less: the model without the effect.
        fit: with it.
        noise: noise floor of both.
        position: of it.
    """
    effect, first = fit.effects[position], len(bench.effects)
    before = {effect_key(other): _amounts(bench, less, other) for other in less.effects[first:]}
    others = [o for o in fit.effects[first:] if o is not effect and o.joint == effect.joint and effect_key(o) in before]
    pairs = [(_amounts(bench, fit, other), before[effect_key(other)]) for other in others]
    if is_push(effect) or not any(np.linalg.norm(own - was) > ANOTHER * np.linalg.norm(own) for own, was in pairs):
        return False
    explained = less.statistic - fit.statistic > COMPLETE * less.excess
    return explained or lack_of_fit(bench, Settled(fit, noise))[2] >= LACK_LEVEL


def _amounts(bench: Bench, fit: Fit, effect: Effect) -> FloatArray:
    """Values of the columns of an effect, or what it is in the chain of signals."""
    if isinstance(effect, SignalEffect):
        return np.array([float(getattr(effect, amount.name)) for amount in effect.amounts])
    return np.array([fit.parameters[column.name] for column in bench.labels_of(effect)])
