"""Whether an effect that was found holds on data that were not used."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.columns import effect_key
from sea_ident.discrepancy.bench.contribution import as_known, torque_factor
from sea_ident.discrepancy.bench.fit import Fit, Known
from sea_ident.discrepancy.bench.free_shapes import free_shapes
from sea_ident.discrepancy.bench.judge import EQUALLY_GOOD, significance
from sea_ident.discrepancy.bench.linear import whiten
from sea_ident.discrepancy.bench.settle import Settled
from sea_ident.discrepancy.search.next_effect import FAMILY_LEVEL
from sea_ident.discrepancy.search.search import Selection
from sea_ident.effects import Effect
from sea_ident.effects.signal import SignalEffect
from sea_ident.effects.spring_hysteresis import SpringHysteresis
from sea_ident.effects.spring_offset import SpringOffset
from sea_ident.side_by_side import side_by_side

TRANSFERS = 0.5
"""Share of what an effect could explain of other data that it must explain as it was found to be more than suspect
..."""

TRANSFERS_ALONE = 0.7
"""... and the same where nothing else is missing that could spoil it: then it holds in part only."""

SPOILT = 0.25
"""Share from which on it may be what else is missing there that speaks against an effect, where that is more than the
effect could explain: what would be best beside it is bent by that."""

BY_CHANCE = 3.0
"""Standard deviations by which parameters may be off, as they were found, without anything being wrong [-]."""

UNDECIDED = 0.1
"""Share of what neither explains on the other motion that a difference between two must exceed [-]: something else is
wrong there, and could lean to either."""

FAR_BEHIND = 5.0
"""Times the difference that tells two apart by which one is far behind: not the better one in any noise floor [-]."""


@dataclass(frozen=True)
class Transfer:
    """How an effect does on data that were not used.

    Attributes:
        share: of what it could explain there, what it does explain with its parameters as they are, or where that is
            little, as far as they were found to be unsure [-].
        tested: whether there was enough to explain to tell.
        statistic: weighted sum of squares that is left there with its parameters as they are.
        excess: what of it is beyond the noise.
        unit: the statistic over its degrees of freedom with everything free, at least what noise leaves [-].
        remembers: whether it needs a constant torque of its own there, which depends on what was before.
        possible: what it could explain there, in the unit of the statistic.
        by_chance: what of the statistic is likely chance, where its parameters are only as sure as they were found,
            less the price of all that they may be.
    """

    share: float
    tested: bool
    statistic: float = 0.0
    unit: float = 1.0
    excess: float = 0.0
    remembers: bool = False
    possible: float = np.inf
    by_chance: float = 0.0

    @property
    def surprise(self) -> float:
        """The statistic without what is chance of the motion that it was found on.

        Twice the negative logarithm of the probability density of what is left, but for a constant.
        """
        return self.statistic - self.by_chance

    @property
    def margin(self) -> float:
        """By how much more surprising another must be to be the worse one beyond doubt."""
        return max(EQUALLY_GOOD * self.unit, UNDECIDED * self.excess)

    @property
    def holds(self) -> bool:
        """Whether nothing speaks against it."""
        return not self.tested or self.share > TRANSFERS

    @property
    def ruled_out(self) -> bool:
        """Whether it does not hold, and not for what else is missing there."""
        return not self.holds and not (self.share > SPOILT and self.possible < self.excess)


def transfer(
    bench: Bench, selection: Selection, now: Settled, positions: Sequence[int] | None = None
) -> list[Transfer]:
    """Try effects that were added on other data: their parameters as they are, the model without them fitted anew.

    Each is tried beside the others as they are. Where it fails so, one of these may be what is wrong: it holds all the
    same where it holds beside the others as the other data would have them.

    Args:
        bench: the other data.
        selection: what was found.
        now: the found model, fitted anew to the other data, with the noise floor there.
        positions: of the effects in the model; all that were added by default.

    Returns:
        One result for each of them.
    """
    fit = selection.final.fit
    added = range(len(fit.effects) - selection.added, len(fit.effects))
    wanted = added if positions is None else positions
    return list(side_by_side(lambda position: _Trial(bench, fit, added, now, position).outcome(), wanted))


def far_behind(bench: Bench, selection: Selection, now: Settled, position: int, beside: Transfer) -> Transfer | None:
    """What an effect is worth on other data where that is far less than another is, without a fit to them.

    Args:
        bench: the other data.
        selection: what was found, with the effect.
        now: what was found with the other, fitted anew to the other data, with the noise floor there.
        position: of the effect in the model.
        beside: what the other is worth.

    Returns:
        A transfer that does not hold; None where the effect is not far behind.
    """
    fit, unit = selection.final.fit, now.fit.unit
    added = range(len(fit.effects) - selection.added, len(fit.effects))
    trial = _Trial(bench, fit, added, now, position)
    fixed, remembers = trial.as_found()
    enough = beside.surprise + FAR_BEHIND * beside.margin
    if fixed.statistic < enough or fixed.statistic - (by_chance := trial.by_chance(fixed)) < enough:
        return None
    return Transfer(0.0, True, fixed.statistic, unit, fixed.excess, remembers, by_chance=by_chance)


class _AsFound(NamedTuple):
    """A model with an effect as it was found, and whether that needs a constant torque of its own."""

    fit: Fit
    remembers: bool


class _Trial:
    """One effect of a model on data that it was not fitted to.

    Args:
        bench: the other data.
        fit: the model as it was found.
        added: positions of what was added in it.
        now: the same model, fitted anew to the other data, with the noise floor there.
        position: of the effect.
    """

    def __init__(self, bench: Bench, fit: Fit, added: range, now: Settled, position: int) -> None:
        self._bench, self._fit, self._added, self._now, self._position = bench, fit, added, now, position
        self._effect = fit.effects[position]
        self._others = [p for p in added if p != position]
        # friction may turn over as it does at the speeds of the other motion: that is no matter of what was added
        self._models = list(dict.fromkeys(effects[: added.start] for effects in (fit.effects, now.fit.effects)))

    def as_found(self) -> _AsFound:
        """The effect beside all others that were added, all with their parameters as they are."""
        whole, beside = as_known(self._bench, self._fit, self._added), self._beside()
        fixed = self._least(whole, beside, self._signal())
        if own_history := self._history([self._position]):
            rested = self._least(whole, beside, own_history)
            if fixed.statistic - rested.statistic > EQUALLY_GOOD * self._now.fit.unit:
                return _AsFound(rested, True)
        return _AsFound(fixed, False)

    def outcome(self) -> Transfer:
        """What the effect is worth beside all others that were added, these as they are."""
        known = as_known(self._bench, self._fit, self._others)
        without, (fixed, remembers), unit = self._least(known, self._beside()), self.as_found(), self._now.fit.unit

        def alone() -> Fit:
            """With its parameters and shapes free, those of the others as they are."""
            model, only = [*without.effects, self._effect], len(without.effects)
            return self._bench.refine(model, self._now.noise, start=self._fit.parameters, only=only, known=known)

        free = self._now.fit if self._others else alone()
        share, tested = self._share(without, fixed, free), self._tells(without, min(free.statistic, fixed.statistic))
        if tested and self._others and share <= TRANSFERS:
            if fixed.statistic - without.statistic < EQUALLY_GOOD * unit:
                # what the others gain by a refit is not there for this one to explain: this motion may hardly show it
                tested = self._tells(without, alone().statistic)
            share = max(share, self._share_beside_free(), self._share_by_values())
        possible = without.statistic - min(free.statistic, fixed.statistic)
        if tested and share <= TRANSFERS_ALONE and possible > 0.0:
            # an order that the first motion hardly tells is off by chance on a larger one, and the effect is right
            most = without.statistic - fixed.statistic + self._within_its_deviations(fixed)
            share = max(share, min(most / possible, 1.0))
        by_chance = self.by_chance(fixed)
        return Transfer(share, tested, fixed.statistic, unit, fixed.excess, remembers, possible, by_chance)

    def by_chance(self, fixed: Fit) -> float:
        """What of the statistic is likely chance, where the parameters are only as sure as the first motion made them.

        What could be off by more explains more of what is left there, and pays for it by the logarithm of that.

        Args:
            fixed: the model with the effect as it was found.
        """
        left, stds = self._along_its_deviations(fixed)
        sizes = stds**2 / self._now.fit.unit
        return float(np.sum(left**2 * (sizes / (1.0 + sizes))) - self._now.fit.unit * np.sum(np.log1p(sizes)))

    def _within_its_deviations(self, fixed: Fit) -> float:
        """By how much the statistic falls where parameters go as far as they may be off by chance."""
        left, stds = self._along_its_deviations(fixed)
        return float(np.sum(left**2 - np.maximum(np.abs(left) - BY_CHANCE * stds, 0.0) ** 2))

    def _along_its_deviations(self, fixed: Fit) -> tuple[FloatArray, FloatArray]:
        """What is left along what parameters could do that are off, and the standard deviation of that, both (k,).

        A combination of parameters that the first motion hardly tells may do much on another one, and is off by chance.

        Args:
            fixed: the model with the effect as it was found.
        """
        bench = self._bench
        factor = torque_factor(bench, self._fit, [self._position]) * fixed.scale[:, None]
        rows = fixed.off(whiten(bench.whitener(self._now.noise), factor))
        axes, stds, _ = np.linalg.svd(rows, full_matrices=False)
        return axes.T @ fixed.whitened, stds

    def _beside(self) -> list[Effect]:
        """What stands beside the torque of the others that is known: their signals, and what their springs remember."""
        signals = [self._fit.effects[p] for p in self._others if isinstance(self._fit.effects[p], SignalEffect)]
        return [*signals, *self._history(self._others)]

    def _share_beside_free(self) -> float:
        """Share of what the effect could explain that it does, all others fitted anew; 0 where these leave it none."""
        others = [self._now.fit.effects[p] for p in self._others]

        def least(own: Sequence[Effect] = (), known: Known | None = None) -> Fit:
            models = [[*model, *own, *others] for model in self._models]
            only, start = len(models[0]) - len(others), self._now.fit.parameters
            fits = (self._bench.refine(m, self._now.noise, start=start, only=only, known=known) for m in models)
            return min(fits, key=lambda each: each.statistic)

        own = self._signal() or self._history([self._position], others)
        without, fixed = least(), least(own, as_known(self._bench, self._fit, [self._position]))
        if not self._tells(without, min(self._now.fit.statistic, fixed.statistic)):
            return 0.0
        return self._share(without, fixed, self._now.fit)

    def _share_by_values(self) -> float:
        """The same by the values that the other data would have of an effect without shapes; 0 where they tell none.

        To second order a model loses v' C^-1 v without values v of covariance C, and d' C^-1 d with values that are off
        by d. It is what the comparison of statistics comes to where others do not change their shapes with it.
        """
        if isinstance(self._effect, SignalEffect) or free_shapes((self._effect,)):
            return 0.0
        there = self._now.fit
        own = there.slice_of(self._position, self._bench.counts(there.effects))
        found = np.array([self._fit.parameters[column.name] for column in self._effect.columns(self._bench.robot)])
        without = there.lost_by(own, there.values[own])
        return 1.0 - there.lost_by(own, found - there.values[own]) / without if without > EQUALLY_GOOD else 0.0

    def _least(self, known: Known, *more: Sequence[Effect]) -> Fit:
        """The model with some effects more and the torque of others as it is known."""
        beside, start = [effect for part in more for effect in part], self._fit.parameters
        fits = (
            self._bench.fit([*model, *beside], self._now.noise, start=start, tangents=False, known=known)
            for model in self._models
        )
        return min(fits, key=lambda each: each.statistic)

    @staticmethod
    def _share(without: Fit, fixed: Fit, free: Fit) -> float:
        """Of what an effect could explain, what it does explain [-]."""
        possible = without.statistic - min(free.statistic, fixed.statistic)
        return float((without.statistic - fixed.statistic) / possible) if possible > 0.0 else 0.0

    def _tells(self, without: Fit, statistic: float) -> bool:
        """Whether there is enough to explain to tell."""
        columns = max(len(self._effect.columns(self._bench.robot)), 1)
        return significance(without.statistic - statistic, columns, 10, without, self._now.noise) < FAMILY_LEVEL

    def _signal(self) -> list[Effect]:
        return [self._effect] if isinstance(self._effect, SignalEffect) else []

    def _history(self, positions: Sequence[int], beside: Sequence[Effect] = ()) -> list[Effect]:
        """The constants that dry friction in springs keeps of the time before, for some effects.

        Not where such a constant is what is tried, or is there already.
        """
        effects = self._fit.effects
        joints = [effects[p].joint for p in positions if isinstance(effects[p], SpringHysteresis)]
        there = {effect_key(effect) for effect in (self._effect, *beside)}
        return [offset for joint in joints if effect_key(offset := SpringOffset(joint)) not in there]
