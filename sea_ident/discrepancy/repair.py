"""The model with what was found."""

import warnings as python_warnings

import numpy as np

from sea_ident.discrepancy.bench import Fit
from sea_ident.effects import Effect, Side
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
    effects = tuple(effect for effect in fit.effects if effect.side is not Side.SPRING)
    try:
        with python_warnings.catch_warnings():
            python_warnings.simplefilter("ignore", SeaIdentWarning)
            return identify(model.robot, processed, effects=effects)
    except SeaIdentError:
        return None


def spring_additions(model: Model, fit: Fit) -> tuple[tuple[Effect, tuple[float, ...]], ...]:
    """Effects in the springs that were found, with their values: they cancel in the motor torque of a model."""
    own = {"spring_stiffness", "spring_stiffening", "spring_damping"}
    return tuple(
        (e, tuple(float(np.float64(fit.parameters[c.name])) for c in e.columns(model.robot)))
        for e in fit.effects
        if e.side is Side.SPRING and e.name not in own
    )
