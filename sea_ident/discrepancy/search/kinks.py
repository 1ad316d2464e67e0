"""The kink of a spring with two sides where the motion passes it: found with the rest of the model fitted anew.

Where the motion does not pass it, it stays where the search put it: there it is a constant torque, and says nothing.
"""

from dataclasses import replace

import numpy as np
from scipy.optimize import minimize_scalar

from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.fit import Fit
from sea_ident.discrepancy.bench.judge import EQUALLY_GOOD
from sea_ident.discrepancy.measured.noise import NoiseFloor
from sea_ident.effects.asymmetric_spring import KINKS, AsymmetricSpring

REACH = float(np.max(np.diff(KINKS)))
"""How far from where it is a kink is looked for, as a share of the largest deflection of the motion [-]."""

EXACT = 1e-4
"""Share of the largest deflection to which a kink is found [-]."""


def at_its_kink(bench: Bench, fit: Fit, noise: NoiseFloor, position: int) -> Fit:
    """A model with the kink of one effect where it explains most; the same one where that is where it was.

    Args:
        bench: the recording.
        fit: the model.
        noise: noise floor.
        position: of any effect in the model.
    """
    effect = fit.effects[position]
    if not isinstance(effect, AsymmetricSpring) or effect.kink == 0.0:
        return fit
    deflection = bench.state(fit.effects).motion.deflection[:, bench.robot.index(effect.required_joint)]
    low, high = float(deflection.min()), float(deflection.max())
    if not low < effect.kink < high:
        return fit
    largest = max(-low, high)
    # on its side of rest: a kink at rest is another variant, whose exponent is free
    low, high = (max(low, 0.0), high) if effect.kink > 0.0 else (low, min(high, 0.0))

    def with_kink(kink: float) -> Fit:
        effects = list(fit.effects)
        effects[position] = replace(effect, kink=float(kink))
        return bench.fit(effects, noise, start=fit.parameters, tangents=False)

    found = minimize_scalar(
        lambda kink: with_kink(kink).statistic,
        bounds=(max(low, effect.kink - REACH * largest), min(high, effect.kink + REACH * largest)),
        method="bounded",
        options={"xatol": EXACT * largest},
    )
    if fit.statistic - float(found.fun) < EQUALLY_GOOD * fit.unit:
        return fit
    better = with_kink(float(found.x))
    return bench.refine(better.effects, noise, start=better.parameters, only=len(bench.effects))
