"""What a report is about."""

from dataclasses import dataclass

from sea_ident.discrepancy.result.diagnosis import Diagnosis
from sea_ident.estimation import Model
from sea_ident.excitation import Excitation
from sea_ident.validation import Validation


@dataclass(frozen=True, eq=False)
class Content:
    """Model, diagnosis and data of one report.

    Attributes:
        model: the model, None where there is a diagnosis alone.
        excitation: the motion that the robot was asked for, None where not given.
        validations: comparisons with recordings that were not used in the fit.
        diagnosis: what is missing in a model, None where it was not diagnosed.
    """

    model: Model | None = None
    excitation: Excitation | None = None
    validations: tuple[Validation, ...] = ()
    diagnosis: Diagnosis | None = None
