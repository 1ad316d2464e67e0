"""A constant torque of a spring that is another constant in another motion: dry friction in it remembers.

An element of spring and dry friction that does not slip is elastic. It adds to the stiffness of the spring, and where
it slipped last to its zero. On one motion that is a constant in the spring, and is to be called one. Where another
motion finds another constant there, nothing constant is missing: such an element does that, and nothing else that the
library has.
"""

from dataclasses import replace

import numpy as np
from scipy.optimize import minimize_scalar

from sea_ident.discrepancy.bench import Bench
from sea_ident.discrepancy.columns import effect_key
from sea_ident.discrepancy.findings import Alternative
from sea_ident.discrepancy.fit import Fit
from sea_ident.discrepancy.heldout import HeldOut
from sea_ident.discrepancy.judge import EQUALLY_GOOD
from sea_ident.discrepancy.search import Selection
from sea_ident.discrepancy.settle import Settled
from sea_ident.effects.spring_hysteresis import SpringHysteresis
from sea_ident.effects.spring_offset import SpringOffset

CONFIRMED = 0.99
"""Share of what a constant could explain on another motion from which on it is the same there [-]: to a tenth of it."""

MOST_OF_IT = 0.5
"""Share of what is left there that such an element must explain where the constant is the same [-]."""

SLIPS = (0.05, 2.0)
"""Deflections at which an element may slip for all that this motion shows, as shares of the travel of the spring: the
least, where a motion goes to and fro once and presses on after, and beyond half of it, where it does not slip [-], ..."""

TRIED = 24
"""... how many of them are tried, ..."""

CLOSER = 0.002
"""... and how close the best is come to, as a share of it [-]."""


def remembering(bench: Bench, selection: Selection, held: HeldOut, position: int) -> Alternative | None:
    """A spring with dry friction that does not slip in place of a constant in it that another motion does not confirm.

    Args:
        bench: the recording that was used.
        selection: what was found on it.
        held: the other motion.
        position: of the effect in the model.

    Returns:
        The alternative, with the deflection at which it slips that does best on the other motion; None where the effect
        is no constant of a spring, where it holds, or where such a spring does not do as well.
    """
    now = selection.final.fit
    effect, found = now.effects[position], held.transfers[position - len(now.effects) + selection.added]
    if not isinstance(effect, SpringOffset) or not found.tested:
        return None
    if found.excess < EQUALLY_GOOD * found.unit:
        return None
    if effect_key(SpringHysteresis(effect.joint)) in {effect_key(each) for each in now.effects}:
        return None
    travel = float(np.ptp(bench.state(now.effects).motion.deflection[:, bench.robot.index(effect.required_joint)]))
    enough = found.excess * (MOST_OF_IT if found.share > CONFIRMED else 1.0)
    tried: dict[float, tuple[float, Fit | None]] = {}

    def left(log_slip: float) -> float:
        """What is left on the other motion by an element that slips there, more than anything where it cannot be."""
        slip = float(np.exp(log_slip))
        fit = _instead(bench, selection, position, SpringHysteresis(joint=effect.joint, slip=slip))
        excess = np.inf
        if fit is not None:
            excess = held.worth(replace(selection, final=Settled(fit, selection.final.noise)), position).excess
        tried[slip] = excess, fit
        return min(excess, 1e300)

    slips = np.log(np.geomspace(*SLIPS, TRIED) * travel)
    best = int(np.argmin([left(slip) for slip in slips]))
    around = slips[max(best - 1, 0)], slips[min(best + 1, TRIED - 1)]
    minimize_scalar(left, bounds=around, method="bounded", options={"xatol": CLOSER})
    excess, fit = min(tried.values(), key=lambda each: each[0])
    if fit is None or excess > enough:
        return None
    return Alternative(SpringHysteresis.name, effect.joint, 1.0, fit, dearer=True)


def _instead(bench: Bench, selection: Selection, position: int, effect: SpringHysteresis) -> Fit | None:
    """A selection with such an effect at a position; None where it does not do as well on the motion that was used."""
    now = selection.final.fit
    effects = list(now.effects)
    effects[position] = effect
    fit = bench.fit(effects, selection.final.noise, start=now.parameters)
    if fit.statistic - now.statistic > EQUALLY_GOOD * now.unit:
        return None
    stiff = fit.parameters[f"{effect.joint}.spring_stiffness"] > 0.0
    if not stiff or any(fit.parameters[column.name] < 0.0 for column in effect.columns(bench.robot)):
        return None
    return fit
