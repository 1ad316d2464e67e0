"""Two effects that are one: a search adds one after the other, and may end with two where one is simpler.

- Two wrong zeros of a joint.
- Two pushes at the same time. One that was first taken for one on the wrong link leaves what another one explains:
  together they do what the right one does alone, and as long as both are there none is worth an exchange.
- Delays of two joints. Where one joint shows its delay so much more than the others that it promises nearly all, those
  of all joints are found one by one.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import combinations

from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.fit import Fit, Solution
from sea_ident.discrepancy.bench.judge import at_a_bound, penalty
from sea_ident.discrepancy.bench.physics import physical
from sea_ident.discrepancy.bench.settle import Settled, settle_again
from sea_ident.discrepancy.search.common_delays import common_delays
from sea_ident.discrepancy.search.edges import at_once, with_sharp_edges
from sea_ident.discrepancy.search.one_zero import one_zero
from sea_ident.effects import Effect
from sea_ident.effects.external_force import POINT, ExternalForce
from sea_ident.effects.position_delay import PositionDelay
from sea_ident.effects.torque_delay import TorqueDelay
from sea_ident.side_by_side import side_by_side


def one_for_two(bench: Bench, now: Settled, added: int) -> tuple[Settled, list[int]]:
    """A model with one effect in the place of two that were added, where that does as well for its price.

    Args:
        bench: the recording.
        now: the model.
        added: number of effects added, its last ones.

    Returns:
        The model, and which of the effects that were added are left; the first of two stands for both.
    """
    left, found = list(range(added)), True
    while found:
        fit, found = now.fit, False
        first = len(fit.effects) - len(left)
        for one, two in combinations(range(first, len(fit.effects)), 2):
            single = _single(bench, now, one, two)
            if single is not None:
                now, found = settle_again(bench, single), True
                left.pop(two - first)
                break
    return now, left


def _single(bench: Bench, now: Settled, one: int, two: int) -> Fit | None:
    """The model with the best single effect in the place of two; None where there is none, or it does less."""
    fit = now.fit
    others = instead(bench, fit.effects[one], fit.effects[two], fit.parameters)
    if not others:
        return None
    tried = list(side_by_side(_Instead(bench, now, one, two), others))
    new = bench.again(min(tried, key=lambda each: each[0])[1], now.noise)
    if at_a_bound(new.effects[one]) or not physical(bench, new, one):
        return None
    spared = sum(penalty(fit.effects[k], bench) for k in (one, two)) - penalty(new.effects[one], bench)
    return new if new.statistic < fit.statistic + fit.unit * spared else None


def instead(bench: Bench, one: Effect, two: Effect, parameters: Mapping[str, float]) -> tuple[Effect, ...]:
    """Effects that two others may be.

    Args:
        bench: the recording.
        one: the first.
        two: the second.
        parameters: of the model that both are in, by name.
    """
    if isinstance(one, ExternalForce) and isinstance(two, ExternalForce):
        time = bench.data.motion.time
        centred = replace(one, **dict.fromkeys(POINT, 0.0))  # type: ignore[arg-type]
        same = at_once(one.pushes(time), two.pushes(time))
        return tuple(replace(centred, joint=joint) for joint in bench.robot.joint_names) if same else ()
    if isinstance(one, TorqueDelay | PositionDelay) and isinstance(two, TorqueDelay | PositionDelay):
        # that of all joints where one is, else about as long as either
        delay = next((each.delay for each in (one, two) if each.joint is None), 0.5 * (one.delay + two.delay))
        wholes = [whole for whole in common_delays(bench.robot) if type(one) is type(two) is type(whole)]
        return tuple(replace(whole, delay=delay) for whole in wholes)
    zero = one_zero(bench, one, two, parameters)
    return () if zero is None else (zero,)


@dataclass(frozen=True, eq=False)
class _Instead:
    """Tries an effect in the place of two.

    Attributes:
        bench: the recording.
        now: the model.
        one: position of the first.
        two: position of the second.
    """

    bench: Bench
    now: Settled
    one: int
    two: int

    def __call__(self, effect: Effect) -> tuple[float, Solution]:
        """What is left with it, and the model."""
        bench, noise, fit = self.bench, self.now.noise, self.now.fit
        effects = [effect if k == self.one else e for k, e in enumerate(fit.effects) if k != self.two]
        begun = bench.refine(effects, noise, start=fit.parameters, only=len(bench.effects))
        new = with_sharp_edges(bench, begun, noise, self.one)
        return new.statistic, new.solution
