"""Against an earlier model, beside what was found in a recording."""

import warnings as python_warnings
from collections.abc import Sequence

from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.columns import effect_key
from sea_ident.discrepancy.bench.settle import Settled
from sea_ident.discrepancy.compared.reference import MOST, ParameterChange, compare_with_reference
from sea_ident.discrepancy.result.repair import identified_beside
from sea_ident.effects import Effect, spring_effects
from sea_ident.estimation import Model, identify
from sea_ident.exceptions import SeaIdentError, SeaIdentWarning
from sea_ident.processing import ProcessedRecording


def against(
    reference: Model | None, bench: Bench, found: Settled, processed: ProcessedRecording
) -> tuple[ParameterChange | None, tuple[str, ...]]:
    """How the parameters differ from those of an earlier model, and why that cannot be said where it cannot.

    Args:
        reference: the earlier model; None where there is none.
        bench: the recording.
        found: the model with what was found in it.
        processed: the recording as `identify` processes it.

    Returns:
        The change, and what is to be told.
    """
    if reference is None:
        return None, ()
    try:
        return smallest_change(reference, bench, found, processed), ()
    except SeaIdentError as error:
        text = "not compared with the reference, whose effects this recording does not determine beside what was found"
        return None, (f"{text}: {error}",)


def smallest_change(reference: Model, bench: Bench, found: Settled, processed: ProcessedRecording) -> ParameterChange:
    """The change of the parameters beside what was found, each taken as what asks for the smaller change.

    What the reference lacks was there before, and bends its parameters: then both must lack it, to be bent alike. Or it
    is new: then it would count as a change of what takes it up.

    Args:
        reference: the earlier model.
        bench: the recording.
        found: the model with what was found in it.
        processed: the recording as `identify` processes it.

    Returns:
        The change.

    Raises:
        IdentificationError: the recording does not determine the effects.
    """

    def change(new: Sequence[Effect]) -> ParameterChange:
        compared = (
            compare_with_reference(now, reference, bench.data)
            for now in identified_like(reference, bench, found, processed, new)
        )
        return min(compared, key=_size)

    lacking = lacking_in(reference, found.fit.effects, bench)
    least, new = change(()), list[Effect]()
    if not least.changed or not lacking:
        return least
    every = change(lacking)
    if _size(every) < _size(least):
        least, new = every, list(lacking)
    for effect in lacking if len(lacking) > 1 else ():
        if not least.changed:
            break
        other = [e for e in lacking if (e in new) is not (e is effect)]
        tried = change(other)
        if _size(tried) < _size(least):
            least, new = tried, other
    return least


def lacking_in(reference: Model, effects: Sequence[Effect], bench: Bench) -> tuple[Effect, ...]:
    """Those of some effects, the law of springs apart, that an earlier model does not have in any form."""
    has = {
        effect_key(effect) for effect in (*reference.effects, *reference.spring_effects, *spring_effects(bench.robot))
    }
    return tuple(effect for effect in effects if effect_key(effect) not in has)


def identified_like(
    reference: Model, bench: Bench, found: Settled, processed: ProcessedRecording, new: Sequence[Effect] = ()
) -> tuple[Model, ...]:
    """Models of a recording identified as the earlier one: what that lacks spoils both in the same way.

    The first as `identify` gives it, the second with what a diagnosis tells beside: whether the earlier one was
    repaired is not known.

    Args:
        reference: the earlier model.
        bench: the recording.
        found: the model with what was found in it.
        processed: the recording as `identify` processes it.
        new: effects that the earlier model lacked rightly.

    Returns:
        Models with the effects of the earlier one, their shapes among them, and those that are new after them; the
        first alone where the fit of a diagnosis does not tell what it would be asked either.

    Raises:
        IdentificationError: the recording does not determine it.
    """
    effects = (*reference.effects, *reference.spring_effects, *new)
    with python_warnings.catch_warnings():
        python_warnings.simplefilter("ignore", SeaIdentWarning)
        plain = identify(bench.robot, processed, effects=effects)
    fit = bench.fit((*effects, *spring_effects(bench.robot)), found.noise, start=found.fit.parameters)
    try:
        return plain, identified_beside(bench.robot, processed, effects, fit)
    except SeaIdentError:
        return (plain,)


def _size(change: ParameterChange) -> tuple[bool, int, float, float]:
    """Smaller is a change that is none, then one of fewer patterns, then one that is more likely chance.

    Of a change that is there for certain its probability says nothing: what a model lacks widens its covariance too.
    """
    return change.changed, len(change.missing) or MOST + 1, -change.p_value, change.torque_change
