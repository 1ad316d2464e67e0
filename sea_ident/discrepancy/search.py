"""Which effects are missing: forward selection with a family-wise level, exchange, backward elimination."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy import stats

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.bench import Bench, Fit, free_shapes
from sea_ident.discrepancy.candidates import Candidate, effect_key, scan
from sea_ident.discrepancy.noise import NoiseFloor
from sea_ident.effects import Effect

FAMILY_LEVEL = 1e-3
"""Probability of accepting anything where nothing is missing."""

MOST_EFFECTS = 4
"""Largest number of effects that are added."""

USEFUL_SHARE = 0.2
"""Share of the excess that an effect must explain to be accepted."""

FINALISTS = 5
"""Candidates that are refitted with everything free before one is accepted."""


@dataclass(frozen=True, eq=False)
class Accepted:
    """An effect that was added.

    Attributes:
        effect: the effect with its refined shape.
        values: (k,) its parameters.
        stds: (k,) their standard deviations.
        p_value: of the drop of the statistic, corrected for all that was tried.
    """

    effect: Effect
    values: FloatArray
    stds: FloatArray
    p_value: float


@dataclass(frozen=True, eq=False)
class Selection:
    """Outcome of a search.

    Attributes:
        start: the model without anything added, refitted.
        start_noise: its noise floor.
        final: the model with the effects added.
        final_noise: its noise floor.
        added: number of effects added, the last ones of `final.effects`.
        p_values: of each added effect, corrected for all that was tried.
        candidates: scan around the final model.
        tests: number of shapes of all candidates.
    """

    start: Fit
    start_noise: NoiseFloor
    final: Fit
    final_noise: NoiseFloor
    added: int
    p_values: tuple[float, ...]
    candidates: tuple[Candidate, ...] = field(default=())
    tests: int = 1

    @property
    def effects(self) -> tuple[Effect, ...]:
        """The effects added."""
        return self.final.effects[len(self.final.effects) - self.added :] if self.added else ()


def settle(bench: Bench, effects: Sequence[Effect], rounds: int = 2) -> tuple[Fit, NoiseFloor]:
    """Fit a model and estimate its noise floor in turn, from nothing."""
    fit = bench.fit(effects, None, tangents=False)
    noise = bench.noise(fit)
    for _ in range(rounds):
        fit = bench.refine(fit.effects, noise)
        noise = bench.noise(fit)
    return bench.fit(fit.effects, noise), noise


def significance(gain: float, columns: int, tests: int, fit: Fit, noise: NoiseFloor) -> float:
    """Probability of such a drop of the statistic by chance, for the best of `tests` candidates.

    The noise floor is itself an estimate, so the drop follows an F rather than a chi-square distribution. Where the
    model leaves an excess, the drop is measured in units of it.
    """
    scale = max(fit.statistic - gain, 1.0) / max(fit.dof - columns, 1)
    ratio = gain / columns / max(scale, 1.0)
    single = float(stats.f.sf(ratio, columns, max(noise.total_freedom, 4.0)))
    return min(1.0, tests * single)


def search(bench: Bench, effects: Sequence[Effect], remainder: float = 0.0) -> Selection:
    """Find the effects that a model lacks.

    Args:
        bench: the recording.
        effects: the model.
        remainder: share of the torque that no model has, as a floor of the noise [-].

    Returns:
        The model before and after, with what was added.
    """
    start, plain = settle(bench, effects)
    start_noise = bench.with_remainder(plain, start, remainder)
    start = bench.fit(start.effects, start_noise)
    fit, noise = start, start_noise
    added: list[tuple[Effect, float]] = []
    candidates: list[Candidate] = []
    tests = 1
    while True:
        candidates = scan(bench, fit, noise)
        tests = max(sum(c.tests for c in candidates), 1)
        if len(added) >= MOST_EFFECTS:
            break
        step = _next(bench, fit, noise, candidates, tests)
        if step is None:
            break
        new, p_value = step
        added.append((new.effects[-1], p_value))
        fit, noise = _settle_again(bench, new, remainder)
        fit, noise = _exchange(bench, fit, noise, len(added), remainder)
    fit, noise, added = _eliminate(bench, fit, noise, added, tests, remainder)
    return Selection(
        start, start_noise, fit, noise, len(added), tuple(p for _, p in added), tuple(candidates), tests
    )


def _settle_again(bench: Bench, fit: Fit, remainder: float) -> tuple[Fit, NoiseFloor]:
    noise = bench.with_remainder(bench.noise(fit), fit, remainder)
    fit = bench.refine(bench.anchored(fit.effects, fit.parameters), noise)
    return fit, noise


def _next(
    bench: Bench, fit: Fit, noise: NoiseFloor, candidates: list[Candidate], tests: int
) -> tuple[Fit, float] | None:
    """The best candidate refitted with everything free, None where none is worth it."""
    worth = [
        c for c in candidates if c.gain > 0.0 and significance(c.gain, c.columns, tests, fit, noise) < 10 * FAMILY_LEVEL
    ]
    best: tuple[float, Fit, float] | None = None
    for candidate in worth[:FINALISTS]:
        new = bench.refine((*fit.effects, candidate.effect), noise)
        gain = fit.statistic - new.statistic
        p_value = significance(gain, candidate.columns, tests, fit, noise)
        if p_value > FAMILY_LEVEL or gain < USEFUL_SHARE * fit.excess or not _physical(bench, new, -1):
            continue
        score = new.statistic + penalty(candidate.effect, bench)
        if best is None or score < best[0]:
            best = (score, new, p_value)
    return None if best is None else (best[1], best[2])


def penalty(effect: Effect, bench: Bench) -> float:
    """Price of the parameters of an effect in units of the statistic, so that the simpler of two equals wins."""
    count = len(effect.columns(bench.robot)) + len(free_shapes((effect,)))
    return count * float(np.log(2.0 * len(bench.data.equations) * bench.data.harmonics))


def _physical(bench: Bench, fit: Fit, position: int) -> bool:
    """Whether an effect of a model respects the signs that physics demands, within two standard deviations."""
    position %= len(fit.effects)
    counts = bench.counts(fit.effects)
    start = sum(counts[:position])
    for k, column in enumerate(fit.effects[position].columns(bench.robot), start=start):
        if column.nonnegative and fit.values[k] < -2.0 * fit.std(k):
            return False
    return True


def _exchange(
    bench: Bench, fit: Fit, noise: NoiseFloor, added: int, remainder: float
) -> tuple[Fit, NoiseFloor]:
    """Replace effects that were added by better ones, now that the others are there."""
    if added < 2:
        return fit, noise
    for position in range(len(fit.effects) - added, len(fit.effects)):
        others = [e for k, e in enumerate(fit.effects) if k != position]
        reduced = bench.fit(others, noise)
        own = effect_key(fit.effects[position])
        best = fit
        for candidate in [c for c in scan(bench, reduced, noise) if c.key != own][:2]:
            if candidate.gain < 0.8 * (reduced.statistic - fit.statistic):
                continue
            changed = [*others[:position], candidate.effect, *others[position:]]
            new = bench.refine(changed, noise)
            better = best.statistic + penalty(best.effects[position], bench)
            if new.statistic + penalty(candidate.effect, bench) < better - 1.0 and _physical(bench, new, position):
                best = new
        if best is not fit:
            fit, noise = _settle_again(bench, best, remainder)
    return fit, noise


def _eliminate(
    bench: Bench,
    fit: Fit,
    noise: NoiseFloor,
    added: list[tuple[Effect, float]],
    tests: int,
    remainder: float,
) -> tuple[Fit, NoiseFloor, list[tuple[Effect, float]]]:
    """Take out effects that are no longer needed."""
    while len(added) > 1:
        first = len(fit.effects) - len(added)
        scores = []
        for position in range(first, len(fit.effects)):
            without = bench.refine([e for k, e in enumerate(fit.effects) if k != position], noise)
            loss = without.statistic - fit.statistic
            columns = max(len(fit.effects[position].columns(bench.robot)), 1)
            scores.append((significance(loss, columns, tests, without, noise), position, without))
        worst = max(scores, key=lambda s: s[0])
        if worst[0] <= FAMILY_LEVEL:
            break
        fit, noise = _settle_again(bench, worst[2], remainder)
        del added[worst[1] - first]
    return fit, noise, added
