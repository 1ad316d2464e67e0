"""A model without the terms that every drive has is completed before anything finer is looked for.

Every finer form of friction holds Coulomb or viscous friction as a limit, so where one of these is missing the finer
forms stand in for it, and a comparison between them is about the wrong question.
"""

from dataclasses import dataclass, replace

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.judge import significance
from sea_ident.discrepancy.bench.lacking import candidate_effects
from sea_ident.discrepancy.bench.physics import physical
from sea_ident.discrepancy.bench.settle import Settled, settle
from sea_ident.discrepancy.search.candidates import scan
from sea_ident.discrepancy.search.next_effect import FAMILY_LEVEL
from sea_ident.discrepancy.search.search import Selection
from sea_ident.effects import Effect
from sea_ident.effects.base import titled

BASIC = ("coulomb_friction", "viscous_friction", "torque_offset")
"""Terms of every drive."""

FRICTION = BASIC[:2]
"""Terms whose absence says that a model is not complete."""

SAME = 0.99
"""Share of the power of one column in the span of another from which on the two are the same in this motion."""


@dataclass(frozen=True, eq=False)
class Completed:
    """A model that was given the terms that every drive has.

    Attributes:
        selection: the model before and after.
        warnings: what was done, and what else the terms could be.
    """

    selection: Selection
    warnings: tuple[str, ...]


def missing_friction(effects: tuple[Effect, ...], joints: tuple[str, ...]) -> tuple[tuple[str, str], ...]:
    """Effect and joint of every basic friction that a model does not have."""
    present = {(effect.name, effect.joint) for effect in effects}
    return tuple((name, joint) for joint in joints for name in FRICTION if (name, joint) not in present)


def completed(bench: Bench) -> Completed | None:
    """Add basic terms that the data ask for; None where the model has all friction, or the data ask for none.

    They keep the shape that they have in a model by default; the next diagnosis refines it.

    Args:
        bench: the recording and the model.

    Returns:
        The completed model.
    """
    lacking = missing_friction(bench.effects, bench.robot.joint_names)
    if not lacking:
        return None
    joints = {joint for _, joint in lacking}
    wanted = [
        effect
        for effect in candidate_effects(bench, bench.effects)
        if effect.name in BASIC and (effect.name == "torque_offset" or (effect.name, effect.joint) in lacking)
        if effect.joint in joints
    ]
    now = start = settle(bench, bench.effects)
    p_values: list[float] = []
    names: list[str] = []
    while wanted:
        found = scan(bench, now.fit, now.noise, wanted)
        tests = max(sum(c.tests for c in found), 1)
        accepted = None
        for candidate in found:
            if candidate.gain <= 0.0:
                break
            fit, plain = now.fit, next(e for e in wanted if e.name == candidate.effect.name)
            plain = replace(plain, joint=candidate.effect.joint)
            new = bench.fit((*fit.effects, plain), now.noise, start=fit.parameters)
            p_value = significance(fit.statistic - new.statistic, candidate.columns, tests, fit, now.noise)
            if p_value <= FAMILY_LEVEL and physical(bench, new, -1):
                accepted = candidate, new, p_value
                break
        if accepted is None:
            break
        candidate, new, p_value = accepted
        now = Settled(new, bench.noise(new))
        now = Settled(bench.fit(new.effects, now.noise, start=new.parameters), now.noise)
        p_values.append(p_value)
        names.append(candidate.effect.title)
        done = (candidate.effect.name, candidate.effect.joint)
        wanted = [effect for effect in wanted if (effect.name, effect.joint) != done]
    if not p_values:
        return None
    candidates = tuple(scan(bench, now.fit, now.noise))
    tests = max(sum(c.tests for c in candidates), 1)
    selection = Selection(start, now, len(p_values), tuple(p_values), candidates, tests)
    warnings = (
        f"the model had no {', '.join(titled(*each) for each in lacking)}: the basic terms that the data "
        f"ask for ({', '.join(names)}) were added before anything finer was looked for; diagnose the completed model",
        *_same(bench, selection),
    )
    return Completed(selection, warnings)


def _same(bench: Bench, selection: Selection) -> list[str]:
    """What the offsets that were added could be as well: effects with the same column in this motion."""
    fit = selection.final.fit
    out = []
    for effect in selection.effects:
        if effect.name != "torque_offset":
            continue
        own = _unit(bench.column_spectra(effect, fit.effects))
        others = []
        for other in candidate_effects(bench, fit.effects):
            if other.joint not in (None, effect.joint) or other.shapes or other.name in ("external_force",):
                continue
            anchored = bench.anchored((*fit.effects, other), fit.parameters)[-1]
            columns = bench.column_spectra(anchored, fit.effects)
            if any(abs(float(_unit(columns[:, :, k : k + 1]) @ own)) ** 2 > SAME for k in range(columns.shape[2])):
                others.append(other.name)
        if others:
            out.append(f"torque_offset at {effect.joint} may as well be {' or '.join(others)}: the same in this motion")
    return out


def _unit(spectra: np.typing.NDArray[np.complex128]) -> FloatArray:
    """(M,) the first column as a vector of length one, zero where there is nothing in it."""
    flat = np.concatenate([spectra[:, :, 0].real.ravel(), spectra[:, :, 0].imag.ravel()])
    size = float(np.linalg.norm(flat))
    return np.asarray(flat / size if size > 0.0 else flat, dtype=np.float64)
