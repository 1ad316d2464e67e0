"""A constant torque of a spring that is another constant in another motion: dry friction in it remembers.

An element of spring and dry friction that does not slip is elastic. It adds to the stiffness of the spring, and where
it slipped last to its zero. On one motion that is a constant in the spring, and is to be called one. Where another
motion finds another constant there, nothing constant is missing: such an element does that, and nothing else that the
library has.
"""

from dataclasses import replace

import numpy as np

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

BARELY_STICKS = 1.001
"""Factor of half the travel of a spring beyond which an element in it does not slip to and fro [-], ..."""

STICKS = (1.0, 1.5, 2.0, 3.0, 4.0)
"""... and those of that at which it may slip for all that this motion shows [-]."""


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
    if not isinstance(effect, SpringOffset) or not found.tested or found.share > CONFIRMED:
        return None
    if found.excess < EQUALLY_GOOD * found.unit:
        return None
    if effect_key(SpringHysteresis(effect.joint)) in {effect_key(each) for each in now.effects}:
        return None
    motion = bench.state(now.effects).motion
    travel = float(np.ptp(motion.deflection[:, bench.robot.index(effect.required_joint)]))
    best: tuple[float, Fit] | None = None
    for factor in STICKS:
        effects = list(now.effects)
        effects[position] = SpringHysteresis(joint=effect.joint, slip=0.5 * BARELY_STICKS * factor * travel)
        fit = bench.fit(effects, selection.final.noise, start=now.parameters)
        if fit.statistic - now.statistic > EQUALLY_GOOD * now.unit:
            continue
        stiff = fit.parameters[f"{effect.joint}.spring_stiffness"] > 0.0
        if not stiff or any(fit.parameters[column.name] < 0.0 for column in effects[position].columns(bench.robot)):
            continue
        left = held.worth(replace(selection, final=Settled(fit, selection.final.noise)), position).statistic
        if best is None or left < best[0]:
            best = left, fit
    return None if best is None else Alternative(SpringHysteresis.name, effect.joint, 1.0, best[1], dearer=True)
