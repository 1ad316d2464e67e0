"""Friction of links that the description gives and the model does not have: the first that may be missing.

It is no discovery, and at many joints at once a search for one effect after the other would lose its way: what is left
at one joint by the friction of the next looks like whatever acts at both.
"""

from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.lack import LACK_LEVEL, lack_of_fit
from sea_ident.discrepancy.bench.settle import Settled, settle
from sea_ident.effects.link_friction import left_out

EXPLAINS = 0.5
"""Share of the excess that they must explain together, for a search to begin with them [-]."""


def as_described(bench: Bench, start: Settled) -> Settled:
    """The model with all friction of links that the description gives, settled; as it was where that does not matter.

    Args:
        bench: the recording.
        start: the model.

    Returns:
        The model; `start` itself where nothing is described, or explains too little.
    """
    described = left_out(bench.robot, start.fit.effects)
    if not described or lack_of_fit(bench, start)[2] >= LACK_LEVEL:
        return start
    # in the floor of the model as it was: what is not needed after all is taken out where it is settled
    quick = bench.fit((*start.fit.effects, *described), start.noise, start=start.fit.parameters, tangents=False)
    if quick.excess > (1.0 - EXPLAINS) * start.fit.excess:
        return start
    now = settle(bench, (*start.fit.effects, *described))
    slack = len(bench.slack_links(now.fit)) > len(bench.slack_links(start.fit))
    return start if slack else now
