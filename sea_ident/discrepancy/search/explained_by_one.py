"""How much one effect of the library explains, fitted: a first step says too little of what is not small.

A base that leans by a third of a radian promises less by its first step than it explains. Before several effects, or
one at all joints, are taken for what is missing, those that promise most are fitted.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.fit import Solution
from sea_ident.discrepancy.bench.free_shapes import is_signal
from sea_ident.discrepancy.bench.physics import physical
from sea_ident.discrepancy.bench.settle import Settled
from sea_ident.discrepancy.search.candidates import Candidate
from sea_ident.discrepancy.search.refit import refitted
from sea_ident.effects import Effect
from sea_ident.side_by_side import side_by_side

PROMISED = 0.95
"""Share of the excess from which on one effect that promises it is the one that is missing [-]."""

NEARLY_ALL = 0.8
"""Share of the excess that several effects, or one at all joints, must explain [-]."""

HOPEFUL = 0.3
"""Share of the excess that a first step must promise [-]."""

MOST = 4
"""Candidates that are fitted."""

ROUNDS = 3
"""Rounds in which an effect and what it depends on follow each other."""


def one_promises_all(start: Settled, candidates: Sequence[Candidate]) -> bool:
    """Whether the best effect promises by its first step what a model leaves."""
    return bool(candidates) and candidates[0].gain >= PROMISED * start.fit.excess


def explains_nearly_all(start: Settled, gain: float, candidates: Sequence[Candidate]) -> bool:
    """Whether a drop of the statistic is nearly all that a model leaves, and more than the best effect promises."""
    promised = candidates[0].gain if candidates else 0.0
    return gain > max(NEARLY_ALL * start.fit.excess, promised)


def explained_by_one(bench: Bench, start: Settled, candidates: Sequence[Candidate]) -> float:
    """The most by which one effect brings the statistic down, of those that promise most.

    Args:
        bench: the recording.
        start: the model.
        candidates: the effects of the library around it, best first.
    """
    fit = start.fit
    tried = [c.effect for c in candidates[:MOST] if c.gain > HOPEFUL * fit.excess]
    return max((fit.statistic - left for left in side_by_side(_Alone(bench, start), tried)), default=0.0)


@dataclass(frozen=True, eq=False)
class Added:
    """Adds an effect to a model, and lets what it depends on follow.

    Attributes:
        bench: the recording.
        now: the model.
    """

    bench: Bench
    now: Settled

    def __call__(self, effect: Effect) -> tuple[float, Solution]:
        """What is left with it, and the model."""
        bench, fit = self.bench, self.now.fit
        effects = (*bench.anchored(fit.effects, fit.parameters), *bench.anchored((effect,), fit.parameters))
        new = bench.fit(effects, self.now.noise, start=fit.parameters, tangents=False)
        for _ in range(ROUNDS if fit.statistic - new.statistic > HOPEFUL * fit.excess else 0):
            anchored = bench.anchored(new.effects, new.parameters)
            new = bench.fit(anchored, self.now.noise, start=new.parameters, tangents=False)
        return new.statistic, new.solution


@dataclass(frozen=True, eq=False)
class _Alone:
    """What is left with an effect where it is possible, and everything where it is not.

    Attributes:
        bench: the recording.
        now: the model.
    """

    bench: Bench
    now: Settled

    def __call__(self, effect: Effect) -> float:
        """The statistic."""
        bench, fit, noise = self.bench, self.now.fit, self.now.noise
        if is_signal(effect) or effect.ranges:
            new = refitted(bench, fit.effects, effect, (), noise, fit.parameters)
        else:
            new = bench.again(Added(bench, self.now)(effect)[1], noise)
        return new.statistic if physical(bench, new, -1) else fit.statistic
