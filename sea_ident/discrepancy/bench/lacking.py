"""What a model may lack: every effect of the library at every place that it does not have yet."""

from collections.abc import Sequence

from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.columns import effect_key
from sea_ident.effects import Effect, effect_classes
from sea_ident.effects.drift import TrendEffect

ONLY_AGAINST_REFERENCE = ("payload",)
"""Effects that a fit of all parameters absorbs altogether."""

ONLY_BEFORE_ALL = ("joint_placement",)
"""Effects that are tried before a search, and not step by step: they would bend to whatever is alike in many joints."""


def candidate_effects(bench: Bench, effects: Sequence[Effect]) -> tuple[Effect, ...]:
    """Every effect of the library at every place that the model does not have yet, and that shows in the mean."""
    present = {effect_key(effect) for effect in effects}
    present_columns = {column.name for column in bench.labels(effects)}
    found = []
    for name, kind in sorted(effect_classes().items()):
        if name in (*ONLY_AGAINST_REFERENCE, *ONLY_BEFORE_ALL) or issubclass(kind, TrendEffect):
            continue
        for place in kind.instances(bench.robot):
            effect = _absent(bench, place, effect_key(place) in present, present_columns)
            if effect is not None:
                found.append(effect)
    return tuple(found)


def _absent(bench: Bench, place: Effect, taken: bool, present_columns: set[str]) -> Effect | None:
    """The effect, or where its place is taken the form of it that can stand beside what is there; None where none can.

    Args:
        bench: the recording.
        place: the effect.
        taken: whether the model has it in one form or other.
        present_columns: names of the parameters of the model.
    """
    effect: Effect | None = place
    if taken and place.beside() is None:
        return None
    while effect is not None and {column.name for column in effect.columns(bench.robot)} & present_columns:
        effect = effect.beside()
    return effect
