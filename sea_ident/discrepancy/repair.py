"""The model with what was found."""

import warnings as python_warnings

from sea_ident.discrepancy.fit import Fit
from sea_ident.effects import Side, spring_effects
from sea_ident.estimation import Model, identify
from sea_ident.exceptions import SeaIdentError, SeaIdentWarning
from sea_ident.processing import ProcessedRecording


def repaired_model(model: Model, processed: ProcessedRecording, fit: Fit) -> Model | None:
    """The model identified anew with the effects that were found; None where that is not possible.

    Args:
        model: the model that was diagnosed.
        processed: the recording.
        fit: the fit with the effects.

    Returns:
        A model like any other.
    """
    law = set(spring_effects(model.robot))
    effects = tuple(effect for effect in fit.effects if effect.side is not Side.SPRING or effect not in law)
    try:
        with python_warnings.catch_warnings():
            python_warnings.simplefilter("ignore", SeaIdentWarning)
            return identify(model.robot, processed, effects=effects)
    except SeaIdentError:
        return None
